"""Cases from elsewhere in `tests/cases`: each is shown by a test, or skipped for a reason that is counted here."""

import ast
import json
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import pytest

TESTS = Path(__file__).parent
CASES = TESTS / "cases"
UI = TESTS.parent / "ui"


def read(name: str) -> Any:
    return json.loads((CASES / f"{name}.json").read_text(encoding="utf-8"))


SHOWN: dict[str, dict[str, Any]] = read("shown")
"""Tests that show a case, by suite and id; one test that reads a whole suite stands at `*`."""
SKIPPED: dict[str, dict[str, str]] = read("skipped")
"""Reason why a case cannot apply, by suite and id."""
COUNTS = {
    "a_qos_best_available": {
        "design: best_available is decided for each pair; no profile is fixed when an endpoint is made": 17,
    },
    "a_qos_profiles": {
        "design: a depth is at least 1, and the history always keep_last": 1,
        "design: the depth has a default, 10": 1,
        "design: no queue is unbounded, so there is no keep_all": 1,
        "design: a launch file overrides QoS, under `topics` and `nodes`, not a node's parameters": 2,
    },
    "b_names": {
        "there are no enclaves here: who may do what is said of machines": 6,
        "a null pointer; in Python the name cannot be left out": 2,
        "a command line sets parameters with --set, not with ROS 2's rules": 16,
        "a log level is not a name": 7,
    },
    "c_history": {
        "messages are immutable and shared: there is nothing to copy": 1,
        "design: a server's full queue refuses the newest request, whose caller gets an error at once": 1,
        "design: what a link loses is counted as lost, and is not sent again": 3,
        "design: messages have no priorities": 1,
        "design: a queue has a depth of at least 1, and no queue is unbounded": 2,
        "design: a mismatch of QoS is an error before the start": 1,
        "design: a node receives what it publishes": 1,
        "design: nothing is acknowledged; `send` waits for room": 1,
    },
    "d_timer_simtime": {
        "a timer says its period, not how long it still waits": 2,
        "design: a timer that is off has period 0": 2,
        "design: a timer belongs to its node, not to a block": 1,
        "design: lateness is counted in the report, not handed to the handler": 2,
        "design: a run keeps its clock": 4,
        "design: calling a timer calls its handler, the grid stays": 1,
        "a timer is reset by its own node, which needs no callback": 1,
        "design: period 0 is off": 1,
        "design: a jump has no thresholds; forwards time only goes on, and a jump back is reported afterwards": 4,
        "design: `await self.clock.sleep()` and timers; there is no rate object": 5,
    },
    "e_time_duration_clock": {
        "without following /clock, simulated time never goes back nor skips": 4,
        "a run's clock keeps its source, and a sleep ends early by cancellation alone": 6,
        "design: simulated time starts at a fixed epoch that is not zero": 1,
    },
    "f_parameters": {
        "a value is plain data here: a tuple has become a list before": 1,
        "a value is plain data here: an array has become a list before": 1,
        "a parameter that is a mapping travels as a string of JSON": 1,
        "the type of a value is that of its field; it is not stated beside the value": 3,
        "YAML 1.1: in YAML 1.2 this is text": 10,
        "tags are refused": 3,
        "YAML 1.2 reads 010 as ten": 1,
        "an integer beyond 64 bits is an error, not a float that is only nearly it": 1,
        "YAML 1.2 writes .nan": 1,
        "YAML 1.2 writes .inf": 1,
        "YAML 1.2 has null": 2,
        "a null pointer; in Python the name cannot be left out": 3,
        "a key that stands twice is an error": 2,
        "about memory that C allocates by hand": 1,
        "design: `--set` is above parameter files, and these are below the node's own `parameters`": 1,
        "parameters are the fields of a class: none is declared, undeclared or described anew while a node runs": 8,
        "every parameter has a value, or the node is not built": 3,
        "a parameter has one type here: a value of another is refused, or converted and then in range or not": 4,
        "`multiple_of` counts from 0, not from the range's lower end": 1,
        "refusing is for the validators of the class; @on_parameters is part of the class and cannot be removed": 1,
        "selectors of nodes in parameter files belong to the launch file, which names nodes one by one": 1,
    },
    "i_launch": {
        "another grammar: an expression is ${…}, never $(…), and calls nothing": 13,
        "upstream runs Python here; an expression of busflow compares and combines, it does not calculate": 3,
        "about upstream's Python objects; a value of busflow is resolved wherever it stands": 5,
        "about the command of a child process; a node of busflow is a class": 6,
        "a number is not a condition: 1 and 0 are refused where true or false is meant": 17,
        "an expression has no empty any()": 1,
        "what `true or` leaves undecided is nothing: the rest is not looked at": 2,
        "YAML 1.1; busflow reads the core schema of YAML 1.2": 3,
        "YAML 1.1: in YAML 1.2 `off` is text": 1,
        "a whole number is a float where a float is wanted, also in a list": 1,
        "a helper of upstream's; busflow.names decides it, with the cases of names": 7,
        "a trailing slash is an error in a namespace, not something to leave out": 2,
        "about a tuple in Python; a remap of busflow is a mapping in the file": 1,
        "busflow starts no executables from a launch file": 1,
        "there is no `let`: a value is an argument, and a group has no variables of its own": 1,
        "there is no `let`, and so nothing to reset": 1,
        "a launch file of busflow runs nothing, and logs nothing": 1,
    },
    "j_streams_cancellation": {
        "design: a subscription has one reader, and no handles that are cloned": 4,
        "design: a subscription outlives its publishers and ends with its node": 2,
        "design: a publisher does not depend on its subscriptions, which may come and go": 3,
        "the statistics count messages, not the senders that wait": 1,
        "design: publishers and subscriptions belong to a node, and are closed with it": 1,
        "design: a queue has a depth of at least 1, and no queue is unbounded": 2,
        "design: the first failure ends a run and is raised alone; later ones are in the log": 1,
        "design: an error of the block is raised as it is; a failure of a node then is in the log": 1,
    },
    "k_supervision": {
        "design: the limits of restarts are busflow's own": 1,
        "design: each node is restarted alone; a node that needs the fresh start of another is part of that one": 3,
        "design: a run always ends within its grace": 1,
        "design: a run has the nodes of its launch file; none is added by another node": 2,
        "design: never, on-failure and always are all there is": 12,
    },
    "l_replay_record": {
        "what measures its time is an argument that cannot be left out": 1,
        "a hidden topic is asked for by a pattern that is hidden itself": 1,
        "a topic of the bus has one type": 1,
        "a type of the bus is known": 1,
        "what is left out is left out by its name": 1,
        "design: each part is a whole file, written as it comes: nothing is swapped, converted or called back": 5,
    },
    "m_bad_input": {
        "design: members of a run are its user's processes or certified machines, whose number of endpoints is free": 1,
        "design: a CSV file has each value as it was, for programs that read it back": 1,
        "design: the viewer's server speaks WebSocket alone and serves no files": 1,
        "design: a run has no secrets from its user, who alone can read parameters, log and recording": 2,
        "about how a project is built, not about what it does": 1,
    },
    "o_rclpy_test_list": {
        "design: there are no actions; goal, feedback and result are topics": 3,
        "design: nodes share one event loop; there are no executors, contexts or callback groups": 5,
        "design: there are no lifecycle states; `start` and `stop` are all there is": 1,
        "design: a launch file overrides QoS, under `topics` and `nodes`, not a node's parameters": 1,
        "design: `await self.clock.sleep()` and timers; there is no rate object": 1,
        "design: types are described by the run, not by a service of each node": 1,
        "design: a command line has --set and --args, not ROS's arguments": 1,
    },
}
"""How often each reason is given: one that skips more cases than before fails here, and is looked at."""

