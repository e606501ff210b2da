"""Tests of `tracebacks.py`: an exception is shown with the user's line, not with busflow's or a library's."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from busflow.validation.tracebacks import places, reason, shown, user_line


def caught(function: Callable[[], object]) -> BaseException:
    with pytest.raises(BaseException) as info:  # noqa: PT011  # any exception will do
        function()
    # What lies above `function` is the test's; the runtime catches just above the user's code.
    assert info.value.__traceback__ is not None
    return info.value.with_traceback(info.value.__traceback__.tb_next)


def test_user_line_precedes_the_failing_library():
    error = caught(lambda: json.loads("{"))
    place = user_line(error)
    assert place is not None
    assert Path(place.file).name == "test_tracebacks.py"
    assert place.excerpt[place.column - 1 :][: place.width] == 'json.loads("{")'


def test_columns_count_characters_not_bytes():
    place = user_line(caught(lambda: ["äöü€", [].pop()]))
    assert place is not None
    assert place.excerpt[place.column - 1 :][: place.width] == "[].pop()"


def test_exception_never_raised_has_no_place():
    assert user_line(ValueError("made, not raised")) is None


def test_code_without_a_file_has_the_running_line():
    place = user_line(caught(lambda: exec("1 / 0")))  # noqa: S102  # the case itself
    assert place is not None
    assert "exec" in place.excerpt


def test_only_the_imports_on_the_way_are_listed():
    def deep(n: int) -> None:
        if not n:
            raise ValueError
        deep(n - 1)

    assert len(places(caught(lambda: deep(5)))) == 1


def test_the_text_of_an_exception_is_one_line():
    assert reason(ValueError("a\n  b")) == "ValueError: a b"
    assert reason(ValueError()) == "ValueError"


def test_path_is_relative_to_the_current_directory(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.chdir(tmp_path)
    assert shown(tmp_path / "a/b.py") == "a/b.py"
    assert shown("/elsewhere/b.py") == "/elsewhere/b.py"
