"""`busflow bag record`: a run that is recorded from outside."""

import json
import os
import re
import resource
import signal
import subprocess
import sys
import threading
from copy import deepcopy

import pytest

from busflow import Message
from busflow.cli import main
from busflow.cli.param import parameters_of
from busflow.interfaces.encoding.description import rihs01
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import Bool, String
from busflow.recording.bag.bag import Bag
from busflow.recording.replay.history import past_of
from busflow.wire.client.client import join
from busflow.wire.zenoh.keys import Token, TokenKind

COMMAND = [sys.executable, "-m", "busflow", "bag", "record"]


class Secret(Message, package="lab"):
    """A type that no process of the run describes."""

    word: str


def foreign(cls: type[Message]) -> ForeignType:
    support = TypeSupport(cls)
    return ForeignType(support.name, support.type_hash, support.description)


BOOL = foreign(Bool).name, foreign(Bool).type_hash


@pytest.mark.usefixtures("lab")
class TestLab:
    def test_messages_of_a_run_are_recorded_unchanged(self, tmp_path, capsys, golden):
        path = tmp_path / "run.mcap"
        assert main(["bag", "record", "-o", str(path), "--all", "--for", "1.5s"]) == 0
        out, err = capsys.readouterr()
        shown = re.sub(r"(?m)^Warning.*\n|^warning.*\n", "", err)
        golden(f"{out}--- errors\n{shown}", mask={r"recording /.* to": "recording … to", r"\d+": "#"})
        with Bag(path) as bag:
            entries = list(bag.entries())
            assert bag.complete
            assert (bag.facts.seed, bag.facts.clock) == (0, "system")
            assert bag.ledger.report["name"] == "imu_lab"
            assert {channel.topic for channel in bag.channels} >= {"/imu/data", "/joint_states", "/balance_state"}
            assert {each.topic: each.publishers for each in bag.channels}["/imu/data"] == "/imu_publisher"
        assert [entry.sequence for entry in entries] == list(range(1, len(entries) + 1))
        imu = [each for each in entries if each.channel.topic == "/imu/data"]
        assert imu
        stamps = [each.channel.plain(each.payload)["header"]["stamp"] for each in imu]
        late_ns = [
            each.log_time_ns - stamp["sec"] * 10**9 - stamp["nanosec"] for each, stamp in zip(imu, stamps, strict=True)
        ]
        assert all(0 <= late < 60 * 10**9 for late in late_ns)

    def test_between_messages_are_one_gap_fewer_than_messages(self, tmp_path, shell):
        path = tmp_path / "run.mcap"
        assert shell(f"bag record -o {path} imu/data --for 1s", mask={r"\d+ messages": "# messages"}) == 0
        imu, parameters = shell.data(f"bag info {path}")["topics"]
        assert parameters["name"] == "/parameter_events"
        with Bag(path) as bag:
            times = [each.log_time_ns for each in bag.entries(["/imu/data"])]
        assert imu["rate_hz"] == pytest.approx((imu["messages"] - 1) * 1e9 / (times[-1] - times[0]))

    def test_only_named_topics_are_recorded(self, tmp_path, capsys, golden):
        arguments = ["-o", str(tmp_path / "run.mcap"), "imu/*", "/jiont_states", "--for", "1s", "--json"]
        assert main(["bag", "record", *arguments]) == 0
        out, err = capsys.readouterr()
        answer = json.loads(out)
        assert (answer["topics"], answer["complete"], answer["missed"]) == (["/imu/data"], True, 0)
        golden("\n".join(line for line in err.splitlines() if line.startswith("warning")))

    @pytest.mark.parametrize(
        ("arguments", "recorded"),
        [
            ("--topics imu/data joint_states", ["/imu/data", "/joint_states"]),
            ("joint_states -e state$ --exclude-regex ^/bal", ["/joint_states"]),
            ("-e state$|^/imu --exclude-topics joint_states /imu/* --for 1s", ["/balance_state"]),
            ("--regex data --exclude /balance* --topics joint_states", ["/imu/data", "/joint_states"]),
        ],
    )
    def test_topics_are_chosen_as_in_ros(self, tmp_path, monkeypatch, capsys, arguments, recorded):
        monkeypatch.chdir(tmp_path)
        assert main(["bag", "record", "--json", "--for", "1s", *arguments.split()]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert answer["topics"] == recorded
        assert [re.sub("[0-9]{8}T[0-9]{6}Z", "DATE", each.name) for each in tmp_path.iterdir()] == ["imu_lab-DATE.mcap"]
        assert answer["file"] == next(tmp_path.iterdir()).name

    def test_parts_begin_after_a_time_each_whole(self, tmp_path, capsys):
        path = tmp_path / "run"
        with join() as peer, peer.advertise("/robot", foreign(Bool), qos=":1:,1:,:,:,,") as speaker:
            speaker.publish({"data": True})
            assert main(["bag", "record", "-o", str(path), "--all", "-d", "100ms", "--for", "1.3s"]) == 0
        assert capsys.readouterr().out.startswith(f"{path}: ")
        parts = [f"run_{number}.mcap" for number in range(len(list(path.glob("*.mcap"))))]
        assert {each.name for each in path.iterdir()} == {"metadata.yaml", *parts}
        assert len(parts) > 1
        with Bag(path) as bag:
            assert bag.complete
            assert [entry.sequence for entry in bag.entries()] == list(range(1, bag.messages + 1))
            assert len(list(bag.entries(["/robot"]))) == 1
        found = []
        for name in parts:
            with Bag(path / name) as part:
                found.append([each.channel.plain(each.payload) for each in part.entries(["/robot"])])
        assert found[-1] == [{"data": True}]
        assert found == sorted(found, key=len), "once it has come each part has it, on a busy machine after the first"

    def test_parts_begin_at_a_size(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)

        def publish(speaker) -> None:
            assert speaker.wait_for_listener(60)
            for _ in range(3):
                speaker.publish({"data": "x" * 200_000})

        options = ["-b", "100kB", "--compression", "none", "--for", "2s"]
        with join() as peer, peer.advertise("/big", foreign(String)) as speaker:
            publisher = threading.Thread(target=publish, args=[speaker])
            publisher.start()
            assert main(["bag", "record", "-o", "big.mcap", "big", *options]) == 0
            publisher.join()
        with Bag("big") as bag:
            assert [file.overview().messages for file in bag.files] == [3, 1, 1]  # the first with two nodes' parameters
            assert bag.complete

    @pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)])
    def test_a_signal_ends_the_file(self, tmp_path, number, code):
        path = tmp_path / "run.mcap"
        with subprocess.Popen([*COMMAND, "-o", path, "--all"], stderr=subprocess.PIPE, text=True) as it:
            assert "Ctrl-C ends it" in it.stderr.readline()
            it.send_signal(number)
            assert it.wait(60) == code
        with Bag(path) as bag:
            assert bag.complete

    def test_the_parameters_of_the_beginning_are_recorded(self, tmp_path):
        path = tmp_path / "run.mcap"
        assert main(["bag", "record", "-o", str(path), "imu/data", "--for", "1s"]) == 0
        with join() as peer:
            rows = parameters_of(peer, "imu_publisher")
        with Bag(path) as bag:
            assert bag.complete
            assert past_of(bag).parameters["/imu_publisher"] == {row["name"]: row["value"] for row in rows}

    def test_empty_recording_is_reported(self, tmp_path, shell):
        assert shell(f"bag record -o {tmp_path}/none.mcap /nothing --for 300ms", mask={"known: .*": "known: …"}) == 4
        with join() as peer, peer.advertise("/outside", foreign(Bool)):
            assert shell(f"bag record -o {tmp_path}/silent.mcap outside --for 300ms") == 1

    @pytest.mark.parametrize("qos", ["::,10:99999999999999,0:,:,,", "::,0:,:,:1,99999999999999,0", "::,-5:,:,:,,"])
    def test_publisher_with_impossible_qos_ends_no_recording(self, tmp_path, capsys, qos):
        path = tmp_path / "a.mcap"
        with join() as peer, peer.advertise("/outside", foreign(Bool)):
            end = Token(
                str(peer.session.info.zid()), 0, 99, TokenKind.PUBLISHER, "/", "stranger", "/outside", *BOOL, qos
            )
            with peer.session.liveliness().declare_token(str(end)):
                assert main(["bag", "record", "-o", str(path), "--all", "--for", "1s"]) == 0
        assert "Traceback" not in capsys.readouterr().err
        with Bag(path) as bag:
            assert bag.complete

    def test_builtin_type_is_recorded_without_a_node(self, tmp_path, capsys, golden):
        bool_, secret = foreign(Bool), foreign(Secret)
        with join() as peer, peer.advertise("/outside", bool_), peer.advertise("/secret", secret):
            assert main(["bag", "record", "-o", str(tmp_path / "a.mcap"), "outside", "secret", "--for", "300ms"]) == 1
        warnings = [line for line in capsys.readouterr().err.splitlines() if line.startswith("warning")]
        with Bag(tmp_path / "a.mcap") as bag:
            found = {each.topic: each.type_name for each in bag.channels}
        assert found == {"/outside": "std_msgs/msg/Bool", "/parameter_events": "rcl_interfaces/msg/ParameterEvent"}
        golden("\n".join(warnings), mask={"known: .*": "known: …"})

    def test_two_types_of_one_name_are_distinguished(self, tmp_path, capsys, golden):
        description = deepcopy(foreign(Secret).description)
        description["type_description"]["type_name"] = "std_msgs/msg/Bool"
        another = ForeignType("std_msgs/msg/Bool", rihs01(description), description)
        with join() as peer, peer.advertise("/one", foreign(Bool)), peer.advertise("/two", another):
            assert main(["bag", "record", "-o", str(tmp_path / "a.mcap"), "one", "two", "--for", "300ms"]) == 1
        golden("\n".join(line for line in capsys.readouterr().err.splitlines() if line.startswith("warning")))
        with Bag(tmp_path / "a.mcap") as bag:
            assert {each.topic for each in bag.channels} == {"/one", "/parameter_events"}

    def test_full_disk_is_reported_and_leaves_no_file(self, tmp_path, golden):
        def limit() -> None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))

        path = tmp_path / "run.mcap"
        command = [*COMMAND, "-o", path, "--all", "--for", "5s"]
        environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run(command, preexec_fn=limit, capture_output=True, text=True, env=environment, check=False)
        assert done.returncode == 2
        golden(done.stderr, mask={re.escape(str(tmp_path)): "FOLDER"})
        assert not path.exists()

    def test_a_file_that_is_there_is_left_alone(self, tmp_path, shell):
        path = tmp_path / "run.mcap"
        path.write_bytes(b"precious")
        assert shell(f"bag record -o {path} --all") == 2
        assert path.read_bytes() == b"precious"


@pytest.mark.parametrize("line", ["-e *", "", "--all imu/data", "--all -e imu", "--exclude-topics a b"])
def test_wrong_usage_is_refused_at_once(shell, line):
    assert shell(f"bag record {line}") == 2
