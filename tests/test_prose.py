"""`.ci/prose` finds faults in the prose that a change adds, and in no older prose."""

import re
import subprocess
import sys
from pathlib import Path

PROSE = Path(__file__).parents[1] / ".ci/prose"
LONG = "It has one word after another " * 5
OLD = f"# Page\n\nWhat it keeps is old. {LONG}\n\nA short sentence.\n"
PAGE = f"""# Page

What it keeps is old. {LONG}

A sentence that goes
on, what is bad, and ends. What is a question?

- An item says what it is.
- {LONG}

| a table | What it holds |

```
What it prints is code.
```
"""
CODE = f'''"""Docstring."""

THOSE = "those of code"  # a plain comment
# Those of a comment
raise ValueError(
    f"the node {{THOSE}} was told so",
    "{LONG}",
)
'''
CODE_OF_TEST = f'"""Those of a docstring."""\n\nTEXT = "{LONG}"\n'


def test_only_added_prose_is_checked(tmp_path):
    def git(*words: str) -> None:
        identity = ["-c", "user.name=a", "-c", "user.email=a@example.org", "-c", "commit.gpgsign=false"]
        subprocess.run(["git", *identity, *words], cwd=tmp_path, check=True, capture_output=True)

    def found() -> tuple[int, set[str]]:
        ended = subprocess.run([sys.executable, PROSE, "base"], cwd=tmp_path, capture_output=True, text=True)
        return ended.returncode, set(re.findall(r"^(?:\w{7,}: )?(.*?: .*?|over .*?): ", ended.stdout, re.MULTILINE))

    git("init", "-q")
    (tmp_path / "page.md").write_text(OLD)
    git("add", "page.md")
    git("commit", "-qm", "What it was, told at length: " + LONG)
    git("branch", "base")
    assert found() == (0, set())

    (tmp_path / "page.md").write_text(PAGE)
    git("commit", "-qam", "x" * 73)
    (tmp_path / "tests").mkdir()
    (tmp_path / "code.py").write_text(CODE)
    (tmp_path / "tests/test_code.py").write_text(CODE_OF_TEST)
    git("add", ".")
    assert found() == (
        1,
        {
            "page.md:5: headless 'what'",
            "page.md:9: over 25 words",
            "page.md:11: headless 'what'",
            "code.py:3: no noun before 'of'",
            "code.py:4: no noun before 'of'",
            "code.py:6: plainer word",
            "code.py:7: over 25 words",
            "tests/test_code.py:1: no noun before 'of'",
            "over 72 characters",
        },
    )
