"""A model of sentences from a folder, and the order of units by terms and meaning: `embedder` and `fusion`."""

import json
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save_file
from tokenizers import Tokenizer
from tokenizers.models import WordLevel
from tokenizers.pre_tokenizers import Whitespace

from busflow.testing import harness, virtual_time
from busflow_assistant.assistant import Assistant
from busflow_assistant.embedder import Embedder
from busflow_assistant.engine import Engine
from busflow_assistant.fusion import Fusion
from busflow_assistant.markdown import read_page
from busflow_assistant.messages import AskText
from busflow_assistant.page_index import PageIndex

WORDS = ["[UNK]", "a", "pump", "moves", "water", "fan", "air", "seal", "runs", "at", "20", "Hz"]
HIDDEN = 16
PAGE = "# Pump\n\nA pump moves water. A pump runs at 20 Hz. A fan moves air.\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model of BERT's kind with two layers and random weights."""
    folder = tmp_path_factory.mktemp("model")
    rng = np.random.default_rng(1)

    def weight(*shape: int) -> np.ndarray:
        return rng.normal(0, 0.5, shape).astype(np.float32)

    found = {
        "embeddings.word_embeddings.weight": weight(len(WORDS), HIDDEN),
        "embeddings.position_embeddings.weight": weight(128, HIDDEN),
        "embeddings.token_type_embeddings.weight": weight(2, HIDDEN),
    }
    sizes = {
        "attention.self.query": (HIDDEN, HIDDEN),
        "attention.self.key": (HIDDEN, HIDDEN),
        "attention.self.value": (HIDDEN, HIDDEN),
        "attention.output.dense": (HIDDEN, HIDDEN),
        "intermediate.dense": (32, HIDDEN),
        "output.dense": (HIDDEN, 32),
    }
    normals = ["embeddings.LayerNorm"]
    for layer in range(2):
        name = f"encoder.layer.{layer}."
        found |= {f"{name}{part}.weight": weight(*shape) for part, shape in sizes.items()}
        found |= {f"{name}{part}.bias": weight(shape[0]) for part, shape in sizes.items()}
        normals += [f"{name}attention.output.LayerNorm", f"{name}output.LayerNorm"]
    found |= {f"{name}.weight": weight(HIDDEN) for name in normals} | {
        f"{name}.bias": weight(HIDDEN) for name in normals
    }
    save_file(found, str(folder / "model.safetensors"))
    (folder / "config.json").write_text(json.dumps({"num_hidden_layers": 2, "num_attention_heads": 4}))
    tokenizer = Tokenizer(WordLevel({word: number for number, word in enumerate(WORDS)}, unk_token=WORDS[0]))
    tokenizer.pre_tokenizer = Whitespace()
    tokenizer.save(str(folder / "tokenizer.json"))
    return folder


def test_vectors_have_length_one(folder: Path):
    vectors = Embedder(folder).embed(["a pump", "a fan moves air at 20 Hz"])
    assert np.allclose(np.linalg.norm(vectors, axis=1), 1, atol=1e-5)
    assert abs(float(vectors[0] @ vectors[1])) < 1 - 1e-5


def test_a_vector_does_not_depend_on_its_neighbours(folder: Path):
    texts = ["a pump", "a fan moves air at 20 Hz", "water"] * 20
    model = Embedder(folder)
    together = model.embed(texts)
    assert np.allclose(together, np.concatenate([model.embed([text]) for text in texts]), atol=1e-5)


def test_a_long_text_is_cut(folder: Path):
    assert Embedder(folder).embed(["pump " * 1000]).shape == (1, HIDDEN)


def test_order_of_units_goes_by_meaning_too(folder: Path):
    engine = Engine([read_page("p.md", PAGE)], Fusion(Embedder(folder)).fused)
    answer = engine.ask("A pump moves water?", page="p.md")
    assert answer.citations[0].text.startswith("A pump moves water.")
    without = Engine([read_page("p.md", PAGE)]).ask("A pump moves water?", page="p.md")
    assert answer.citations[0].score > without.citations[0].score


@virtual_time
async def test_assistant_says_that_it_uses_a_model(folder: Path, tmp_path: Path):
    page = tmp_path / "p.md"
    page.write_text(PAGE)
    async with harness(PageIndex(pages=[str(page)]), Assistant(embedder={"model_dir": str(folder)})) as lab:
        await lab.advance(1)
        response = await lab.call(AskText, "assistant/ask", AskText.Request(question="What moves air?", page="p.md"))
    assert response.engine == "extractive+embeddings"
