"""Commands and options that ROS users type, and busflow does not have, are answered with what to write."""

import pytest

from busflow.cli import main

Captured = pytest.CaptureFixture[str]


@pytest.mark.parametrize(
    ("verb", "instead"),
    [
        ("launch", "busflow run FILE"),
        ("component", "busflow node list"),
        ("daemon", "busflow ps"),
        ("multicast", "busflow doctor"),
        ("security", "busflow certs"),
        ("wtf", "busflow doctor"),
        ("control", "programs: of a launch file"),
        ("pkg", "busflow plugins"),
        ("lifecycle", "busflow node list -v"),
        ("stop", "kill PID ends a run as Ctrl-C does, and busflow ps shows its PID"),
        ("kill", "busflow node stop NODE stops one node"),
        ("shutdown", "busflow ps"),
        ("play", "write busflow bag play"),
        ("echo", "write busflow topic echo or busflow tf echo or busflow service echo or busflow action echo"),
    ],
)
def test_a_verb_of_ros_names_its_counterpart(capsys: Captured, verb: str, instead: str):
    assert main([verb, "x"]) == 2
    assert instead in capsys.readouterr().err.splitlines()[0]


@pytest.mark.parametrize(
    ("command", "instead"),
    [
        ("run x.yaml --ros-args -p a:=1", "--set nodes.NODE.parameters.NAME=VALUE"),
        ("run x.yaml -p a:=1", "--set nodes.NODE.parameters.NAME=VALUE"),
        ("run x.yaml -r a:=b", "--set nodes.NODE.remap.OLD=NEW"),
        ("run x.yaml --remap a:=b", "--set nodes.NODE.remap.OLD=NEW"),
        ("run x.yaml --params-file p.yaml", "--set nodes.NODE.parameters_from=FILE"),
        ("run x.yaml --log-level debug", "--verbose"),
        ("run x.yaml --show-args", "busflow run FILE --help"),
        ("run x.yaml --print", "busflow config FILE"),
        ("bag play x.mcap --start-offset 3", "--start 3s"),
        ("bag play x.mcap --playback-duration 3", "--duration 5s"),
        ("service call a b --rate 1", "while busflow service call"),
        ("topic hz imu --qos-reliability best_effort", "whatever its QoS"),
        ("bag record -s mcap -a", "it writes MCAP"),
        ("node list --no-daemon", "no daemon stands between"),
        ("topic list --spin-time 3", "no daemon stands between"),
        ("doctor --report", "all is shown"),
        ("bag burst x.mcap", "busflow bag play -p"),
        ("bag reindex x", "busflow bag recover"),
        ("param delete /camera rate", "busflow param set"),
        ("bag record --qos-profile-overrides-path q.yaml", "whatever its QoS"),
    ],
)
def test_an_option_of_ros_names_its_counterpart(capsys: Captured, command: str, instead: str):
    assert main(command.split()) == 2
    assert instead in capsys.readouterr().err.splitlines()[0]


@pytest.mark.parametrize("option", ["--qos", "-q", "--ros-arg"])
def test_another_option_gets_the_nearest(capsys: Captured, option: str):
    assert main(["run", "x.yaml", option]) == 2
    assert "NODE" not in capsys.readouterr().err
