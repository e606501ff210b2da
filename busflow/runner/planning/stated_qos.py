"""`StatedQoS`: where an endpoint's QoS or type is written, in the launch file or on a line of its node's class."""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import TYPE_CHECKING

from busflow.launchfile.model.problems import key_origin
from busflow.validation.tracebacks import line

if TYPE_CHECKING:
    from busflow.bus.endpoint import Endpoint, ServiceEndpoint
    from busflow.errors import Place
    from busflow.launchfile.model.description import EndpointSpec, TopicSpec
    from busflow.runner.planning.planned_node import PlannedNode


@dataclass(frozen=True, slots=True)
class StatedQoS:
    """Place where one end of a topic states fields of its QoS, and how to state others."""

    place: tuple[Place, ...]
    """The place and the `include` entries that led there; empty where nothing states the fields."""
    fix: str

    @classmethod
    def of(
        cls,
        section: str,
        planned: PlannedNode,
        endpoint: Endpoint,
        wanted: Sequence[str],
        topics: Sequence[TopicSpec],
    ) -> StatedQoS:
        """Find where an endpoint states the fields that it should have as `wanted`, such as `reliability: best_effort`.

        Args:
            section: The key of the launch file for endpoints of this kind, `publishers` or `subscriptions`.
            planned: The endpoint's node.
            endpoint: The endpoint.
            wanted: The fields as they should be.
            topics: The topic entries of the launch file.
        """
        spec, keys = planned.spec, [each.partition(":")[0] for each in wanted]
        own: Sequence[EndpointSpec] = getattr(spec, section) if spec is not None else ()
        here = [each for each in own if spec and each.full_topic(spec.name, spec.namespace) == endpoint.topic]
        for entry in (*here, *(each for each in topics if each.topic == endpoint.topic)):
            if _states(entry.qos.model_fields_set, keys):
                place = _place_in(entry, keys)
                return cls(place, f"write {' and '.join(wanted)}{f' at {place[0]}' if place else ''}")
        where = f" ({spec.origin.place})" if spec is not None and spec.origin.place else ""
        fix = f"set {' and '.join(wanted)} on the {section.removesuffix('s')}"
        if spec is not None:
            lines = f"{section}: {{{endpoint.topic}: {{{', '.join(wanted)}}}}}"
            fix = f"write `{lines}` below {spec.full_name.removeprefix('/')}{where}"
        return cls(_line_of(planned, endpoint) if _states(endpoint.stated, keys) else (), fix)


def type_place(planned: PlannedNode, endpoint: Endpoint | ServiceEndpoint) -> tuple[Place, ...]:
    """Return where an endpoint got its name and type: its remap in the launch file, else its line in the class."""
    for rule in planned.spec.remap if planned.spec is not None and endpoint.remap_rule else ():
        if rule.match == endpoint.remap_rule:
            return rule.origin.trail
    return _line_of(planned, endpoint)


def _place_in(entry: EndpointSpec, keys: Sequence[str]) -> tuple[Place, ...]:
    """Return the place of the first of these keys in an entry, or that of its profile's name."""
    for key in keys:
        for name in (key, f"{key}_s"):
            if name in entry.stated.members:
                return key_origin(entry.stated.members[name]).trail
    return entry.stated.origin.trail


def _line_of(planned: PlannedNode, endpoint: Endpoint | ServiceEndpoint) -> tuple[Place, ...]:
    return (line(*endpoint.line), *planned.trail) if endpoint.line is not None else ()


def _states(fields: AbstractSet[str], keys: Sequence[str]) -> bool:
    return any({key, f"{key}_s"} & fields for key in keys)
