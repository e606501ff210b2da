"""Annotations as they are written, and what asking for them imports."""

from __future__ import annotations

from typing import TYPE_CHECKING

from busflow.validation.as_written import written_annotations
from tests.new_interpreter import printed_by

if TYPE_CHECKING:
    from nowhere import Later  # pyright: ignore[reportMissingImports]  # what only a type checker would look for


class Base:
    inherited: int


class Written(Base):
    number: float
    later: Later


def handler(self: Written, message: Later) -> None: ...


def test_class_has_its_own_as_text():
    assert written_annotations(Written) == {"number": "float", "later": "Later"}


def test_name_that_is_never_defined_is_text():
    assert written_annotations(handler) == {"self": "Written", "message": "Later", "return": "None"}


def test_reading_them_imports_nothing_heavy():
    code = "import sys; import busflow.validation.as_written; print({'pydantic', 'numpy'} & set(sys.modules))"
    assert printed_by(code) == "set()"
