"""The output of `list` and `find`, for topics, services and actions alike."""

import json

import pytest

from busflow.cli.terminal.listing import print_list, print_of_type
from busflow.errors import NoSuchTarget
from busflow.wire.client.actions import ActionView
from busflow.wire.client.graph_view import TopicView

IMU = TopicView("/imu", ("sensor_msgs/msg/Imu",), (), ())
MOVE = ActionView("/move", ("lab/action/Move",), ("/arm",), ())


@pytest.mark.parametrize(
    ("count", "show_types", "lines"),
    [
        (False, False, ["/imu", "/move"]),
        (False, True, ["/imu [sensor_msgs/msg/Imu]", "/move [lab/action/Move]"]),
        (True, True, ["2"]),
    ],
)
def test_list_has_names_types_or_a_number(capsys, count, show_types, lines):
    print_list([IMU, MOVE], count=count, show_types=show_types)
    assert [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()] == lines


@pytest.mark.parametrize(("count", "line"), [(False, "/move"), (True, "1")])
def test_names_of_a_type_are_found(capsys, count, line):
    print_of_type("lab/action/Move", [IMU, MOVE], "action", as_json=False, count=count)
    assert capsys.readouterr().out == f"{line}\n"


def test_json_has_the_names_whether_or_not_they_are_counted(capsys):
    print_of_type("lab/action/Move", [MOVE], "action", as_json=True, count=True)
    answer = json.loads(capsys.readouterr().out)
    assert (answer["type"], answer["actions"]) == ("lab/action/Move", ["/move"])


@pytest.mark.parametrize(("known", "advice"), [([MOVE], "lab/action/Move"), ([], "start one")])
def test_unknown_type_is_refused_with_advice(known, advice):
    with pytest.raises(NoSuchTarget, match=advice):
        print_of_type("lab/action/Mov", known, "action", as_json=False, none="start one")
