"""A book: a folder of Markdown as a textbook, served beside a run or written as a static site. Asks no run."""
