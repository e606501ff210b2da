"""Sizes as people write them."""

import pytest

from busflow.validation.byte_sizes import parse_size


@pytest.mark.parametrize(
    ("text", "size"),
    [("1B", 1), ("64MiB", 64 << 20), (" 1.5 GB ", 1_500_000_000), ("2KiB", 2048), (7, 7), ("3kB", 3000)],
)
def test_a_size_is_read(text, size):
    assert parse_size(text) == size


@pytest.mark.parametrize(
    "text", ["", "64", "64mb", "-1MB", 0, -1, True, 1.5, None, "0.1B", "9999999GiB", "1" * 50 + "B"]
)
def test_what_is_no_size_is_refused(text, golden):
    with golden.raises(ValueError):
        parse_size(text)
