"""Counts of what a bridge has carried, and the lines that it logs about its neighbours."""

from busflow.dds.carried import Carried


def test_log_stays_short_whatever_neighbours_do():
    lines: list[str] = []
    carried = Carried(lines.append)
    faults = [f"rt/1bad{number} is no name of a topic" for number in range(150)]
    for fault in faults:
        carried.fault(fault)
        carried.fault(fault)
    assert lines == faults[:100]
    assert str(carried) == "0 messages carried to DDS, 0 from DDS, 0 calls; 300 faults of neighbours"
