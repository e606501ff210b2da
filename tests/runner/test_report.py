"""The report of a run: the same account in Python and as JSON."""

import asyncio
import json
from dataclasses import replace

import pytest

from busflow import Graph, Message, Node, QoS, publisher, subscription, timer
from busflow.clock import SimClock
from busflow.errors import ExitCode
from busflow.runner.report import Report
from busflow.testing import virtual_time


class Number(Message, package="test"):
    data: int


class Talker(Node):
    numbers = publisher(Number, "numbers")

    @timer(0.1)
    def talk(self) -> None:
        for data in range(5):
            self.numbers.publish(Number(data=data))


class Late(Node):
    async def start(self) -> None:
        await self.clock.sleep(0.5)
        self.create_publisher(Number, "late")


class Slow(Node):
    @subscription("numbers", qos=QoS(depth=2))
    async def on_number(self, number: Number) -> None:
        await asyncio.sleep(0.03 + number.data * 0)


@pytest.fixture
def report() -> Report:
    @virtual_time
    async def run() -> Report:
        graph = Graph([Talker, Slow], clock=SimClock(), seed=7)
        async with graph:
            await asyncio.sleep(1.05)
        return graph.report()

    return run()


def test_a_notebook_shows_the_topics_as_a_table(report):
    html = report._repr_html_()
    line = report.topics[0].subscriptions[0]
    row = ["/numbers", "test/msg/Number", 50, "/slow", line.delivered, line.dropped, line.queued]
    assert "".join(f"<td>{each}</td>" for each in row) in html
    assert html.startswith("<table><caption>")


def test_printed_report_is_a_table(report):
    line = report.topics[0].subscriptions[0]
    title, head, row, *_ = str(replace(report, name="a\x1bb")).splitlines()
    assert (title.split()[0], head.split()[:3]) == ("a\\x1bb:", ["topic", "type", "published"])
    counts = ["50", "/slow", *map(str, (line.delivered, line.dropped, line.queued))]
    assert row.split() == ["/numbers", "test/msg/Number", *counts]


def test_a_table_escapes_names(report):
    hostile = replace(report, name="<script>", topics=(replace(report.topics[0], topic="<b>", subscriptions=()),))
    html = hostile._repr_html_()
    assert "<script>" not in html
    assert "<td>&lt;b&gt;</td>" in html


def test_report_has_every_promised_key(report):
    form = report.as_json()
    assert set(form) >= {"name", "seed", "clock", "duration_s", "exit_code", "nodes", "topics", "timers"}
    assert set(form["nodes"][0]) == {
        "name",
        "plugin",
        "state",
        "parameters_set",
        "restarts",
        "stopped_by_hand",
        "started_by_hand",
        "failures",
        "last_failure",
    }
    assert set(form["topics"][0]) == {"name", "type", "published", "arrived", "since_s", "losses", "subscriptions"}
    assert set(form["topics"][0]["subscriptions"][0]) >= {
        "node", "depth", "overflow", "published", "delivered", "dropped", "queued",
    }  # fmt: skip
    assert set(form["timers"][0]) == {
        "node", "name", "period_s", "fired", "missed", "lateness_p50_s", "lateness_p99_s",
    }  # fmt: skip


def test_it_is_json_as_it_stands(report):
    assert json.loads(json.dumps(report.as_json()))["topics"][0]["type"] == "test/msg/Number"


def test_its_numbers_are_those_of_the_run(report):
    form = report.as_json()
    line = form["topics"][0]["subscriptions"][0]
    assert (form["seed"], form["clock"], form["exit_code"]) == (7, "sim", 0)
    assert form["duration_s"] == pytest.approx(1.05)
    assert form["topics"][0]["published"] == line["published"] == 50
    assert line["published"] == line["delivered"] + line["dropped"] + line["queued"]
    assert line["dropped"] == report.dropped > 0
    assert (line["depth"], line["overflow"], line["drops"]) == (2, "drop_oldest", {"overflow": line["dropped"]})
    assert (form["timers"][0]["fired"], form["timers"][0]["missed"], form["timers"][0]["lateness_p99_s"]) == (10, 0, 0)


def test_topic_report_states_its_first_publisher_s_time():
    @virtual_time
    async def run() -> Report:
        graph = Graph([Talker, Late], clock=SimClock())
        await asyncio.sleep(2)  # which is not of the run
        async with graph:
            await asyncio.sleep(1)
        return graph.report()

    assert {topic.name: topic.since_s for topic in run().topics} == {"/late": 0.5, "/numbers": 0.0}


def test_a_timer_that_never_fired_has_no_lateness():
    @virtual_time
    async def run() -> Report:
        graph = Graph([Talker], clock=SimClock())
        async with graph:
            pass
        return graph.report()

    timer_line = run().as_json()["timers"][0]
    assert (timer_line["fired"], timer_line["lateness_p50_s"]) == (0, None)


def test_it_can_be_had_while_the_graph_runs():
    @virtual_time
    async def run() -> tuple[Report, Report]:
        graph = Graph([Talker], clock=SimClock())
        async with graph:
            await asyncio.sleep(0.5)
            first = graph.report()
            await asyncio.sleep(0.5)
        return first, graph.report()

    first, last = run()
    assert (first.duration_s, last.duration_s) == (pytest.approx(0.5), pytest.approx(1.0))
    assert first.nodes[0].state == "running"
    assert last.nodes[0].state == "stopped"
    assert last.exit_code is ExitCode.OK
