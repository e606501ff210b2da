"""Nodes notice nothing of where they run: the same classes in one process, in two, and from a recording of the two."""

import json
import os
from collections import Counter, defaultdict
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from rosbags.highlevel import AnyReader

from busflow.cli import main
from busflow.errors import InvalidParameter
from busflow.launchfile.load.load import load
from busflow.node.context import Rng
from busflow.recording.bag.bag import Bag
from busflow.testing import harness, replay, virtual_time
from busflow.timeouts import VARIABLE
from busflow.wire.client.client import join

CONTRACT = Path(__file__).parents[1] / "nodes/contract.yaml"
OUTCOMES = {
    "/order/order_reader": {"in_order": True},
    "/depth/depth_reader": {"newest": "[16, 17, 18, 19, 20]"},
    "/latched/latched_reader": {"received": "[2, 3, 4]"},
    "/latched_back/back_reader": {"received": "[2, 3, 4]"},
    "/expired/expired_reader": {"received": "[4]"},
    "/both_ways/second_player": {"last": 200},
    "/events/silent_publisher": {"matched": 1},
    "/events/event_reader": {"events": "['deadline missed', 'lease ended', 'matched 1', 'received 1']"},
    "/services/client": {
        "found": "['on', 'ServiceUnavailable', 'ServiceFailed', 'ServiceTimeout', 'ServiceUnavailable', 'ServiceGone', "
        "'ServiceGone']"
    },
    "/actions/boss": {
        "found": "['5.0', '[4.0, 3.0, 2.0, 1.0, 0.0]', 'GoalCanceled at -1.0', 'GoalRejected', 'GoalAborted']"
    },
    "/restart/breaker": {"received": "[1, 2, 1, 2]"},
    "/parameters/watcher": {"seen": "['/parameters/tuned gain 2.5', 'sum 3.5']"},
}
PUBLISHED = {
    "/order/numbers": 300,
    "/depth/numbers": 21,
    "/latched/numbers": 5,
    "/latched_back/numbers": 5,
    "/both_ways/there": 201,
    "/both_ways/back": 200,
    "/events/promised": 1,
    "/services/leave": 1,
    "/actions/move/_action/feedback": 5,
    "/restart/numbers": 4,
    "/parameters/sums": 1,
}
DRAWN = "/actions/"
"""Nodes that draw the numbers of their goals anew on the system's time, and so in a replay."""
LATE = {"/latched/numbers", "/latched_back/numbers"}
TUNED, GAIN = "/parameters/tuned", {"gain": 2.5}


@dataclass
class Ran:
    """How the nodes ran: by node the values of its log lines, and the report of the run or the count of each topic."""

    outcomes: dict[str, Any]
    draws: dict[str, Any]
    report: dict[str, Any]
    published: dict[str, int]
    recording: Path


def of_log(lines: list[tuple[str, str, Any]], event: str) -> dict[str, Any]:
    return {node: values for node, found, values in lines if found == event}


@pytest.fixture(scope="module")
def in_one(tmp_path_factory) -> Ran:
    recording = tmp_path_factory.mktemp("one") / "one.mcap"

    @virtual_time
    async def run():
        async with harness(CONTRACT, record=str(recording)) as lab:
            await lab.advance(1)
            with pytest.raises(InvalidParameter):
                lab.set_parameters(TUNED, {"gain": -1.0})
            lab.set_parameters(TUNED, GAIN)
            await lab.advance(3)
        return lab

    lab = run()
    return ran([(each.node, each.event, each.values) for each in lab.log], lab.graph.report().as_json(), recording)


