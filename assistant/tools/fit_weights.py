"""The weights of `busflow_assistant.features`, fitted to the question sets that may be tuned on.

    python assistant/tools/fit_weights.py    # the weights, and how well they do on pages that they were not fitted to

The score of a unit is a sum; the weights are those under which the units that answer are most likely the best: a
softmax over all units of a page, with a penalty on large weights. The sets that are held out are not read.

Needs the distribution `busflow-assistant`: pip install . ./assistant
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from benchmarks.assistant_score import ANSWERED, PageTexts, has_all, overlap, read_questions  # noqa: E402  # the clone's benchmarks are no package
from busflow_assistant.features import Compared, Features, Sought  # noqa: E402  # as above
from busflow_assistant.markdown import read_page  # noqa: E402  # as above
from busflow_assistant.matching import match  # noqa: E402  # as above
from busflow_assistant.question import understand  # noqa: E402  # as above
from busflow_assistant.rank import answers  # noqa: E402  # as above
from busflow_assistant.search_index import SearchIndex  # noqa: E402  # as above

TESTS = ROOT / "assistant" / "tests"
SETS = ("questions.jsonl", "questions_own.jsonl", "questions_third.jsonl", "questions_fourth.jsonl")
PENALTY = 0.03
STEPS = 400

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Example:
    """A question with what may answer it."""

    page: str
    features: Floats
    right: npt.NDArray[np.bool_]


def main() -> None:
    found = [each for name in SETS for each in examples(read_questions(TESTS / name)) if each.right.any()]
    weights = fitted(found)
    for name, weight in zip(Features._fields, weights, strict=True):
        print(f"    {name}={weight:.2f},")
    pages = sorted({each.page for each in found})
    parts = [[each for each in found if each.page == page] for page in pages]
    unseen = [
        first(part, fitted([each for each in found if each.page != page]))
        for page, part in zip(pages, parts, strict=True)
    ]
    print(f"the best one answers: {first(found, weights)} of {len(found)}; on a page not fitted to: {sum(unseen)}")


def examples(questions: Sequence[Mapping[str, Any]]) -> list[Example]:
    texts = PageTexts(TESTS / "pages")
    indices = {page: SearchIndex([read_page(page, texts.raw(page))]) for page in {each["page"] for each in questions}}
    return [example(each, indices[each["page"]], texts) for each in questions if each["kind"] in ANSWERED]


def example(question: Mapping[str, Any], index: SearchIndex, texts: PageTexts) -> Example:
    asked = understand(question["question"])
    matched = match(asked, index)
    sought = Sought(asked, matched, index)
    units = answers(asked, matched, index, range(len(index.units)))
    page, spans = texts.words(question["page"]), [*question["spans"], *question.get("alt_spans", [])]
    holds = [max(overlap(page, span, unit.text) for span in spans) >= 0.5 for unit in units]
    inside = [
        unit.own.total() > 3 and max(overlap(page, unit.text, span) for span in spans) >= 0.9 for unit in units
    ]  # a part of longer evidence
    whole = [yes and has_all(unit.text, question["must_contain"]) for yes, unit in zip(holds, units, strict=True)]
    right = whole if any(whole) else holds if any(holds) else inside
    numbers = [Compared(sought, unit).features for unit in units]
    return Example(
        question["page"], np.array(numbers, float).reshape(len(units), len(Features._fields)), np.array(right, bool)
    )


def fitted(found: Sequence[Example]) -> Floats:
    """Return the weights under which the right ones are most likely, by steepest descent with momentum."""
    every = np.vstack([each.features for each in found])
    scale = every.std(axis=0) + 1e-9
    scaled = [(each.features / scale, each.right) for each in found]
    weights, speed, mean = np.zeros(every.shape[1]), np.zeros(every.shape[1]), np.zeros(every.shape[1])
    for step in range(1, STEPS):
        slope = 2 * PENALTY * weights
        for features, right in scaled:
            scores = features @ weights
            shares = np.exp(scores - scores.max())
            shares /= shares.sum()
            wanted = np.where(right, shares, 0.0)
            slope += features.T @ (shares - wanted / wanted.sum()) / len(scaled)
        mean = 0.9 * mean + 0.1 * slope
        speed = 0.99 * speed + 0.01 * slope**2
        weights -= 0.05 * (mean / (1 - 0.9**step)) / (np.sqrt(speed / (1 - 0.99**step)) + 1e-8)
    return weights / scale


def first(found: Sequence[Example], weights: Floats) -> int:
    return sum(bool(each.right[np.argmax(each.features @ weights)]) for each in found)


if __name__ == "__main__":
    main()
