"""What a launch file expects: each kind holds where it should and is told, with its place, where it does not."""

import json

import pytest

from busflow.cli import main
from busflow.launchfile.load.load import load
from busflow.testing.expectations import Trials

NODES = """
import asyncio

from busflow import Node, Parameters, QoS, publisher, subscription, timer
from busflow.msgs.sensor_msgs import Imu
from busflow.msgs.std_msgs import Float64, Header


class SourceParameters(Parameters):
    fails_at: float = 9.0
    complains: bool = False
    stops_at_s: float = 1000.0


class Source(Node):
    parameters: SourceParameters
    imu = publisher(Imu, "imu")
    level = publisher(Float64, "level")

    @timer(0.1)
    def tick(self) -> None:
        level = self.rng.random()
        if level > self.parameters.fails_at:
            raise ValueError(f"{level:.3f} is too much")
        if self.parameters.complains:
            self.log.error("nobody cares")
        if self.clock.seconds() <= self.parameters.stops_at_s:
            self.imu.publish(Imu(header=Header(stamp=self.clock.now())))
        self.level.publish(Float64(data=level))


class SinkParameters(Parameters):
    takes_s: float = 0.0


class Sink(Node):
    parameters: SinkParameters

    @subscription("imu", qos=QoS(depth=2))
    async def on_imu(self, imu: Imu) -> None:
        await asyncio.sleep(self.parameters.takes_s)
"""

FILE = """\
name: expecting
plugins: [.]
nodes:
  source:
    plugin: nodes:Source
  sink:
    plugin: nodes:Sink
expect:
  duration: 10s
"""


@pytest.fixture
def expecting(tmp_path, monkeypatch):
    """Writes a launch file that expects something, and makes its folder the current one."""
    (tmp_path / "nodes.py").write_text(NODES)
    monkeypatch.chdir(tmp_path)

    def write(section):
        path = tmp_path / "expecting.yaml"
        path.write_text(FILE + "".join(f"  {line}\n" for line in section.splitlines()))
        return str(path.name)

    return write


@pytest.fixture
def wrong(expecting):
    """What is wrong with a launch file that expects something: where and what."""

    def find(section, *, seeds=(0,), **overrides):
        path = expecting(section)
        sets = [f"nodes.{key.replace('__', '.parameters.')}={json.dumps(value)}" for key, value in overrides.items()]
        trials = Trials(load(path, sets=sets), 10.0)
        trials.run(seeds)
        return [(problem.place.line if problem.place else None, problem.message) for problem in trials.problems()]

    return find


RATE = "topics:\n  /imu:\n    rate_hz: [9.9, 10.1]"
AGE = "topics:\n  /imu:\n    max_age: 100ms"
DROPS = "topics:\n  /imu:\n    max_dropped: 0\nmax_dropped: 5"
VALUES = "topics:\n  /level:\n    values:\n      data: [0, 0.99]"


@pytest.mark.parametrize(
    "section", ["{}", "no_errors: true", "max_dropped: 0", RATE, AGE, DROPS, VALUES.replace("0.99", "1")]
)
def test_met_expectation_is_not_reported(wrong, section):
    assert wrong("" if section == "{}" else section) == []


def test_wrong_average_rate_is_reported(wrong, golden):
    text = "/imu was published at 5 Hz, not between 9.9 and 10.1 (seed 0, of 1)"
    assert wrong(RATE, source__stops_at_s=5) == [(12, text)]
    golden(wrong(RATE.replace("10.1", ".inf"), source__stops_at_s=5)[0][1])
    golden(wrong(RATE.replace("9.9", "-.inf").replace("10.1", "9"))[0][1])


def test_the_age_of_what_reaches_a_node(wrong):
    text = "/imu was 0.15 s old when /sink got it at 0.45 s, not at most 0.1 s"
    ((line, message),) = wrong(AGE, sink__takes_s=0.35)
    assert line == 12
    assert message.startswith(text)
    assert message.endswith(" times (seed 0, of 1)")
    assert wrong(AGE.replace("100ms", "151ms"), sink__takes_s=0.35) == []


def test_dropped_messages_in_all_and_of_one_topic(wrong, golden):
    golden("\n".join(f"{line}: {message}" for line, message in wrong(DROPS, sink__takes_s=0.3)))


def test_errors_in_the_log_are_counted(wrong):
    text = "the log has 100 errors: /source: nobody cares, the first of 100 times (seed 0, of 1)"
    assert wrong("no_errors: true", source__complains=True) == [(10, text)]
    assert wrong("no_errors: false", source__complains=True) == []


def test_field_values_are_reported_with_their_seeds(wrong):
    ((line, text),) = wrong(VALUES, seeds=range(20))
    assert line == 13
    assert text.startswith("data of /level was 0.99")
    assert text.endswith(" others, of 20)")
    seed = int(text.split("(seed ")[1].split(",")[0])
    assert wrong(VALUES, seeds=range(seed)) == []
    assert len(wrong(VALUES, seeds=[seed])) == 1


