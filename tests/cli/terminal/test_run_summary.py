"""The tables at the end of a run."""

import re
from dataclasses import replace

import pytest

from busflow.bus.qos import Overflow
from busflow.bus.statistics import ClientStatistics, ServerStatistics, SubscriptionStatistics
from busflow.cli.terminal.run_summary import print_summary
from busflow.errors import ExitCode
from busflow.runner.report import NodeReport, ProcessReport, Report, ServiceReport, TopicReport


def test_a_node_whose_parameters_were_changed_is_named(capsys: pytest.CaptureFixture[str]):
    nodes = tuple(NodeReport(f"/{name}", name, "stopped", times) for name, times in (("a", 0), ("b", 1), ("c", 3)))
    print_summary(Report("lab", 0, "sim", 1.0, ExitCode.OK, nodes, (), ()))
    output = [line for line in capsys.readouterr().out.splitlines() if "parameters" in line]
    assert output == [
        "/b: parameters changed once while it ran",
        "/c: parameters changed 3 times while it ran",
    ]


def test_process_restarts_and_losses_are_listed(capsys: pytest.CaptureFixture[str]):
    processes = (
        ProcessReport("main", 1, ("/a",)),
        ProcessReport("left", 2, ("/b",), 2, "running", ("it ended so", "the process left was ended by SIGKILL")),
        ProcessReport("right", None, ("/c",), 0, "failed", ("the process right ended with exit code 1",)),
    )
    topics = (TopicReport("/t", "a/msg/B", 9, (), losses={"lost": 3, "malformed": 0, "refused": 1, "early": 1}),)
    print_summary(Report("lab", 0, "system", 1.0, ExitCode.OK, (), topics, (), processes=processes))
    output = capsys.readouterr().out
    assert "process left was started anew 2 times; the last time the process left was ended by SIGKILL\n" in output
    assert "\nthe process right ended with exit code 1\n" in output
    assert "main" not in output
    assert "/t: not all that came from other processes was received: 3 lost, 1 refused\n" in output
    assert "/t: 1 message was published before other processes received the topic, and dropped\n" in output


def test_messages_published_beside_a_subscription_are_named(capsys: pytest.CaptureFixture[str]):
    """What no line counts is said, so that the table adds up between its lines too."""
    line = SubscriptionStatistics("/late", "/t", 10, Overflow.DROP_OLDEST, 6, 6, 0, 0)
    there = replace(line, node="/there", published=9, delivered=9)
    topics = (TopicReport("/t", "a/msg/B", 9, (line, there)),)
    print_summary(Report("lab", 0, "system", 1.0, ExitCode.OK, (), topics, ()))
    output = capsys.readouterr().out
    assert "/t: 3 messages were published before /late had started or after it had stopped\n" in output
    assert "before /there" not in output


def test_inbox_losses_are_listed_by_topic(capsys: pytest.CaptureFixture[str]):
    topics = (TopicReport("/t", "a/msg/B", 9, (), losses={"inbox_dropped": 3, "inbox_refused": 1}),)
    print_summary(Report("lab", 0, "system", 1.0, ExitCode.OK, (), topics, (), inbox_dropped=3, inbox_refused=1))
    output = capsys.readouterr().out
    assert "/t: 4 messages from other threads did not reach the topic: dropped before\n" in output
    assert "other processes" not in output


def test_rate_starts_with_the_first_publisher(capsys: pytest.CaptureFixture[str]):
    topics = (TopicReport("/a", "a/msg/B", 200, ()), TopicReport("/late", "a/msg/B", 50, (), since_s=7.5))
    print_summary(Report("lab", 0, "sim", 10.0, ExitCode.OK, (), topics, ()))
    rates = [line.split("  ")[-1].strip() for line in capsys.readouterr().out.splitlines() if line.startswith("/")]
    assert rates == ["20.0 Hz", "20.0 Hz"]


def test_service_table_adds_up_without_empty_columns(
    capsys: pytest.CaptureFixture[str],
):
    server = ServerStatistics(
        "/n", "/n/slow", 10, received=21, served=1, failed=2, refused=3, withdrawn=4, lost=5, waiting=6
    )
    client = ClientStatistics("/m", "/n/slow", called=15, answered=1, failed=5, timed_out=3, cancelled=4, waiting=5)
    fine = ServerStatistics(
        "/n", "/n/fine", 10, received=2, served=2, failed=0, refused=0, withdrawn=0, lost=0, waiting=0
    )

    def table(*services: ServiceReport) -> list[list[str]]:
        print_summary(Report("lab", 0, "sim", 1.0, ExitCode.OK, (), (), (), services=services))
        return [re.split(r" {2,}", line.strip()) for line in capsys.readouterr().out.splitlines()[3:]]

    head, _, served, called, _, _ = table(
        ServiceReport("/n/slow", "std_srvs/srv/Trigger", (server,), (client,)),
        ServiceReport("/n/fine", "std_srvs/srv/Trigger", (fine,), ()),
    )
    assert head[2:] == [
        "calls", "answered", "failed", "refused", "timed out", "withdrawn", "cancelled", "lost", "waiting",
    ]  # fmt: skip
    assert served == ["← /n", "depth 10", "21", "1", "2", "3", "4", "5", "6"]
    assert called == ["→ /m", "15", "1", "2", "3", "4", "5"]
    assert [sum(map(int, line[-count:])) for line, count in ((served, 6), (called, 5))] == [21, 15]
    head, _, line = table(ServiceReport("/n/fine", "std_srvs/srv/Trigger", (fine,), ()))
    assert head[2:] == ["calls", "answered", "failed", "waiting"]
    assert line == ["← /n", "depth 10", "2", "2", "0", "0"]


def test_uncalled_services_are_left_out(capsys: pytest.CaptureFixture[str]):
    idle = ServerStatistics(
        "/n", "/n/idle", 10, received=0, served=0, failed=0, refused=0, withdrawn=0, lost=0, waiting=0
    )
    services = (ServiceReport("/n/idle", "std_srvs/srv/Trigger", (idle,), ()),)
    print_summary(Report("lab", 0, "sim", 1.0, ExitCode.OK, (), (), (), services=services))
    assert "/n/idle" not in capsys.readouterr().out
