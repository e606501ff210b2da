"""Commands and options that ROS users type, and busflow does not have, are answered with what to write."""

import pytest

from tests.cli.conftest import Shell

VERBS = "launch component daemon multicast security wtf control pkg lifecycle stop kill shutdown play echo"
OPTIONS = """\
run x.yaml --ros-args -p a:=1
run x.yaml -p a:=1
run x.yaml -r a:=b
run x.yaml --remap a:=b
run x.yaml --params-file p.yaml
run x.yaml --log-level debug
run x.yaml --show-args
run x.yaml --print
run x.yaml --qos
run x.yaml -q
run x.yaml --ros-arg
bag play x.mcap --start-offset 3
bag play x.mcap --playback-duration 3
service call a b --rate 1
topic hz imu --qos-reliability best_effort
bag record -s mcap -a
node list --no-daemon
topic list --spin-time 3
doctor --report
bag burst x.mcap
bag reindex x
param delete /camera rate
bag record --qos-profile-overrides-path q.yaml"""


@pytest.mark.parametrize("line", [*(f"{verb} x" for verb in VERBS.split()), *OPTIONS.splitlines()])
def test_output(shell: Shell, line: str):
    assert shell(line) == 2
