"""Sentences → vectors, by a model of BERT's kind from a folder: tokenizers, safetensors and numpy, without torch."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float32]

MOST_TOKENS = 128
"""Tokens of a sentence that are read; the rest is ignored."""
_BATCH = 32


class Embedder:
    """A model of sentences: mean of the last layer's vectors, of length 1."""

    def __init__(self, folder: Path) -> None:
        """Load a model.

        Raises:
            OSError, ValueError, KeyError: A file is missing, or is no model of BERT's kind.
        """
        from safetensors import numpy as safetensors  # of the extra
        from tokenizers import Tokenizer  # of the extra

        config: Mapping[str, Any] = json.loads((folder / "config.json").read_text(encoding="utf-8"))
        weights = cast("dict[str, Floats]", cast("Any", safetensors).load_file(str(folder / "model.safetensors")))
        self._weights = {name.removeprefix("bert."): value.astype(np.float32) for name, value in weights.items()}
        self._layers = int(config["num_hidden_layers"])
        self._heads = int(config["num_attention_heads"])
        self._epsilon = float(config.get("layer_norm_eps", 1e-12))
        self._tokenizer: Any = Tokenizer.from_file(str(folder / "tokenizer.json"))
        self._tokenizer.no_padding()
        self._tokenizer.enable_truncation(MOST_TOKENS)

    def embed(self, texts: Sequence[str]) -> Floats:
        """Return a vector of length 1 for each text."""
        ids: list[list[int]] = [each.ids for each in self._tokenizer.encode_batch(list(texts))]
        order = sorted(range(len(ids)), key=lambda n: len(ids[n]))
        size = self._weights["embeddings.word_embeddings.weight"].shape[1]
        found = np.zeros((len(ids), size), np.float32)
        for first in range(0, len(order), _BATCH):  # of about the same length, so that little is padding
            batch = order[first : first + _BATCH]
            found[batch] = self._forward([ids[n] for n in batch])
        return found

    def _forward(self, ids: Sequence[Sequence[int]]) -> Floats:
        longest = max(map(len, ids))
        tokens = np.zeros((len(ids), longest), np.int64)
        mask = np.zeros((len(ids), longest), np.float32)
        for row, each in enumerate(ids):
            tokens[row, : len(each)] = each
            mask[row, : len(each)] = 1.0
        hidden = self._embedded(tokens)
        attention_mask = (1.0 - mask)[:, None, None, :] * np.float32(-1e9)
        for layer in range(self._layers):
            hidden = self._layer(hidden, attention_mask, f"encoder.layer.{layer}.")
        pooled = (hidden * mask[:, :, None]).sum(axis=1) / mask.sum(axis=1, keepdims=True)
        return cast("Floats", pooled / np.linalg.norm(pooled, axis=1, keepdims=True))

    def _embedded(self, tokens: npt.NDArray[np.int64]) -> Floats:
        weights = self._weights
        words = weights["embeddings.word_embeddings.weight"][tokens]
        places = weights["embeddings.position_embeddings.weight"][: tokens.shape[1]]
        kinds = weights["embeddings.token_type_embeddings.weight"][0]
        return self._normal(words + places + kinds, "embeddings.LayerNorm.")

    def _layer(self, hidden: Floats, attention_mask: Floats, name: str) -> Floats:
        attended = self._attention(hidden, attention_mask, f"{name}attention.self.")
        projected = self._linear(attended, f"{name}attention.output.dense.")
        hidden = self._normal(hidden + projected, f"{name}attention.output.LayerNorm.")
        inner = _gelu(self._linear(hidden, f"{name}intermediate.dense."))
        outer = self._linear(inner, f"{name}output.dense.")
        return self._normal(hidden + outer, f"{name}output.LayerNorm.")

    def _attention(self, hidden: Floats, attention_mask: Floats, name: str) -> Floats:
        rows, length, size = hidden.shape
        shape = (rows, length, self._heads, size // self._heads)
        query, key, value = (
            self._linear(hidden, f"{name}{part}.").reshape(shape).transpose(0, 2, 1, 3)
            for part in ("query", "key", "value")
        )
        scores = query @ key.transpose(0, 1, 3, 2) / np.float32(np.sqrt(shape[3])) + attention_mask
        scores = np.exp(scores - scores.max(axis=-1, keepdims=True))
        shares = scores / scores.sum(axis=-1, keepdims=True)
        return cast("Floats", (shares @ value).transpose(0, 2, 1, 3).reshape(rows, length, size))

    def _linear(self, values: Floats, name: str) -> Floats:
        return values @ self._weights[f"{name}weight"].T + self._weights[f"{name}bias"]

    def _normal(self, values: Floats, name: str) -> Floats:
        centred = values - values.mean(axis=-1, keepdims=True)
        spread = np.sqrt((centred**2).mean(axis=-1, keepdims=True) + self._epsilon)
        return cast("Floats", centred / spread * self._weights[f"{name}weight"] + self._weights[f"{name}bias"])


def _gelu(values: Floats) -> Floats:
    """BERT's activation; the error function is Abramowitz and Stegun's 7.1.26, right to 1.5e-7."""
    x = np.abs(values) / np.float32(np.sqrt(2))
    t = 1 / (1 + np.float32(0.3275911) * x)
    series = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))))
    error = np.sign(values) * (1 - series * np.exp(-x * x))
    return (values * np.float32(0.5) * (1 + error)).astype(np.float32)
