"""What is recorded of a goal reaches the node under the identifier that its goal has now, and the other way round."""

from busflow.recording.replay.goals import SentGoals

THEN, NOW, STRANGE = bytes([1] * 16), bytes([2] * 16), bytes([3] * 16)
HEAD, REST = b"\0\1\0\0", b"rest"


def test_nth_goal_stands_for_the_nth_recorded():
    goals = SentGoals({("/move", "/boss"): [STRANGE, THEN]})
    goals.send("/move", "/boss", 1, NOW)
    assert goals.as_now(HEAD + THEN + REST) == HEAD + NOW + REST
    assert goals.as_recorded(HEAD + NOW + REST) == HEAD + THEN + REST


def test_goals_of_others_stay_as_they_are():
    goals = SentGoals({("/move", "/boss"): [THEN]})
    for service, caller, number in (("/move", "/boss", 1), ("/move", "/other", 0), ("/turn", "/boss", 0)):
        goals.send(service, caller, number, NOW)
    assert goals.as_recorded(HEAD + NOW + REST) == HEAD + NOW + REST
    assert goals.as_now(HEAD + THEN + REST) == HEAD + THEN + REST
    assert goals.as_now(b"short") == b"short"
