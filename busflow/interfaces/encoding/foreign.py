"""`ForeignType`: a type known by a peer's description, for processes without its class."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, cast

from busflow.errors import MalformedMessage
from busflow.interfaces.encoding import json_form
from busflow.interfaces.encoding.description import TypeDescription, check, rihs01
from busflow.interfaces.encoding.msg_text import ENCODING, ros2msg
from busflow.interfaces.encoding.plain_reader import decoder_from_description, measure_from_description
from busflow.interfaces.encoding.plain_writer import encoder_from_description
from busflow.interfaces.encoding.viewer_schema import recorded_definition


class ForeignType:
    """Reads and writes messages as plain values, by a description that is checked against its hash.

    Raises:
        MalformedMessage: the description is malformed, or does not match the hash.
    """

    def __init__(self, name: str, type_hash: str, description: object) -> None:
        self.name: str = name
        self.type_hash: str = type_hash
        self.is_ros: bool = not type_hash.startswith(json_form.PREFIX)
        self.encoding = "cdr" if self.is_ros else "json"
        """The encoding of the bytes, in MCAP's word."""
        self.definition_encoding = ENCODING if self.is_ros else "jsonschema"
        """The format of `definition`, in MCAP's word."""
        try:
            self.description: Any = check(description) if self.is_ros else description
            found = rihs01(self.description) if self.is_ros else json_form.type_hash(self.description)
        except (AttributeError, TypeError, RecursionError):
            raise MalformedMessage("the description is no JSON Schema", type_name=name) from None
        if found != type_hash:
            raise MalformedMessage(f"the description's hash is {found}, not {type_hash}", type_name=name)
        if self.is_ros and self.description["type_description"]["type_name"] != name:
            raise MalformedMessage("the description is of another type", type_name=name)

    @cached_property
    def definition(self) -> str:
        """The description as text, as recordings hold it: the `.msg` file with those it needs, or the JSON Schema."""
        if self.is_ros:
            return ros2msg(cast("TypeDescription", self.description))
        return recorded_definition(self.description)

    @cached_property
    def decode(self) -> Callable[[bytes | bytearray | memoryview], Any]:
        """Decode bytes to a plain value. Raises MalformedMessage if they are not a message."""
        if self.is_ros:
            return decoder_from_description(self.description)
        return lambda payload: json_form.decode_json(payload, self.name)

    def without_surplus(self, payload: bytes) -> bytes:
        """Return the message at the start of the bytes, without the bytes that follow it.

        Some viewers send the whole buffer in which they have written. Raises MalformedMessage where there is none.
        """
        if self.is_ros:
            return payload[: self._measure(payload)]
        self.decode(payload)  # JSON ends where it ends: what follows is an error
        return payload

    @cached_property
    def _measure(self) -> Callable[[bytes], int]:
        return measure_from_description(self.description)

    @cached_property
    def encode(self) -> Callable[[Mapping[str, Any]], bytes]:
        """Encode a mapping as a message. Raises MalformedMessage if a value does not fit.

        The receiver checks whether JSON fits its schema.
        """
        if self.is_ros:
            return encoder_from_description(self.description)
        return lambda values: json.dumps(values).encode()
