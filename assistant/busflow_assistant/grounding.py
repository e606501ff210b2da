"""A model's answer as it comes → its whole sentences, as far as the cited text supports them."""

from __future__ import annotations

from dataclasses import dataclass, field

from busflow_assistant.passages import Extent
from busflow_assistant.sentences import sentences
from busflow_assistant.support import Unsupported, unsupported


@dataclass(slots=True)
class Grounding:
    """Takes a model's text piece by piece, and gives what may be shown of it."""

    text: str
    """The cited text, which has to support every sentence."""
    shown: list[str] = field(default_factory=list[str])
    withheld: list[tuple[str, Unsupported]] = field(default_factory=list[tuple[str, Unsupported]])
    _kept: str = ""

    def take(self, piece: str) -> list[str]:
        """Return the sentences that are complete with a piece and supported."""
        self._kept += piece
        found = sentences(self._kept, Extent(0, len(self._kept)))
        if len(found) < 2:
            return []
        complete = [self._kept[each.start : each.end] for each in found[:-1]]
        self._kept = self._kept[found[-1].start :]
        return self._checked(complete)

    def finish(self) -> list[str]:
        """Return what is left, if it is supported."""
        last, self._kept = self._kept.strip(), ""
        return self._checked([last]) if last else []

    def _checked(self, complete: list[str]) -> list[str]:
        found: list[str] = []
        for sentence in complete:
            fault = unsupported(sentence, self.text)
            if fault is None:
                found.append(sentence)
            else:
                self.withheld.append((sentence, fault))
        self.shown += found
        return found
