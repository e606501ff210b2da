"""How well, and how fast, the assistant answers: its question sets through the service of a running graph.

    python benchmarks/assistant.py                    # all sets, the default engine, and the times
    python benchmarks/assistant.py --set FILE --pages DIR --failures 20
    python benchmarks/assistant.py --embedder DIR     # with a sentence-embedding model beside it
    python benchmarks/assistant.py --url http://127.0.0.1:11434/v1 --model qwen3:4b

Needs the distribution `busflow-assistant`: pip install . ./assistant
"""

from __future__ import annotations

import argparse
import asyncio
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

import busflow  # noqa: E402  # as above
from benchmarks.assistant_score import Given, Judged, PageTexts, Scores, judge, percentile, plain, read_questions  # noqa: E402  # as above
from busflow_assistant.assistant import Assistant  # noqa: E402  # the clone's benchmarks are no package
from busflow_assistant.messages import AskText, Index  # noqa: E402  # as above
from busflow_assistant.page_index import PageIndex  # noqa: E402  # as above

TESTS = ROOT / "assistant" / "tests"
NAMES = ("", "_own", "_third", "_fourth", "_held_out", "_held_out_second")
SETS = tuple(TESTS / f"questions{name}.jsonl" for name in NAMES)
FEW = 3
BOOK = (ROOT / "docs",)
"""The whole book: docs with the tutorial in it."""


async def main() -> None:
    options = read_options()
    print(f"engine: {engine_name(options)}")
    for path in options.sets or SETS:
        questions = questions_of(path, options)
        scores = Scores(await ask_all(questions, options))
        print(f"\n== {path.name}: {len(questions)} questions (95 % intervals: Wilson)")
        print("\n".join(scores.lines()))
        show_failures(scores.judged, options.failures)
        if options.json:
            write(options.json, scores.judged)
    if not options.sets:
        await show_times(options)


def questions_of(path: Path, options: argparse.Namespace) -> Sequence[dict[str, Any]]:
    """The questions of a set, or the first of them."""
    return read_questions(path)[: FEW if options.quick else None]


def read_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--set", dest="sets", action="append", type=Path, help="a question set; default: all of assistant/tests"
    )
    parser.add_argument("--quick", action="store_true", help=f"only {FEW} questions of a set: to see that all works")
    parser.add_argument("--pages", type=Path, default=TESTS / "pages", help="the folder of the sets' pages")
    parser.add_argument("--failures", type=int, default=0, metavar="N", help="show up to N questions that went wrong")
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="append every answer as a line of JSON, as predictions"
    )
    parser.add_argument(
        "--embedder", metavar="DIR", default="", help="a folder with tokenizer.json and model.safetensors"
    )
    parser.add_argument("--url", default="", help="an OpenAI-compatible server")
    parser.add_argument("--model", default="", help="the model there")
    parser.add_argument("--api-key-env", default="", help="the environment variable that has its key")
    return parser.parse_args()


def engine_name(options: argparse.Namespace) -> str:
    return options.model or ("extractive+embeddings" if options.embedder else "extractive")


def nodes(places: Sequence[Path], options: argparse.Namespace) -> list[busflow.Node]:
    endpoint = {"url": options.url, "model": options.model, "api_key_env": options.api_key_env}
    given: dict[str, Any] = {}
    if options.embedder:
        given["embedder"] = {"model_dir": options.embedder}
    if options.url:
        given["endpoint"] = endpoint
    return [PageIndex(pages=[str(place) for place in places], look_hz=0), Assistant(**given)]


async def ask_all(questions: Sequence[dict[str, Any]], options: argparse.Namespace) -> list[Judged]:
    """AskText every question of a set, as the page does: with what is selected, without its Markdown."""
    texts = PageTexts(options.pages)
    places = [options.pages / name for name in sorted({each["page"] for each in questions})]
    async with busflow.launch(*nodes(places, options)) as graph:
        await index_of(graph)
        return [judge(each, await ask(graph, each, texts), texts) for each in questions]


async def index_of(graph: busflow.Graph) -> None:
    """Wait until the assistant has read the pages."""
    assistant = graph.node(Assistant)
    subscription = graph.subscribe(Index, "assistant/index", qos=busflow.TRANSIENT_LOCAL)
    await anext(aiter(subscription))
    await assistant.pages_read.wait()


async def ask(graph: busflow.Graph, question: dict[str, Any], texts: PageTexts) -> Given:
    selection = plain(texts.selection(question))
    if question.get("inject"):
        selection = f"{selection} {question['inject']}"
    request = AskText.Request(question=question["question"], selection=selection, page=question["page"])
    began = perf_counter()
    response = await graph.call(AskText, "assistant/ask", request, timeout=300)
    ms = 1000 * (perf_counter() - began)
    return Given(response.answer, response.answered, [each.text for each in response.citations], response.scope, ms)


async def show_times(options: argparse.Namespace) -> None:
    """Print how long an answer takes from one page and from the whole book, for the questions of the first set."""
    questions = questions_of(SETS[0], options)
    print("\n== time of an answer")
    async with busflow.launch(*nodes(BOOK, options)) as graph:
        began = perf_counter()
        await index_of(graph)
        print(f"the book is read and indexed in {perf_counter() - began:.1f} s")
        for name, page in (("one page", "tutorial/lab1.md"), ("the whole book", "")):
            times = []
            for each in questions:
                asked = perf_counter()
                await graph.call(
                    AskText, "assistant/ask", AskText.Request(question=each["question"], page=page), timeout=300
                )
                times.append(1000 * (perf_counter() - asked))
            print(f"{name}: p50 {percentile(times, 0.5):.1f} ms, p95 {percentile(times, 0.95):.1f} ms (n={len(times)})")


def show_failures(judged: Sequence[Judged], most: int) -> None:
    wrong = [
        each for each in judged if not (each.right and each.first if each.question["answerable"] else each.withheld)
    ]
    for each in wrong[:most]:
        question, given = each.question, each.given
        print(f"  {question['id']} {question['kind']} {question['question']!r}: wanted {question['must_contain']}")
        print(f"      {'answered' if given.answered else 'refused'}, {given.scope}: {given.answer[:200]!r}")


def write(path: Path, judged: Sequence[Judged]) -> None:
    with path.open("a", encoding="utf-8") as file:
        for each in judged:
            given = each.given
            line = {
                "id": each.question["id"],
                "answer": given.answer,
                "grounded": given.answered,
                "refused": not given.answered,
                "citations": [{"text": text} for text in given.citations],
                "scope": given.scope or None,
                "ms": round(given.ms, 2),
            }
            file.write(json.dumps(line, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    asyncio.run(main())
