"""When a node is started anew: the pauses, the limit, and the cases of Erlang's supervisors, systemd and Kubernetes."""

import re

from hypothesis import given
from hypothesis import strategies as st

from busflow.launchfile.model.supervision import RestartPolicy
from busflow.node.supervision import Backoff
from tests.vectors import cases, each_case


@each_case("k_supervision", "intensity/")
def test_crashes_beyond_the_limit_end_restarts(case):
    given_ = case["given"]
    policy = RestartPolicy(most=given_["max_restarts"], window_s=given_["period_s"])
    backoff = Backoff(policy)
    crashes = [float(re.search(r"t=([\d.]+)", step).group(1)) for step in case["steps"]]
    pauses = [backoff.next_s(lived_s=0, now_s=at) for at in crashes]
    assert (pauses[-1] is not None) == case["expect"]["supervisor alive"]
    assert None not in pauses[:-1]


def test_pauses_are_those_of_kubernetes():
    (case,) = cases("k_supervision", "kubernetes/")
    backoff = Backoff(RestartPolicy(most=100, first_s=10, longest_s=300, window_s=600))
    now_s, pauses = 0.0, []
    for _ in case["expect"]["delays_s"]:
        pauses.append(backoff.next_s(lived_s=0, now_s=now_s))
        now_s += pauses[-1]
    assert pauses == case["expect"]["delays_s"]
    assert backoff.next_s(lived_s=600, now_s=now_s + 600) == 10


def test_the_standard_policy_outlasts_twenty_seconds_of_failure():
    backoff, now_s = Backoff(RestartPolicy()), 0.0
    while (pause_s := backoff.next_s(lived_s=0, now_s=now_s)) is not None:
        now_s += pause_s
    assert now_s > 20


@given(st.lists(st.tuples(st.floats(0, 100), st.floats(0, 100)), max_size=60), st.integers(1, 5))
def test_restarts_stay_within_limit_window_and_longest_pause(lives, most):
    policy = RestartPolicy(most=most, first_s=0.5, longest_s=4, window_s=30)
    backoff, now_s, restarts = Backoff(policy), 0.0, []
    for lived_s, idle_s in lives:
        now_s += lived_s + idle_s
        pause_s = backoff.next_s(lived_s=lived_s, now_s=now_s)
        if pause_s is not None:
            assert 0.5 <= pause_s <= 4
            restarts.append(now_s)
    assert backoff.restarts == len(restarts)
    for index, last in enumerate(restarts[most:]):
        assert last - restarts[index] >= 30
