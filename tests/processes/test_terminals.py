"""What other terminals are told of a run is of all its processes."""

import json
import subprocess
import sys

import pytest

from busflow.wire.client.client import join

TWO_PUBLISHERS = """
processes:
  left:
  right:
nodes:
  one: {plugin: source, process: left, parameters: {rate_hz: 50.0}}
  two: {plugin: source, process: right, parameters: {rate_hz: 25.0}, remap: {count: count_two}}
  sink: {plugin: sink, parameters: {enough: 30}}
  far_sink: {plugin: sink, process: right, parameters: {enough: 30}}
"""


@pytest.fixture(scope="module")
def run(start_for_all):
    """A run of two processes that both publish and receive a topic."""
    run = start_for_all(TWO_PUBLISHERS)
    run.wait_for("received enough", times=2)
    return run


@pytest.fixture(scope="module")
def busflow(run):
    """A command beside that run."""

    def busflow(*arguments):
        printed = run.busflow(*arguments)
        whole = printed.startswith("{\n")  # a command that ends prints one object, written for people
        return [json.loads(each) for each in ([printed] if whole else printed.splitlines())]

    return busflow


@pytest.mark.long
def test_calls_are_echoed_from_the_servers_process(run, busflow, monkeypatch):
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(run.runtime))
    command = [sys.executable, "-m", "busflow", "service", "echo", "count_two", "-n", "2", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as echo, join() as peer:
        while not (topic := peer.graph().topics.get("/count_two/_service_event")) or not topic.publishers:
            assert echo.poll() is None
        assert len(topic.publishers) == 1
        (called,) = busflow("service", "call", "count_two", "std_srvs/srv/Trigger", "--json")
        out, _ = echo.communicate(timeout=60)
    request, response = (json.loads(line)["message"] for line in out.splitlines())
    assert [each["info"]["event_type"] for each in (request, response)] == ["REQUEST_RECEIVED", "RESPONSE_SENT"]
    assert response["response"] == [called["response"]]


def test_log_level_is_set_in_any_process(busflow):
    busflow("log", "--set", "two", "warn", "--json")
    call = ("two/get_logger_levels", "rcl_interfaces/srv/GetLoggerLevels", "{names: [two]}")
    (told,) = busflow("service", "call", *call, "--json")
    assert told["response"] == {"levels": [{"name": "two", "level": 30}]}


@pytest.mark.parametrize(("verb", "rate"), [("hz", "rate_hz"), ("bw", "bytes_per_s")])
def test_topic_is_measured_in_every_publishing_process(busflow, verb, rate):
    (told,) = busflow("topic", verb, "numbers", "-n", "1", "--every", "2s", "--json")
    per_message = 12 if verb == "bw" else 1  # a header of four bytes, and the number
    assert 0 < told[rate] / per_message < 110, (
        "75 where nothing holds them up: each once, though both processes have it"
    )
    assert {flow["node"] for flow in told["subscriptions"]} == {"/sink", "/far_sink"}


def test_ps_lists_the_run_with_its_processes(busflow):
    (told,) = busflow("ps", "--json")
    assert told.keys() >= {"run", "file", "since", "pid", "processes"}
    assert told["file"].endswith("run.yaml")
    assert {(each["name"], each["nodes"], each["restarts"]) for each in told["processes"]} == {
        ("main", 1, 0),
        ("left", 1, 0),
        ("right", 2, 0),
    }
    main = {"name": "main", "pid": told["pid"], "nodes": 1, "restarts": 0, "shared_memory": 0}
    assert told["processes"][0] == main
    assert len({each["pid"] for each in told["processes"]}) == 3


def test_topic_counts_each_message_once(busflow):
    for _ in range(
        10
    ):  # the processes count on while they are asked one after the other, which is less and less of all
        (topic,) = busflow("topic", "stats", "numbers", "--json")[0]["topics"]
        counts = {line["node"]: line["published"] for line in topic["subscriptions"]}
        assert counts.keys() == {"/sink", "/far_sink"}
        if topic["published"] == pytest.approx(max(counts.values()), rel=0.2):
            return
    pytest.fail(f"{topic['published']} published, of which {counts} are counted for those who hear them")
