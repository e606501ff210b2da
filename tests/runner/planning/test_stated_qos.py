"""Where a QoS or a type that does not fit is written, and the line that would mend it."""

import pytest

NODES = "plugins: [plugins]\nnodes:\n  sensor: {plugin: sensor}\n  other: "
AT_SUBSCRIBER = "write `subscriptions: {/numbers: {reliability: best_effort}}` below other (lab1.yaml:4:3)"
AT_PUBLISHER = "write `publishers: {/numbers: {reliability: reliable}}` below sensor (lab1.yaml:3:3)"


@pytest.mark.parametrize(
    ("other", "place", "fix"),
    [
        (
            "{plugin: listener}\n",
            "plugins/sensor.py:6:5",
            f"{AT_SUBSCRIBER}, or {AT_PUBLISHER}",
        ),
        (
            "{plugin: listener, subscriptions: {numbers: {depth: 3, reliability: reliable}}}\n",
            "lab1.yaml:4:65",
            f"write reliability: best_effort at lab1.yaml:4:65, or {AT_PUBLISHER}",
        ),
        (
            "{plugin: listener, subscriptions: {numbers: default}}\n",
            "lab1.yaml:4:54",
            f"write reliability: best_effort at lab1.yaml:4:54, or {AT_PUBLISHER}",
        ),
        (
            "{plugin: listener, subscriptions: {numbers: {deadline: 1s, reliability: best_effort}}}\n",
            "lab1.yaml:4:55",
            (
                "write deadline: null at lab1.yaml:4:55, or write `publishers: {/numbers: {deadline: 1s}}` below "
                "sensor (lab1.yaml:3:3)"
            ),
        ),
        (
            "{plugin: stately, subscriptions: {numbers: {reliability: best_effort}}}\n",
            "plugins/stately.py:7:9",
            (
                "write `subscriptions: {/numbers: {durability: volatile}}` below other (lab1.yaml:4:3), or write "
                "`publishers: {/numbers: {durability: transient_local}}` below sensor (lab1.yaml:3:3)"
            ),
        ),
        (
            "{plugin: listener}\ntopics: {/numbers: {qos: {durability: volatile}}}\n",
            "plugins/sensor.py:6:5",
            f"{AT_SUBSCRIBER}, or {AT_PUBLISHER}",
        ),
    ],
)
def test_mismatch_points_to_where_qos_is_written(check, other, place, fix):
    (problem,) = check(NODES + other).errors
    assert (problem.code, str(problem.place), problem.fix) == ("qos-mismatch", place, fix)


@pytest.mark.parametrize(
    ("other", "place"),
    [("{plugin: reader}", "plugins/reader.py:6:5"), ("{plugin: reader, remap: {numbers: /numbers}}", "lab1.yaml:4:35")],
)
def test_mismatch_points_to_where_type_is_written(check, other, place):
    places = {each.code: str(each.place) for each in check(NODES + other).errors}
    assert places["type-mismatch"] == place
