"""Runs the Python snippets of README.md and the docs as tests; a `<!-- skip: next -->` before one needs its reason."""

from sybil import Sybil
from sybil.parsers.markdown import PythonCodeBlockParser, SkipParser

pytest_collect_file = Sybil(parsers=[PythonCodeBlockParser(), SkipParser()], patterns=["*.md"]).pytest()
