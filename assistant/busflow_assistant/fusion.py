"""Terms and meaning together: the best units by their terms, ordered anew with the similarity of a sentence model."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from busflow_assistant.markdown import plain
from busflow_assistant.rank import Ranked

RERANKED = 30
"""Units that are compared by meaning: a vector takes 10 to 20 ms the first time."""
MEANING = 8.0
"""How much the similarity counts beside the score of the terms."""
USUAL = 0.4
"""The similarity of an answer that speaks neither for it nor against it."""
_KEPT = 20_000
"""Vectors that are kept: 30 MB."""


class SentenceModel(Protocol):
    """A model that turns texts into vectors of length 1."""

    def embed(self, texts: Sequence[str]) -> npt.NDArray[np.float32]:
        """Return a vector for each text."""
        ...


class Fusion:
    """Orders units by terms and by meaning; the vectors of units are made once."""

    def __init__(self, model: SentenceModel) -> None:
        self._model = model
        self._vectors: OrderedDict[str, npt.NDArray[np.float32]] = OrderedDict()

    def fused(self, question: str, ranked: Sequence[Ranked]) -> list[Ranked]:
        """Return units, the best first, the first of them by their meaning too."""
        if not ranked:
            return []
        texts = [plain(each.unit.text) for each in ranked[:RERANKED]]
        asked = self._model.embed([question])[0]
        similar = [float(vector @ asked) for vector in self._embedded(texts)]
        first = [
            replace(each, score=each.score + MEANING * (value - USUAL), similarity=value)
            for each, value in zip(ranked, similar, strict=False)
        ]
        return sorted(first, key=lambda each: -each.score)

    def _embedded(self, texts: Sequence[str]) -> list[npt.NDArray[np.float32]]:
        missing = [text for text in dict.fromkeys(texts) if text not in self._vectors]
        if missing:
            self._vectors.update(zip(missing, self._model.embed(missing), strict=True))
        found = [self._vectors[text] for text in texts]
        while len(self._vectors) > _KEPT:
            self._vectors.popitem(last=False)
        return found
