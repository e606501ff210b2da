"""Timeouts: the limits of real time at which the assistant no longer waits; tests put another object into `current`."""

from __future__ import annotations

import os
from typing import NamedTuple

from busflow.timeouts import stated

VARIABLE = "BUSFLOW_ASSISTANT_TIMEOUTS"
"""The environment variable that sets them in tests: `BUSFLOW_ASSISTANT_TIMEOUTS='reading=inf'`."""


class Timeouts(NamedTuple):
    """Limits in seconds by the run's clock; one of infinity lasts a day."""

    reading: float = 10.0
    """Reading of the pages from the start of the assistant, if a question about them comes first."""


current: Timeouts = stated(os.environ.get(VARIABLE, ""), Timeouts(), VARIABLE)
"""The limits of this process."""
