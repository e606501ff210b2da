"""The process of a bridge: from its options to its end, by a signal or with the run.

A run starts one as `python -m busflow.dds.process RUN DOMAIN INTERFACE [PATTERN]... PIPE`.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence
from importlib.util import find_spec

from busflow.bus.patterns import Selection
from busflow.clock import SystemClock
from busflow.errors import BusflowError, InspectionUnavailable, how_to_install
from busflow.log import Log, console_sink
from busflow.processes.pipe import PipeWriter
from busflow.wire.zenoh.run_directory import FoundRun, find_run
from busflow.wire.zenoh.session import require_zenoh

NODE = "dds"
"""The name under which a bridge logs."""


def require_cyclonedds() -> None:
    """Check that DDS can be spoken here.

    Raises:
        InspectionUnavailable: it cannot.
    """
    if find_spec("cyclonedds") is None:
        text = "DDS is spoken with cyclonedds, which is not installed here"
        raise InspectionUnavailable(f"{text}; {how_to_install('busflow[dds]')}")


def serve(
    run: FoundRun, domain: int, patterns: Sequence[str], *, interface: str | None = None, pipe: int | None = None
) -> None:
    """Carry between a run and a DDS domain, until SIGINT, SIGTERM, or the end of the run.

    Args:
        run: the run, on this machine.
        domain: the domain's number.
        patterns: the topics, services and actions that cross; all that are not hidden without one.
        interface: the network interface; None for the loopback interface.
        pipe: where to write the log, for the run that has started this process; None for standard error.

    Raises:
        InspectionUnavailable: the run does not answer, or DDS cannot be spoken here.
        InvalidName: a pattern, or the interface, has a name that cannot be.
    """
    require_zenoh()
    require_cyclonedds()
    selection = Selection(patterns)
    writer = None if pipe is None else PipeWriter(pipe)
    sink = console_sink(sys.stderr, colour=False) if writer is None else writer.log
    log = Log(SystemClock(), sinks=(sink,)).bind(NODE)
    from busflow.dds.bridge import DdsBridge  # needs cyclonedds

    bridge = DdsBridge(run, domain, selection, interface=interface, log=log.warning)
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda _number, _frame: bridge.stop())
        where = "on this machine" if interface is None else f"on {interface}"
        log.info("the run and DDS see each other", domain=domain, where=where)
        bridge.serve()
    finally:
        bridge.close()
        log.info("the bridge to DDS is closed", carried=str(bridge.carried))
        if writer is not None:
            writer.close()


def _run_as_program() -> None:
    name, domain, interface, *patterns, pipe = sys.argv[1:]
    try:
        serve(find_run(name), int(domain), patterns, interface=interface or None, pipe=int(pipe))
    except BusflowError as error:
        print(f"error: {error}", file=sys.stderr)  # noqa: T201  # the run logs what its program prints
        sys.exit(error.exit_code)


if __name__ == "__main__":
    _run_as_program()
