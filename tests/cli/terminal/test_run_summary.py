"""The tables at the end of a run."""

from dataclasses import replace
from typing import Any

import pytest

from busflow.bus.qos import Overflow
from busflow.bus.statistics import (
    ClientStatistics,
    ServerStatistics,
    ServiceStatistics,
    SubscriptionStatistics,
    TopicStatistics,
)
from busflow.cli.terminal.run_summary import print_summary
from busflow.errors import ExitCode
from busflow.runner.report import NodeReport, ProcessReport, Report
from tests.golden import Golden

LINE = SubscriptionStatistics("/late", "/t", 10, Overflow.DROP_OLDEST, 6, 6, 0, 0)
SERVER = ServerStatistics(
    "/n", "/n/slow", 10, received=21, served=1, failed=2, refused=3, withdrawn=4, lost=5, waiting=6
)
FINE = ServerStatistics("/n", "/n/fine", 10, received=2, served=2, failed=0, refused=0, withdrawn=0, lost=0, waiting=0)
IDLE = replace(FINE, service="/n/idle", received=0, served=0)
CLIENT = ClientStatistics("/m", "/n/slow", called=15, answered=1, failed=5, timed_out=3, cancelled=4, waiting=5)


def service(name: str, server: ServerStatistics, *clients: ClientStatistics) -> ServiceStatistics:
    return ServiceStatistics(name, "std_srvs/srv/Trigger", (server,), clients)


PROCESSES = (
    ProcessReport("main", 1, ("/a",)),
    ProcessReport("left", 2, ("/b",), 2, "running", ("it ended so", "the process left was ended by SIGKILL")),
    ProcessReport("right", None, ("/c",), 0, "failed", ("the process right ended with exit code 1",)),
)
CASES: dict[str, dict[str, Any]] = {
    "parameters that were changed": {
        "nodes": tuple(NodeReport(f"/{name}", name, "stopped", times) for name, times in (("a", 0), ("b", 1), ("c", 3)))
    },
    "processes that were started anew, and losses between them": {
        "sections": {"processes": PROCESSES},
        "topics": (TopicStatistics("/t", "a/msg/B", 9, losses={"lost": 3, "malformed": 0, "refused": 1, "early": 1}),),
    },
    "losses by their reader and reason": {
        "topics": (
            TopicStatistics(
                "/t", "a/msg/B", 9, losses={"lost": 3}, subscriptions=(replace(LINE, lost={"link": 2, "end": 1}),)
            ),
        ),
    },
    "messages published beside a subscription": {
        "topics": (
            TopicStatistics(
                "/t", "a/msg/B", 9, subscriptions=(LINE, replace(LINE, node="/there", published=9, delivered=9))
            ),
        )
    },
    "losses of the inbox": {
        "topics": (TopicStatistics("/t", "a/msg/B", 9, losses={"inbox_dropped": 3, "inbox_refused": 1}),),
        "inbox_dropped": 3,
        "inbox_refused": 1,
    },
    "a rate since the first publisher": {
        "topics": (TopicStatistics("/a", "a/msg/B", 200), TopicStatistics("/late", "a/msg/B", 50, since_s=7.5))
    },
    "calls that failed in every way": {"services": (service("/n/slow", SERVER, CLIENT), service("/n/fine", FINE))},
    "calls, and a service that was not called": {"services": (service("/n/fine", FINE), service("/n/idle", IDLE))},
}


@pytest.mark.parametrize("case", CASES)
def test_output(case: str, golden: Golden, capsys: pytest.CaptureFixture[str]):
    parts = {"nodes": (), "topics": (), "timers": ()} | CASES[case]
    print_summary(Report("lab", 0, "sim", 10.0, ExitCode.OK, **parts))
    golden(capsys.readouterr().out)
