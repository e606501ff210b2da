"""Listed: a message's plain data with lists for all its sequences, as formats want it that know no memoryviews."""

from __future__ import annotations

from typing import Any, cast


def listed(value: Any) -> Any:
    """The data of a message, or of a part of one.

    >>> listed({"covariance": memoryview(b"ab"), "names": ("left", "right")})
    {'covariance': [97, 98], 'names': ['left', 'right']}
    """
    match value:
        case dict():
            return {name: listed(each) for name, each in cast("dict[str, Any]", value).items()}
        case tuple() | list():
            return [listed(each) for each in cast("tuple[Any, ...]", value)]
        case memoryview():
            return cast("memoryview[Any]", value).tolist()
        case _:
            return value
