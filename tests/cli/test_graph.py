"""`busflow graph`: drawings of a running graph and of a launch file."""

import json

import pytest

from busflow.cli import main

Captured = pytest.CaptureFixture[str]


@pytest.mark.usefixtures("lab")
def test_without_a_file_the_running_graph_is_drawn(capsys: Captured):
    assert main(["graph"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "/imu_publisher  (imu_publisher)",
        "  /imu/data      sensor_msgs/msg/Imu         →  /processor",
        "  /joint_states  sensor_msgs/msg/JointState  →  /processor",
        "/processor  (processor)",
        "  /balance_state    std_msgs/msg/Float64  →  no node",
        "  /stability_index  std_msgs/msg/Float64  →  no node",
    ]
    assert main(["graph", "--format", "mermaid"]) == 0
    assert "  n0 --> t1" in capsys.readouterr().out


@pytest.mark.usefixtures("lab")
def test_all_includes_what_every_node_has(capsys: Captured):
    assert main(["graph", "-a", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["version"] == 1
    assert "/rosout" in [topic["name"] for topic in answer["topics"]]
    assert "/imu_publisher/get_parameters" in [service["name"] for service in answer["services"]]


@pytest.mark.usefixtures("project", "place")
def test_with_a_file_nothing_has_to_run(capsys: Captured):
    assert main(["graph", "talk.yaml"]) == 0
    assert capsys.readouterr().out.startswith("/talker  (talker)\n  /numbers  std_msgs/msg/Float64  →  /listener\n")
    assert main(["graph", "talk.yaml", "--run", "talk"]) == 2
    assert main(["graph"]) == 4
    assert "nothing is running" in capsys.readouterr().err
