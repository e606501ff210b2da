"""busflow-assistant: answers questions about pages of text from the text alone, as two nodes of busflow.

`page_index` reads Markdown and publishes it in passages; `assistant` answers `assistant/ask` with verbatim sentences.
It draws no page, which `busflow-ui` does. Below the nodes everything is plain functions of text, which know neither
busflow nor time: a question becomes terms (`question`), terms meet an index (`matching`, `search_index`), units are
ranked (`rank`, with what makes a text an answer in `evidence`), tables, lists and code are read as wholes (`read`), and
an answer is composed of verbatim text (`compose`) or refused in words (`refuse`).
"""
