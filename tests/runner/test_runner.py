"""The parts of a graph: nodes to choose from, sources to make it of, and the program around it.

Tests of `course.py`, `host.py`, `running_lines.py`, `source.py` and `standard_error.py`.
"""

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from busflow import Graph, Node
from busflow.clock import SimClock
from busflow.errors import InvalidDeclaration, LaunchError, NotRunning
from busflow.launchfile.model.supervision import Supervision
from busflow.msgs.std_msgs import Int64
from busflow.node.supervision import Supervised
from busflow.runner import standard_error
from busflow.runner.graph import described, made_by_hand
from busflow.runner.running_lines import is_own, running_lines
from busflow.runner.source import Source
from busflow.testing import virtual_time


class Plain(Node):
    """A node without endpoints."""


class Other(Node):
    """Another one."""


def test_node_is_made_of_class_or_instance(golden):
    node = Plain(name="given")
    supervision = Supervision()
    assert made_by_hand(node)[0] is node
    assert type(made_by_hand(Plain)[0]) is Plain
    assert made_by_hand(Supervised(node, supervision)) == (node, supervision)
    with golden.raises(InvalidDeclaration):
        made_by_hand(7)


@virtual_time
async def test_node_is_found_by_name_or_class(golden):
    one, two, other = Plain(name="one"), Plain(name="two"), Other(name="other")
    async with Graph([one, two, other], clock=SimClock()) as graph:
        assert [graph.node("one"), graph.node("/two"), graph.node(Other)] == [one, two, other]
        with golden.raises(NotRunning):
            graph.node(Plain)
        with golden.raises(NotRunning):
            graph.node("on")


def test_source_is_read_alike_in_another_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("empty.yaml").write_text("name: lab\n")
    source = Source(Path("empty.yaml"), sets=("name=other",)).absolute()
    monkeypatch.chdir("/")
    description, problems = source.read()
    assert description is not None
    assert (description.name, [each.code for each in problems]) == ("other", ["no-nodes"])


def test_source_named_like_a_plugin_says_how_to_run_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("plugins").mkdir()
    Path("plugins/talker.py").write_text("from busflow import Node\n\n\nclass Talker(Node):\n    pass\n")
    _, problems = Source(Path("talker")).read()
    with pytest.raises(LaunchError) as caught:
        described("talker", None)
    for found in (*problems, *caught.value.problems):
        assert (found.code, "busflow run --plugin talker" in (found.fix or "")) == ("unreadable-file", True)


def test_thread_that_hangs_does_not_delay_the_end():
    code = "import threading; from busflow.runner.own_process import leave; "
    code += "threading.Thread(target=threading.Event().wait).start(); leave(7, set())"
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60).returncode == 7


@virtual_time
async def test_program_publishes_and_receives_beside_nodes():
    async with Graph([Plain], clock=SimClock()) as graph:
        inbox = graph.subscribe(Int64, "numbers")
        graph.publish("numbers", Int64(data=1))
        assert await anext(inbox) == Int64(data=1)


def test_waiting_thread_shows_no_busflow():
    ended = threading.Event()
    thread = threading.Thread(target=ended.wait, args=(60,))
    thread.start()
    waiting = running_lines(sys._current_frames()[thread.ident])
    ended.set()
    thread.join()
    assert waiting[0].name == "wait"
    assert not any(map(is_own, waiting))
    assert running_lines(None) == []


def test_standard_error_without_a_reader_raises_nothing(monkeypatch):
    reading, writing = os.pipe()
    os.close(reading)
    monkeypatch.setattr(standard_error, "descriptor", writing)
    standard_error.write("the run is stuck")
    os.close(writing)
