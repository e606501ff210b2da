"""Section: what the mappings of a launch file have in common, and the types of values that several of them have."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, cast

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, WithJsonSchema, model_validator

from busflow.launchfile.model.supervision import Restart, RestartPolicy
from busflow.validation.annotations import StrictModel
from busflow.validation.byte_sizes import PATTERN as SIZE_PATTERN
from busflow.validation.byte_sizes import parse_size
from busflow.validation.durations import PATTERN, parse_duration

_ANY_DURATION = [{"type": "number", "exclusiveMinimum": 0}, {"type": "string", "pattern": f"^{PATTERN}$"}]
Seconds = Annotated[float, BeforeValidator(parse_duration), WithJsonSchema({"anyOf": _ANY_DURATION})]
"""A duration: `50ms`, `1.5s`, or a number of seconds."""

_ANY_SIZE = [{"type": "integer", "minimum": 1}, {"type": "string", "pattern": f"^{SIZE_PATTERN}$"}]
Bytes = Annotated[int, BeforeValidator(parse_size), WithJsonSchema({"anyOf": _ANY_SIZE})]
"""A size: `64MiB`, `1.5GB`, or a number of bytes."""


class Section(StrictModel):
    """A mapping of a launch file. `x-` keys are the user's own; an empty key counts as not stated."""

    model_config: ClassVar[ConfigDict] = ConfigDict(defer_build=True)  # all of them at once, with the first file
    later: ClassVar[Mapping[str, str]] = {}
    """Keys that only later versions will know, each with what to do instead."""

    @model_validator(mode="before")
    @classmethod
    def _stated(cls, data: object) -> object:
        if not isinstance(data, Mapping):
            return {} if data is None else data
        members = cast("Mapping[str, object]", data).items()
        return {key: value for key, value in members if value is not None and not key.startswith("x-")}


class Repeatable(Section):
    """An entry that may be repeated, or left out."""

    for_each: dict[str, list[Any]] = Field(
        default_factory=dict[str, list[Any]],
        description="Repeats the entry for each item of a list, as ${each.name}; several lists: for each combination.",
    )
    when: bool = Field(default=True, description="Whether to use it: `${args.camera}`, `${args.side == 'left'}`.")


def _shorter_first(pauses: list[float]) -> list[float]:
    if pauses[0] > pauses[1]:
        raise ValueError("the first pause comes before the longest")
    return pauses


_STANDARD = RestartPolicy()


class RestartKeys(Section):
    """When a node is restarted, and after how many restarts no more. `restart: on-failure` alone takes the defaults."""

    policy: Restart = Field(description="When: never, on-failure, or always, also when its run() returns.")
    max: int = Field(default=_STANDARD.most, ge=1, description="How many restarts within the window.")
    backoff: Annotated[list[Seconds], Field(min_length=2, max_length=2), AfterValidator(_shorter_first)] = Field(
        default=[_STANDARD.first_s, _STANDARD.longest_s],
        description="The pause before the first restart, and the longest; it doubles in between.",
    )
    window: Seconds = Field(default=_STANDARD.window_s, description="The time in which the limit counts.")

    def as_policy(self) -> RestartPolicy:
        """Return the policy that the keys state."""
        return RestartPolicy(self.policy, self.max, self.backoff[0], self.backoff[1], self.window)


def _restart_word(data: object) -> object:
    """`restart: on-failure` is short for a mapping with only that."""
    return {"policy": data} if isinstance(data, str) else data


RestartValue = Annotated[RestartKeys, BeforeValidator(_restart_word)]
"""A `restart`: a word, or a mapping."""
