"""Syntax errors: each is explained at the place where it can be corrected, with a fix."""

import pytest

from busflow.errors import LaunchError
from busflow.launchfile.yaml.document import parse


@pytest.mark.parametrize(
    ("text", "place", "message", "fix"),
    [
        ("a: 1\nb:2\nc: 3\n", "2:1", "a ':' is missing after this", "write `key: value`"),
        ("a:\n    b: 1\n  c: 2\n", "3:3", "this does not line up", "indent it with 4 spaces as line 2; or not at all"),
        ("a: [1, 2\nb: 3\n", "1:4", "this bracket is never closed with ']'", "write ] at the end of line 1"),
        ("a: 1]\nb: [2]]\n", "2:7", "no bracket is open that this ']' could close", "leave it out"),
        (
            "a: 'one\nb: 'two'\n",
            "1:4",
            "this quote is closed only on line 2",
            "write ' at the end of the text",
        ),
        ("a:\n\tb: 1\n", "2:1", "a tab cannot indent", "indent with spaces"),
        ('a: "\\q"\n', "1:5", "a double-quoted text has a wrong escape", "use single quotes"),
        ("a\nb: 1\n", "2:2", "a ':' cannot stand here", "end line 1 with a ':', or quote the text"),
    ],
)
def test_syntax_error_has_its_place_and_fix(text: str, place: str, message: str, fix: str):
    with pytest.raises(LaunchError) as caught:
        parse(text.encode(), "lab1.yaml")
    (problem,) = caught.value.problems
    assert str(problem.place) == f"lab1.yaml:{place}"
    assert problem.message.startswith(message)
    assert (problem.fix or "").startswith(fix)
