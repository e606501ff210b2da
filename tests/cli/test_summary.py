"""The tables at the end of a run."""

import pytest

from busflow.cli.summary import print_summary
from busflow.errors import ExitCode
from busflow.report import NodeReport, ProcessReport, Report, TopicReport


def test_a_node_whose_parameters_were_changed_is_named(capsys: pytest.CaptureFixture[str]):
    nodes = tuple(NodeReport(f"/{name}", name, "stopped", times) for name, times in (("a", 0), ("b", 1), ("c", 3)))
    print_summary(Report("lab", 0, "sim", 1.0, ExitCode.OK, nodes, (), ()))
    told = [line for line in capsys.readouterr().out.splitlines() if "parameters" in line]
    assert told == [
        "/b: parameters changed once while it ran",
        "/c: parameters changed 3 times while it ran",
    ]


def test_what_befell_processes_and_what_got_lost_between_them_is_told(capsys: pytest.CaptureFixture[str]):
    processes = (
        ProcessReport("main", 1, ("/a",)),
        ProcessReport("left", 2, ("/b",), 2, "running", ("it ended so", "the process left was ended by SIGKILL")),
        ProcessReport("right", None, ("/c",), 0, "failed", ("the process right ended with exit code 1",)),
    )
    topics = (TopicReport("/t", "a/msg/B", 9, (), losses={"lost": 3, "malformed": 0, "refused": 1}),)
    print_summary(Report("lab", 0, "system", 1.0, ExitCode.OK, (), topics, (), processes=processes))
    told = capsys.readouterr().out
    assert "process left was started anew 2 times; the last time the process left was ended by SIGKILL\n" in told
    assert "\nthe process right ended with exit code 1\n" in told
    assert "main" not in told
    assert "/t: not all that came from other processes was received: 3 lost, 1 refused\n" in told
