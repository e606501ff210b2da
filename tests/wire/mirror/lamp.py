"""The account of a lamp of `tests/nodes/lamp.py` whose callers have given up."""

import time

PATIENCE_S = 60.0


def two_are_withdrawn(peer):
    """Wait until of three requests those two are withdrawn that had not begun."""
    account = {}
    end = time.monotonic() + PATIENCE_S
    while account.get("withdrawn") != 2 and time.monotonic() < end:
        answers = peer.ask("services", names=["/lamp/never"])
        (account,) = [each for answer in answers for each in answer["/lamp/never"]["servers"]]
    return (account["received"], account["withdrawn"], account["waiting"]) == (3, 2, 1)