@pytest.fixture(scope="module")
def in_two(start_for_all) -> Ran:
    with pytest.MonkeyPatch.context() as patch:
        # A process that a busy machine holds up for a second is no blocked one: its messages are held until it answers.
        patch.setenv(VARIABLE, f"{os.environ[VARIABLE]},held_messages=inf")
        run = start_for_all(f"include: [{CONTRACT}]\n", "--record", "two")
    for node in OUTCOMES.keys() - {"/parameters/watcher"}:
        run.wait_for('"outcome"', f'"{node}"')
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BUSFLOW_RUNTIME_DIR", str(run.runtime))
        with join() as peer:
            (refused,) = peer.ask("set_parameters", node=TUNED, values={"gain": -1.0})
            assert [fault["path"] for fault in refused["faults"]] == [["gain"]]
            peer.ask("set_parameters", node=TUNED, values=GAIN)
    run.wait_for('"outcome"', '"/parameters/watcher"')
    assert run.end() == 130
    own = {"stamp_ns", "level", "node", "event", "process"}
    lines = [(each["node"], each["event"], {key: each[key] for key in each.keys() - own}) for each in run.log()]
    return ran(lines, run.report(), run.folder / "two")


def ran(lines: list[tuple[str, str, Any]], report: dict[str, Any], recording: Path) -> Ran:
    published = {topic["name"]: topic["published"] for topic in report["topics"]}
    return Ran(of_log(lines, "outcome"), of_log(lines, "draws"), report, published, recording)


@pytest.fixture(scope="module")
def from_recording(in_two) -> Ran:
    names = [spec.full_name for spec in load(CONTRACT).nodes if not spec.full_name.startswith(DRAWN)]
    again = replay(in_two.recording, CONTRACT, nodes=names, time_tolerance_s=60.0)
    assert again.same, again.render()
    lines = [(each.node, each.event, each.values) for each in again.log]
    return Ran(of_log(lines, "outcome"), of_log(lines, "draws"), {}, again.compared, in_two.recording)


@pytest.fixture(params=["in_one", "in_two", "from_recording"])
def anywhere(request) -> Ran:
    return request.getfixturevalue(request.param)


@pytest.fixture(params=["in_one", "in_two"])
def live(request) -> Ran:
    return request.getfixturevalue(request.param)


def ran_there(ran: Ran, expected: dict[str, Any]) -> dict[str, Any]:
    return {name: each for name, each in expected.items() if ran.report or not name.startswith(DRAWN)}


def test_outcomes_are_the_same_anywhere(anywhere):
    assert anywhere.outcomes == ran_there(anywhere, OUTCOMES)


def test_counts_and_random_numbers_are_the_same(anywhere):
    expected = ran_there(anywhere, PUBLISHED)
    assert {topic: anywhere.published[topic] for topic in expected} == expected
    assert len(anywhere.draws) == 3
    assert anywhere.draws == {name: {"number": int(Rng(7, name).integers(1 << 40))} for name in anywhere.draws}


def test_ledger_accounts_for_each_message(live):
    lines = {topic["name"]: topic["subscriptions"] for topic in live.report["topics"]}
    for topic in PUBLISHED.keys() - LATE:
        (line,) = lines[topic]
        assert line["published"] == line["delivered"] + line["dropped"] == PUBLISHED[topic]
    for topic in LATE:
        (late,) = lines[topic]
        assert (late["delivered"], late["drops"]) in [(3, {}), (3, {"unmatched": 2})]
    (slow,) = lines["/depth/numbers"]
    assert slow["drops"] == {"overflow": slow["dropped"]} != {}
    nodes = {node["name"]: node for node in live.report["nodes"]}
    assert {name for name, node in nodes.items() if node["restarts"]} == {"/services/server", "/restart/fragile"}
    assert (nodes[TUNED]["parameters_set"], {node["state"] for node in nodes.values()}) == (1, {"stopped"})


def test_recordings_hold_the_same(in_one, in_two):
    one, two = payloads(in_one.recording), payloads(in_two.recording)
    for topic in PUBLISHED.keys() - LATE - {"/actions/move/_action/feedback"}:
        assert one[topic] == two[topic]
    for service in ("switch", "never", "full", "has_begun"):
        assert len(one[f"/services/{service}/_service_event"]) == len(two[f"/services/{service}/_service_event"]) > 0


