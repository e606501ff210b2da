"""Pasted text is read as what it was: code without fences or indentation, lists, headings."""

from busflow_assistant.passages import PassageShape
from busflow_assistant.plain_text import read_text


def shapes(source: str) -> dict[str, str]:
    page = read_text("", source)
    return {page.text(unit): passage.shape.value for passage in page.passages for unit in passage.units}


def test_code_without_indentation_is_code(ros2_lab: str):
    found = shapes(ros2_lab)
    code = [line for line in ros2_lab.splitlines() if "create_" in line or line.startswith(("def ", "class ", "self."))]
    assert len(code) > 10
    assert {found[line] for line in code} == {"code"}


def test_prose_beside_code_is_prose(ros2_lab: str):
    found = shapes(ros2_lab)
    assert found["Check the data with ros2 topic echo /balance_state."] == "prose"
    assert found["Change the publishing rate to 50 Hz."] == "prose"


def test_heading_stands_above_what_follows(ros2_lab: str):
    page = read_text("", ros2_lab)
    passage = next(each for each in page.passages if "balance metric" in page.text(each.span))
    assert passage.headings[-1] == "Step 3: The sensor processor"


def test_table_of_a_page_has_tabs():
    page = read_text("", "key\twhat\ndepth\thow many\n")
    assert [each.shape for each in page.passages] == [PassageShape.TABLE]


def test_units_are_verbatim(ros2_lab: str):
    page = read_text("", ros2_lab)
    assert all(page.text(unit) in ros2_lab for passage in page.passages for unit in passage.units)
