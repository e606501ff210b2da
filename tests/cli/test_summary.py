"""The tables at the end of a run."""

import pytest

from busflow.cli.summary import print_summary
from busflow.errors import ExitCode
from busflow.report import NodeReport, Report


def test_a_node_whose_parameters_were_changed_is_named(capsys: pytest.CaptureFixture[str]):
    nodes = tuple(NodeReport(f"/{name}", name, "stopped", times) for name, times in (("a", 0), ("b", 1), ("c", 3)))
    print_summary(Report("lab", 0, "sim", 1.0, ExitCode.OK, nodes, (), ()))
    told = [line for line in capsys.readouterr().out.splitlines() if "parameters" in line]
    assert told == [
        "/b: parameters changed once while it ran",
        "/c: parameters changed 3 times while it ran",
    ]