FAULTS = {
    "bus/test_stream_cases.py::test_cancelled_reader_lets_go_of_its_locals",
}
"""Tests that show a fault of busflow, which is not mended yet."""


def ids(suite: str) -> list[str]:
    return [case["id"] for case in read(suite)["cases"]]


def shown_by(suite: str) -> list[str]:
    """Return the tests that show the cases of a suite; without `ui/`, those of busflow alone."""
    named = [[each] if isinstance(each, str) else each for each in SHOWN[suite].values()]
    return [test for each in named for test in each if UI.exists() or not test.startswith("../ui/")]


@cache
def marks_in(path: Path) -> dict[str, str]:
    """Return the text of the decorators of each test in a file, by the name of the test."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    found = [("", each) for each in body]
    found += [(f"{owner.name}::", each) for owner in body if isinstance(owner, ast.ClassDef) for each in owner.body]
    return {
        prefix + each.name: "\n".join(map(ast.unparse, each.decorator_list))
        for prefix, each in found
        if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef)
    }


def test_every_suite_is_taken_over():
    assert sorted(SHOWN) == sorted(path.stem for path in CASES.glob("[a-o]_*.json"))


@pytest.mark.parametrize("suite", SHOWN)
def test_each_case_is_shown_or_skipped(suite: str):
    found, shown, skipped = ids(suite), SHOWN[suite], SKIPPED.get(suite, {})
    assert len(found) == len(set(found))
    if "*" in shown:
        assert (len(shown), skipped) == (1, {})
    else:
        assert set(found) == shown.keys() | skipped.keys()
        assert shown.keys() & skipped.keys() == set()


@pytest.mark.parametrize("suite", SHOWN)
def test_what_shows_a_case_is_a_test(suite: str):
    for each in shown_by(suite):
        file, _, test = each.partition("::")
        assert test in marks_in(TESTS / file), each
        assert "pytest.mark.skip(" not in marks_in(TESTS / file)[test], each


def test_known_faults_are_listed():
    tests = {each for suite in SHOWN for each in shown_by(suite)}
    parts = [each.partition("::") for each in tests]
    assert {f"{file}::{test}" for file, _, test in parts if "xfail" in marks_in(TESTS / file)[test]} == FAULTS


def test_no_reason_skips_more_cases():
    assert {suite: dict(Counter(SKIPPED[suite].values())) for suite in SKIPPED} == COUNTS


def test_no_reason_is_a_promise():
    reasons = {reason for counts in COUNTS.values() for reason in counts}
    assert [reason for reason in reasons if reason.endswith("later") or ".py" in reason] == []
