"""Worker: the process of one contender. It measures one case after the other, as it is asked to, line by line.

`python -m benchmarks.worker QUESTION CONTENDER SAMPLE_S ROUNDS SIZES` answers on what was its standard output: what a
peer prints goes to standard error. Each sample comes with what a bare call cost just before and after it, since a
machine's speed changes from one second to the next.
"""

from __future__ import annotations

import gc
import json
import logging
import os
import sys
import time
import traceback
import warnings

from benchmarks.question import Effort, find

CALLS = 100_000


def nothing(_message: object) -> None:
    """The bare call that everything is compared with."""


def call_s() -> float:
    """The CPU time that a bare call takes, with the loop around it."""
    call, message = nothing, object()
    began = time.thread_time_ns()
    for _ in range(CALLS):
        call(message)
    return (time.thread_time_ns() - began) / CALLS / 1e9


def answer(question: str, contender: str, effort: Effort) -> None:
    """Measure what is asked for until nobody asks any more."""
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    asked = find(question)
    one = next(each for each in asked.contenders if each.name == contender)
    if missing := one.missing():
        print(json.dumps({"missing": f"{missing} is not installed"}), file=out, flush=True)
        return
    print(json.dumps({"ready": True}), file=out, flush=True)
    for line in sys.stdin:
        case = json.loads(line)
        gc.collect()
        try:
            before = call_s()
            sample = asked.measure(one, case, effort)
            told = {"sample": sample, "call_s": (before + call_s()) / 2}
        except Exception as error:  # noqa: BLE001  # a peer may fail in any way; it is told beside the figures of others
            traceback.print_exc()
            told = {"failed": f"{type(error).__name__}: {error}"}
        print(json.dumps(told), file=out, flush=True)


if __name__ == "__main__":
    logging.disable(logging.CRITICAL)
    warnings.simplefilter("ignore")
    os.environ |= {"BUBUS_LOGGING_LEVEL": "CRITICAL", "EZMSG_LOGLEVEL": "CRITICAL"}
    answer(sys.argv[1], sys.argv[2], Effort(float(sys.argv[3]), int(sys.argv[4]), int(sys.argv[5])))
