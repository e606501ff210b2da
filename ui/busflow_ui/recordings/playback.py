"""Playback: the moment of a recording that a page looks at, standing or moving at a rate."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from busflow.clock import NS_PER_S


@dataclass(frozen=True, slots=True)
class Playback:
    """Moment that moves with the time of this machine while it plays. Immutable: each change gives another one."""

    start_ns: int
    end_ns: int
    stamp_ns: int
    """The moment at `since_ns`."""
    since_ns: int = 0
    """Time of this machine, on a clock that does not jump."""
    playing: bool = False
    rate: float = 1.0

    def at(self, now_ns: int) -> int:
        """Return the moment, within the recording."""
        passed_ns = round((now_ns - self.since_ns) * self.rate) if self.playing else 0
        return min(max(self.stamp_ns + passed_ns, self.start_ns), self.end_ns)

    def changed(
        self, now_ns: int, *, stamp_ns: int | None = None, playing: bool | None = None, rate: float | None = None
    ) -> Playback:
        """Return it with another moment, at rest or not, or at another rate, from now on."""
        return replace(
            self,
            stamp_ns=min(max(self.at(now_ns) if stamp_ns is None else stamp_ns, self.start_ns), self.end_ns),
            since_ns=now_ns,
            playing=self.playing if playing is None else playing,
            rate=self.rate if rate is None else rate,
        )

    def as_json(self, now_ns: int) -> dict[str, Any]:
        """Return what a page shows of it; moments are text, since numbers of a browser lose nanoseconds."""
        at_ns = self.at(now_ns)
        return {
            "start_ns": str(self.start_ns),
            "end_ns": str(self.end_ns),
            "stamp_ns": str(at_ns),
            "playing": self.playing and at_ns < self.end_ns,
            "rate": self.rate,
        }

    @property
    def duration_s(self) -> float:
        """Length of the recording."""
        return (self.end_ns - self.start_ns) / NS_PER_S
