"""Share: which part of a run a recorder records, where each of its processes records itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

from busflow.launchfile.model.description import Compression, OnDrop, RecordSpec, SnapshotSpec, Split


@dataclass(frozen=True, slots=True)
class Share:
    """The part of a run that one process records from its start to its end, and the file for it."""

    process: str
    file: Path
    spec: RecordSpec
    nodes: frozenset[str]
    """The nodes of the whole run: messages of a node are recorded in its own process."""
    outside: Mapping[str, str]
    """The process that records messages from outside, of a terminal or a node of ROS 2, by topic."""

    def as_json(self) -> dict[str, Any]:
        """Return the share as plain data for JSON."""
        own = {"process": self.process, "file": str(self.file), "spec": asdict(self.spec)}
        return {**own, "nodes": sorted(self.nodes), "outside": dict(self.outside)}

    @classmethod
    def of_json(cls, data: Mapping[str, Any]) -> Self:
        """Return the share that `as_json` wrote.

        Raises:
            ValueError, TypeError, LookupError: This is not the data of a share.
        """
        spec = dict(data["spec"])
        spec |= {"topics": tuple(spec["topics"]), "exclude": tuple(spec["exclude"])}
        spec["split"] = None if spec["split"] is None else Split(**spec["split"])
        spec["snapshot"] = None if spec["snapshot"] is None else SnapshotSpec(**spec["snapshot"])
        spec |= {"on_drop": OnDrop(spec["on_drop"]), "compression": Compression(spec["compression"])}
        return cls(data["process"], Path(data["file"]), RecordSpec(**spec), frozenset(data["nodes"]), data["outside"])
