"""Files that attack the reader of YAML: the payloads of `m_bad_input`, and what becomes of each."""

import math
import time
from typing import Any

import pytest
from pydantic import Field

from busflow import Parameters
from busflow.errors import InvalidParameter, LaunchError
from busflow.launchfile.yaml.document import parse, parse_value
from busflow.node.parameters import validate


def _bomb() -> str:
    lines = ["a: &a [" + "x," * 9 + "]"]
    return "\n".join([*lines, *(f"{c}: &{c} [{f'*{p},' * 9}]" for p, c in zip("abcdefgh", "bcdefghi", strict=True))])


REFUSED = {
    "yaml/alias-bomb": (_bomb(), r"lab1\.yaml:1:4: .*anchor"),
    "yaml/deep-nesting-c-loader": ("[" * 100_000 + "]" * 100_000, r"lab1\.yaml:1:66: .*deeper than 64"),
    "yaml/deep-nesting": ("[" * 2000 + "]" * 2000, r"lab1\.yaml:1:66: .*deeper than 64"),
    "yaml/big-scalars": ("".join(f"k{n}: {'x' * 1_000_000}\n" for n in range(64)), r"larger than 1024 KiB"),
    "yaml/many-keys": ("".join(f"key{n}: {n}\n" for n in range(200_000)), r"larger than 1024 KiB|at most"),
    "yaml/duplicate-keys": ("a: 1\na: 2\n", r"lab1\.yaml:2:1: .*(?s:.)*lab1\.yaml:1"),
    "yaml/python-tag": ('!!python/object/apply:os.system ["true"]', r"lab1\.yaml:1:1: .*tag"),
    "yaml/recursive-alias": ("&a [*a]", r"lab1\.yaml:1:1: .*anchor"),
    "yaml/unhashable-key": ("? [a]\n: 1\n", r"lab1\.yaml:1:3: .*key"),
    "yaml/huge-int": ("a: " + "9" * 5000, r"lab1\.yaml:1:4: .*64 bits"),
    "yaml/int-over-int64": ("a: 9223372036854775808", r"lab1\.yaml:1:4: .*64 bits"),
}
READ = {
    "yaml/sexagesimal": ("12:30:45", "12:30:45"),
    "yaml/octal": ("010", 10),
    "yaml/exponent-without-dot": ("1e3", 1000.0),
    "yaml/norway": ("no", "no"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_hostile_text_is_refused_at_once(case: str):
    text, why = REFUSED[case]
    content, began = text.encode(), time.process_time()
    with pytest.raises(LaunchError, match=why) as caught:
        parse(content, "lab1.yaml")
    assert time.process_time() - began < 2
    assert len(str(caught.value)) < 20_000


@pytest.mark.parametrize("case", READ)
def test_ambiguous_scalar_has_its_stated_meaning(case: str):
    text, value = READ[case]
    assert parse_value(text, "command line").data == value
    assert parse(f"a: {text}".encode(), "lab1.yaml").data == {"a": value}


class Ranged(Parameters):
    free: float = 0.0
    ranged: float = Field(default=0.0, ge=0, le=1)


def test_infinity_needs_a_float_without_range():
    given: Any = parse(b"a: .nan\nb: .inf", "lab1.yaml").data
    assert math.isnan(given["a"])
    assert given["b"] == math.inf
    for value in given.values():
        assert str(validate(Ranged, {"free": value}).free) == str(value)  # type: ignore[attr-defined]  # of Ranged
        with pytest.raises(InvalidParameter, match="ranged"):
            validate(Ranged, {"ranged": value})
