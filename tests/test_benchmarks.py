"""The benchmarks' entry works from end to end; how fast anything is, no test says."""

import json
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from benchmarks.page import PAGE, replaced
from benchmarks.plot import Line, svg
from benchmarks.question import QUESTIONS

ROOT = Path(__file__).parents[1]


def run(*words):
    return subprocess.run(
        [sys.executable, "-m", "benchmarks", *words], cwd=ROOT, capture_output=True, text=True, timeout=120
    )


@pytest.fixture(scope="module")
def answer(tmp_path_factory):
    file = tmp_path_factory.mktemp("benchmarks") / "found.json"
    ended = run("--quick", "--without-peers", "--only", "delivery,messages,collection,loops", "--json", str(file))
    assert ended.returncode == 0, ended.stderr
    return ended.stdout, json.loads(file.read_text("utf-8"))


@pytest.mark.timeout(150)
@pytest.mark.long
def test_question_prints_a_table_and_writes_data(answer):
    table, found = answer
    delivery = found["questions"]["delivery"]
    assert delivery["failed"] == {}
    assert {"busflow", "asyncio.Queue", "bare calls"} == {each["contender"] for each in delivery["figures"]}
    for figure in delivery["figures"]:
        assert figure["median"] > 0, figure
        assert figure["calls"] > 0, figure
    assert "Delivery within a process" in table
    assert any(line.startswith("busflow ") and "×" in line for line in table.splitlines())


@pytest.mark.parametrize("name", ["delivery", "messages", "collection", "loops"])
@pytest.mark.long
def test_every_case_of_busflow_has_its_figures(answer, name):
    _, found = answer
    question = found["questions"][name]
    assert question["failed"] == {}
    assert "busflow" in {each["contender"] for each in question["figures"]}
    assert question["call_s"] > [0.0]


@pytest.mark.long
def test_missing_peer_is_named(answer):
    table, found = answer
    assert "ezmsg" in found["questions"]["delivery"]["missing"]
    assert any("ezmsg" in line for line in table.splitlines() if line.startswith("missing: "))


def test_unknown_question_is_refused_with_known_ones():
    ended = run("--only", "speed")
    assert ended.returncode == 2
    assert "no question speed; there are delivery, latency, " in ended.stderr


def test_plot_is_deterministic_and_has_both_colour_schemes():
    lines = [Line("busflow", [(1, 10.0), (10, 55.0)]), Line("a & b", [(1, 11.0), (10, 56.0)])]
    drawn = svg("Cost", "subscribers", "bare calls", lines)
    assert drawn == svg("Cost", "subscribers", "bare calls", lines)
    answer = ET.fromstring(drawn).iter("{http://www.w3.org/2000/svg}text")  # noqa: S314  # we have just written it
    texts = [each.text for each in answer]
    assert {"Cost", "busflow", "a & b", "1", "10", "100"} <= set(texts)
    assert "prefers-color-scheme: dark" in drawn


def test_new_figures_replace_only_their_place():
    page = "a\n<!-- measured: x -->\n\nold\n\n<!-- end of x -->\nb\n<!-- measured: y -->\n<!-- end of y -->\n"
    assert replaced(page, "x", "new") == page.replace("old", "new")
    with pytest.raises(SystemExit, match="no place for z"):
        replaced(page, "z", "new")


def test_the_page_has_a_place_for_every_question():
    text = PAGE.read_text("utf-8")
    for name in QUESTIONS:
        assert replaced(text, name, "") != ""
