"""Counts of what a bridge has carried, and the lines that it logs about its neighbours."""

from busflow.dds.carried import Carried


def test_log_stays_short_whatever_neighbours_do(golden):
    lines: list[str] = []
    carried = Carried(lines.append)
    faults = [f"rt/1bad{number} is no name of a topic" for number in range(150)]
    for fault in faults:
        carried.fault(fault)
        carried.fault(fault)
    assert lines == faults[:100]
    golden(str(carried))
