"""Timeouts: every limit of real time at which the viewer, or the page's server, gives up or warns.

Code reads a limit at the moment it needs it, e.g. `timeouts.current.hello`. Periods at which something is looked at
again are not here, nor are limits that a page states.
"""

from __future__ import annotations

import os
from typing import NamedTuple

from busflow.timeouts import stated

VARIABLE = "BUSFLOW_UI_TIMEOUTS"
"""The environment variable that sets some of them in tests: `BUSFLOW_UI_TIMEOUTS='silence=inf,call=20'`."""


class Timeouts(NamedTuple):
    """Limits in seconds of real time; one of infinity lasts a day."""

    hello: float = 5.0
    """First message of a page, with its token."""
    closing: float = 0.3
    """End of the viewers' connections, of which some read slowly."""
    last_words: float = 0.1
    """Sending of the message that the run has ended."""
    call: float = 30.0
    """Answer of a service to a viewer."""
    goal: float = 5.0
    """Answers of an action whether a goal is accepted, and whether it is canceled."""
    assistant: float = 60.0
    """Answer of the assistant to a question."""
    kept_message: float = 0.5
    """Arrival of the message that a topic keeps for late joiners."""
    silence: float = 0.6
    """Answer of a run to its heartbeat. With a beat it is less than the second within which a hang is reported."""
    connection: float = 5.0
    """Connection to another server of the protocol."""
    reconnection: float = 1.0
    """Wait before the next connection to a server that is not there."""


current: Timeouts = stated(os.environ.get(VARIABLE, ""), Timeouts(), VARIABLE)
"""The limits of this process."""
