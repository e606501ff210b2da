"""RunParameters: a run's parameters as viewers name them, such as `/sensor_publisher.noise.imu`.

Everything here asks the run and waits, and is for one thread at a time. The run validates what is set.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from busflow.commands import finite
from busflow.errors import BusflowError, NoSuchTarget
from busflow.text import did_you_mean, printable

if TYPE_CHECKING:
    from busflow.commands import Peer

_DOUBLE, _DOUBLES = 3, 8
"""ROS 2's numbers of the types whose values JSON can write as whole numbers."""


class RunParameters:
    """Parameters of every busflow node of a run."""

    def __init__(self, peer: Peer) -> None:
        self._peer = peer
        self._last_seen: dict[str, int] | None = None

    def get(self, names: Iterable[str] = ()) -> list[dict[str, Any]]:
        """Return the parameters of these names, or all if none is given; unknown names are left out."""
        wanted = set(names)
        return [_row(name, row["value"], row["ros_type"]) for name, row in self._rows().items() if _in(name, wanted)]

    def set(self, values: Mapping[str, Any]) -> list[str]:
        """Set parameters, those of one node all or none; return the reasons why some were not set."""
        rows = self._rows()
        by_node: dict[str, dict[str, Any]] = {}
        reasons: list[str] = []
        for name, value in values.items():
            if name not in rows:
                reasons.append(f"there is no parameter {printable(name, limit=200)}; {did_you_mean(name[:200], rows)}")
            elif value is None:
                reasons.append(f"{name} was not removed: a node's parameters are always there")
            else:
                node, _, own = name.partition(".")
                by_node.setdefault(node, {})[own] = value
        for node, own in by_node.items():
            reasons += self._set(node, own)
        return reasons

    def changes(self) -> list[dict[str, Any]]:
        """Return the parameters set since the last call, with their values now; after the first call none is missed."""
        if self._last_seen is None:
            self._last_seen = {each["process"]: each["last"] for each in self._peer.ask("parameter_changes")}
            return []
        names: set[str] = set()
        for answer in self._peer.ask("parameter_changes", since=self._last_seen):
            self._last_seen[answer["process"]] = answer["last"]
            names |= {f"{change['node']}.{change['name']}" for change in answer["changes"]}
        return self.get(names) if names else []

    def forget(self) -> None:
        """Forget the values: without a listening viewer, later changes are not sent."""
        self._last_seen = None

    def _set(self, node: str, values: Mapping[str, Any]) -> list[str]:
        """Set parameters of one node."""
        for answer in self._ask_to_set(node, values):
            return [f"{node}: {_sentence(fault)}" for fault in answer["faults"]]
        return [f"{node} has gone"]

    def _ask_to_set(self, node: str, values: Mapping[str, Any]) -> Sequence[Any]:
        try:
            return self._peer.ask("set_parameters", node=node, values=values)
        except NoSuchTarget:
            return []
        except BusflowError as error:
            return [{"faults": [{"message": str(error), "fix": None}]}]

    def _rows(self) -> dict[str, Mapping[str, Any]]:
        found: dict[str, Mapping[str, Any]] = {}
        for answer in self._peer.ask("parameters"):
            for node, rows in answer.items():
                found |= {f"{node}.{row['name']}": row for row in rows}
        return dict(sorted(found.items()))


def _in(name: str, wanted: set[str]) -> bool:
    return not wanted or name in wanted


def _row(name: str, value: Any, ros_type: int) -> dict[str, Any]:
    """Return a parameter in the protocol's words; one without a value has none there either."""
    if value is None:
        return {"name": name}
    row: dict[str, Any] = {"name": name, "value": finite(value)}
    if ros_type in (_DOUBLE, _DOUBLES) and not isinstance(row["value"], str):
        row["type"] = "float64" if ros_type == _DOUBLE else "float64_array"
    return row


def _sentence(fault: Mapping[str, Any]) -> str:
    return f"{fault['message']} ({fault['fix']})" if fault["fix"] else str(fault["message"])