def payloads(recording: Path) -> dict[str, list[bytes]]:
    """The payloads of a recording, in order, by topic."""
    found = defaultdict(list)
    with Bag(recording) as bag:
        assert bag.complete, bag.incomplete
        for entry in bag.entries():
            found[entry.channel.topic].append(entry.payload)
    return found


def test_recording_matches_report_without_duplicates(in_two):
    with Bag(in_two.recording) as bag:
        found = Counter(entry.channel.topic for entry in bag.entries())
        assert bag.survey().gaps == 0
        assert [each.facts.process for each in bag.series] == ["main", "other"]
        assert bag.ledger.report["topics"] == in_two.report["topics"]
    assert {topic: found[topic] for topic in in_two.published} == in_two.published
    assert found.total() == in_two.report["recording"]["recorded"]
    with Bag(in_two.recording / "other.mcap") as bag:
        own = {channel.topic for channel in bag.channels if channel.count}
        assert (bag.ledger.report["exit_code"], "/order/numbers" in own, "/both_ways/back" in own) == (130, True, False)


def test_files_are_read_as_one_by_time(in_two):
    with Bag(in_two.recording) as bag:
        entries = list(bag.numbered())
        assert all(one.log_time_ns <= other.log_time_ns for (_, one), (_, other) in pairwise(entries))
        for number in (0, 1):
            own = [entry.sequence for series, entry in entries if series == number]
            assert own == list(range(1, len(own) + 1))
        assert sum(one != other for (one, _), (other, _) in pairwise(entries)) > 2
        assert (bag.start_ns, bag.end_ns) == (entries[0][1].log_time_ns, entries[-1][1].log_time_ns)


def test_every_command_takes_the_directory(in_two, tmp_path, capsys):
    recording, one = str(in_two.recording), str(tmp_path / "one.mcap")
    assert main(["bag", "verify", recording]) == 0
    assert main(["bag", "info", recording, "--json", "--digest"]) == 0
    told = json.loads(capsys.readouterr().out.split("\n", 1)[1])
    files = [(each["process"], each["file"]) for each in told["processes"]]
    assert files == [("main", "main.mcap"), ("other", "other.mcap")]
    assert len({topic["name"] for topic in told["topics"]}) == len(told["topics"])
    assert told["messages"] == sum(each["messages"] for each in told["processes"])
    assert told["complete"]
    assert main(["bag", "info", recording]) == 0
    assert "other: other.mcap" in capsys.readouterr().out
    assert main(["bag", "echo", recording, "order/numbers", "-n", "1"]) == 0
    assert main(["bag", "diff", recording, recording]) == 0
    assert main(["bag", "play", recording, "--rate", "100"]) == 0
    capsys.readouterr()
    assert main(["bag", "convert", recording, one, "--to", "mcap"]) == 0
    assert main(["bag", "verify", one]) == 0, capsys.readouterr().out
    assert main(["bag", "diff", recording, one, "--times"]) == 0
    with Bag(one) as bag, Bag(recording) as parts:
        assert [entry.sequence for entry in bag.entries()] == list(range(1, parts.messages + 1))
        assert [entry.payload for entry in bag.entries()] == [entry.payload for entry in parts.entries()]
        assert bag.facts.process == ""
        assert bag.ledger.report == parts.ledger.report
    assert main(["bag", "recover", recording]) == 2
    assert capsys.readouterr().err.startswith(f"error: {recording}")


def test_a_reader_of_ros_2_opens_the_directory(in_two):
    topics = {"/order/numbers", "/both_ways/back"}
    with AnyReader([in_two.recording]) as reader, Bag(in_two.recording) as bag:
        wanted = [each for each in reader.connections if each.topic in topics]
        times = [time for _, time, _ in reader.messages(connections=wanted)]
        assert sorted(times) == [entry.log_time_ns for entry in bag.entries(sorted(topics))] != []