def test_values_inside_messages_and_arrays(wrong, golden):
    assert wrong("topics:\n  /imu:\n    values:\n      orientation.w: [1, 1]\n      angular_velocity.x: [0, 0]") == []
    section = "topics:\n  /imu:\n    values:\n      orientation_covariance: [1, 2]\n      header.stamp.sec: [0, 1]"
    first, second = wrong(section)
    assert first[0] == 13
    golden(first[1])
    golden(second[1])


def test_failing_node_breaks_expectations_without_an_entry(wrong, golden):
    ((line, text),) = wrong("", source__fails_at=0.99, seeds=range(20))
    assert line is None
    golden(text)
    assert text.endswith(", of 20)")


# The command


def test_command_prints_the_place_and_the_seed(expecting, capsys, golden):
    path = expecting(VALUES)
    assert main(["test", path, "--for", "1min", "--seeds", "5"]) == 1
    captured = capsys.readouterr()
    golden(captured.out)
    assert "      data: [0, 0.99]\n" in captured.out
    golden(captured.out)


def test_command_prints_a_failure_in_its_lines(expecting, capsys, golden):
    assert main(["test", expecting(""), "--set", "nodes.source.parameters.fails_at=0"]) == 1
    first, at, code, error, _ = capsys.readouterr().out.splitlines()
    golden(first)
    assert at.startswith("  at nodes.py:")
    assert code.startswith("    raise ")
    assert "is too much" in error


def test_the_command_is_content_where_all_holds(expecting, capsys, golden):
    assert main(["test", expecting(f"{RATE}\nno_errors: true")]) == 0
    golden(capsys.readouterr().out)


def test_command_prints_json(expecting, capsys):
    assert main(["test", expecting(VALUES), "--seed", "3", "--for", "100s", "--json"]) == 1
    text = json.loads(capsys.readouterr().out)
    assert (text["ok"], text["seeds"], text["for_s"]) == (False, [3], 100)
    assert text["problems"][0]["line"] == 13


def test_file_without_expectations_is_reported(expecting, capsys, tmp_path, golden):
    (tmp_path / expecting("")).write_text(FILE[: FILE.index("expect:")])
    assert main(["test", "expecting.yaml", "--for", "1s"]) == 0
    golden(capsys.readouterr().out)


MISTAKES = {
    "topics:\n  /imo:\n    max_age: 1": (11, "no node publishes or receives the topic /imo", "did you mean '/imu'?"),
    "topics:\n  /level:\n    max_age: 1": (12, "carries std_msgs/msg/Float64, which has no header", "leave it out"),
    "topics:\n  /imu:\n    values:\n      orientation.v: [0, 1]": (
        13,
        "has no field orientation.v",
        "known: w, x, y, z",
    ),
    "topics:\n  /imu:\n    rate_hz: [2, 1]": (12, "the lower limit comes first", ""),
    "topics:\n  /imu:\n    rate_hz: [1]": (
        12,
        "has 1",
        "the highest value, such as rate_hz: [9.5, 10.5]",
    ),
    "topics:\n  /imu:\n    rate_hz: 1": (12, "must be a list", "the lowest and the highest value, such as rate_hz: ["),
    "topics:\n  /imu:\n    rate: [1, 2]": (12, "unknown key", "did you mean 'rate_hz'?"),
    "max_droped: 1": (10, "unknown key expect.max_droped", "did you mean 'max_dropped'?"),
    "max_dropped: -1": (10, "max_dropped", ""),
}


@pytest.mark.parametrize("section", MISTAKES, ids=range(len(MISTAKES)))
@pytest.mark.parametrize("command", [["check"], ["test"]])
def test_mistake_is_reported_with_place_before_the_run(expecting, capsys, section, command):
    line, message, fix = MISTAKES[section]
    assert main([*command, expecting(section)]) == (3 if command == ["check"] else 2)
    captured = capsys.readouterr()
    text = captured.out + captured.err
    assert f"expecting.yaml:{line}:" in text
    assert message in text
    assert fix in text


def test_an_included_file_expects_of_its_own_topics(expecting, capsys, tmp_path, golden):
    (tmp_path / "outer.yaml").write_text("include: [{file: expecting.yaml, namespace: left}]\n")
    expecting("topics:\n  imu:\n    rate_hz: [20, 30]")
    assert main(["test", "outer.yaml"]) == 1
    golden(capsys.readouterr().out)


def test_expectations_use_the_run_s_seed(tmp_path, expecting, golden):
    path = expecting("")
    (tmp_path / path).write_text(FILE + "clock:\n  mode: sim\n  seed: 7\n")
    assert load(path).seed == 7
    (tmp_path / path).write_text(FILE + "seed: 3\nclock:\n  mode: sim\n  seed: 7\n")
    with golden.raises(Exception):
        load(path)


def test_trials_ignore_the_clock_rate_of_the_file(tmp_path, expecting):
    path = tmp_path / "slow.yaml"
    path.write_text(f"include: {expecting('no_errors: true')}\nclock: {{mode: sim, rate: 0.001}}\n")
    trials = Trials(load(path), 2)  # more than half an hour at that rate
    trials.run([1])
    assert trials.seeds == [1]
