"""Several machines, for real: runs of one launch file that meet by TLS, each with a place of its own for its runs."""

import json
import os
import signal
import socket
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from datetime import timedelta
from pathlib import Path

import pytest

from busflow.cli import main
from busflow.recording.bag.bag import Bag
from busflow.timeouts import VARIABLE
from busflow.wire.machines.certificates import Authority
from tests.golden import Golden
from tests.processes.conftest import NODES, Run, busflow
from tests.ros2.sessions import free_port

PATIENCE_S = 60.0


@pytest.fixture(scope="session")
def certificates(tmp_path_factory) -> Path:
    """A folder with those of two machines, and of who may look."""
    folder = tmp_path_factory.mktemp("certs")
    authority = Authority.new(folder)
    for name in ("main", "arm", "head", "viewer", "stranger"):
        authority.add(name, addresses=["127.0.0.1", "10.99.0.2"])
    return folder


@pytest.fixture
def expired() -> Callable[[Path, str], None]:
    """Makes a certificate of yesterday's, with what OpenSSL's own command would."""

    def make(folder: Path, name: str) -> None:
        from cryptography import x509
        from cryptography.hazmat.primitives import hashes, serialization

        cert = x509.load_pem_x509_certificate((folder / f"{name}.pem").read_bytes())
        own, signing = (
            serialization.load_pem_private_key((folder / f"{each}.key").read_bytes(), None) for each in (name, "ca")
        )
        draft = x509.CertificateBuilder(cert.issuer, cert.subject, own.public_key(), cert.serial_number)
        ended = cert.not_valid_before_utc
        draft = draft.not_valid_before(ended - timedelta(days=2)).not_valid_after(ended - timedelta(days=1))
        for extension in cert.extensions:
            draft = draft.add_extension(extension.value, extension.critical)
        signed = draft.sign(signing, hashes.SHA256())
        (folder / f"{name}.pem").write_bytes(signed.public_bytes(serialization.Encoding.PEM))

    return make


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
def two(certificates: Path, port: int) -> str:
    return two_machines(certificates, port)


def two_machines(certificates: Path, port: int) -> str:
    """A launch file with the source on the main machine, and sinks in two processes of the arm."""
    return f"""
machines:
  arm: {{connect: tls/127.0.0.1:{port}}}
network: {{ca: {certificates}/ca.pem, allow: {{viewer: read}}}}
processes:
  side: {{machine: arm}}
nodes:
  source:
    plugin: source
    parameters: {{rate_hz: 20}}
  sink:
    plugin: sink
    machine: arm
    parameters: {{enough: 10}}
    subscriptions: {{numbers: {{depth: 1000}}}}
  beside:
    plugin: sink
    process: side
    parameters: {{enough: 10}}
    subscriptions: {{numbers: {{depth: 1000}}}}
"""


@pytest.mark.long
def test_two_machines_make_one_graph_each_records_itself(start: Callable, two: str):
    killed = start(two, machine="arm")  # before the main machine; the next one comes after it
    killed.wait_for("the machine main is not linked: ")
    main = start(two, "--record", "main-run", machine="main")
    main.wait_for("the machine arm is linked")
    assert killed.end(signal.SIGKILL) == -signal.SIGKILL
    main.wait_for("the machine arm is not linked any more")
    main.wait_for("the machine arm is not linked: nothing listens at")
    arm = start(two, "--record", "arm-run", machine="arm")
    main.wait_for("the machine arm is linked again")
    arm.wait_for("the machine main is linked")
    arm.wait_for("received enough", times=2)
    for run in (main, arm):
        nodes = json.loads(busflow(run.runtime, "node", "list", "--json"))["nodes"]
        assert {each["name"]: each["process"] for each in nodes} == {
            "/source": "main",
            "/sink": "arm:main",
            "/beside": "arm:side",
        }
        assert "success=True" in busflow(run.runtime, "service", "call", "count", "std_srvs/srv/Trigger")
        assert "10" in busflow(run.runtime, "param", "get", "sink", "enough")
        assert "Int64" in busflow(run.runtime, "topic", "info", "numbers")
    second, third = start(two, machine="main"), start(two, machine="arm")
    assert second.end(None) == third.end(None) == 1
    assert any("machine main already" in line for line in second.lines)
    assert any("cannot listen at tls/127.0.0.1" in line for line in third.lines)
    assert arm.end() == 130
    main.wait_for("the machine arm is not linked any more", times=2)
    heard = arm.topic("/numbers")["subscriptions"]
    assert {line["node"] for line in heard} == {"/sink", "/beside"}
    for line in heard:
        assert line["published"] == line["delivered"] + line["dropped"] + line["queued"] >= 10
    assert main.end() == 130
    each_has_recorded_its_own(main)


def each_has_recorded_its_own(main):
    published = main.topic("/numbers")["published"]
    with Bag(main.folder / "main-run") as own, Bag(main.folder / "arm-run") as other:
        assert (own.complete, other.complete) == (True, True), (own.incomplete, other.incomplete)
        assert len(list(own.entries(["numbers"]))) == published >= 10
        assert list(other.entries(["numbers"])) == []
        assert [each.files[0].path.name for each in other.series] == ["main.mcap", "side.mcap"]
        assert [each.facts and each.facts.process for each in other.series] == ["arm:main", "arm:side"]


@pytest.mark.long
def test_kept_messages_come_once_after_a_broken_link(start: Callable, two: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(VARIABLE, f"{os.environ[VARIABLE]},kept_messages=inf,held_messages=inf")
    kept = "topics: {numbers: {qos: {durability: transient_local, depth: 1000}}}\n"
    text = two.replace("subscriptions: {numbers: {depth: 1000}}", "") + kept
    main, arm = start(text, machine="main"), start(text, machine="arm")
    arm.wait_for("received enough", times=2)
    for times, (stopped, other, name) in enumerate(((main, arm, "main"), (arm, main, "arm")), 1):
        os.kill(stopped.process.pid, signal.SIGSTOP)
        other.wait_for(f"the machine {name} is not linked any more", times=times)  # both sides have seen each break
        os.kill(stopped.process.pid, signal.SIGCONT)
        arm.wait_for("the machine main is linked again", times=times)
        main.wait_for("the machine arm is linked again", times=times)
        busflow(arm.runtime, "topic", "echo", "numbers", "--once")
    assert main.end() == arm.end() == 130
    assert not any("begins anew" in line for line in arm.lines), "a message came twice"
    heard, published = arm.topic("/numbers"), main.topic("/numbers")["published"]
    lost = heard["losses"].pop("lost", 0)  # on a busy machine Zenoh may discard an answer that was overtaken
    assert heard["losses"] == {}
    assert 10 < heard["published"] <= published
    assert sum(heard["published"] - line["published"] for line in heard["subscriptions"]) <= lost, "in either process"
    for line in heard["subscriptions"]:
        assert line["published"] == line["delivered"] + line["queued"]
        assert line["dropped"] == 0


@pytest.mark.timeout(400)
@pytest.mark.long
def test_viewer_with_read_rights_cannot_change_anything(start: Callable, two: str, tmp_path: Path):
    main, arm = start(two, machine="main"), start(two, machine="arm")
    arm.wait_for("received enough", times=2)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    run = ("--run", f"viewer@{tmp_path}/run.yaml")
    assert "data: " in busflow(elsewhere, "topic", "echo", "numbers", "--once", *run)
    assert "arm:side" in busflow(elsewhere, "node", "list", "-v", *run)
    assert "10" in busflow(elsewhere, "param", "get", "sink", "enough", *run)
    told = busflow(elsewhere, "doctor", *run, expect=(0, 3))
    assert "nothing is wrong" in told or "ticks" in told  # on a busy machine a timer may have missed some
    assert "received enough" in busflow(elsewhere, "log", *run)
    for command in (
        ("topic", "pub", "--once", "numbers", "std_msgs/msg/Int64", "{data: 5}"),
        ("service", "call", "count", "std_srvs/srv/Trigger"),
        ("param", "set", "sink", "enough", "7"),
    ):
        assert "viewer may look" in busflow(elsewhere, *command, *run, expect=(1,))
    unnamed_certificate_sees_nothing(tmp_path)
    # Not the command is what keeps it from that: with a file of its own that says otherwise it does no more.
    told = (tmp_path / "run.yaml").read_text()
    (tmp_path / "mine.yaml").write_text(told.replace("viewer: read", "viewer: all"))
    mine = ("--run", f"viewer@{tmp_path}/mine.yaml")
    busflow(elsewhere, "topic", "pub", "-t", "3", "numbers", "std_msgs/msg/Int64", "{data: 500000}", *mine, "-w", "0")
    busflow(elsewhere, "service", "call", "count", "std_srvs/srv/Trigger", *mine, expect=(1,))
    busflow(elsewhere, "param", "set", "sink", "enough", "7", *mine, expect=(1,))
    assert "10" in busflow(elsewhere, "param", "get", "sink", "enough", *mine)
    assert main.end() == arm.end() == 130
    assert not any("begins anew" in line for line in arm.lines), "a number of the viewer's was heard"
    assert arm.topic("/numbers")["losses"] == {}


def unnamed_certificate_sees_nothing(folder: Path):
    told = (folder / "run.yaml").read_text()
    (folder / "not_named.yaml").write_text(told.replace("viewer: read", "stranger: all"))
    assert "no one called" in busflow(folder, "topic", "list", "--run", f"stranger@{folder}/run.yaml", expect=(4,))
    assert "does not answer" in busflow(
        folder, "topic", "list", "--run", f"stranger@{folder}/not_named.yaml", expect=(1,)
    )


@pytest.fixture
def others(tmp_path_factory) -> Path:
    """Certificates of another authority."""
    folder = tmp_path_factory.mktemp("others")
    authority = Authority.new(folder)
    for name in ("main", "arm"):
        authority.add(name, addresses=["127.0.0.1"])
    return folder


@pytest.fixture(scope="module")
def lone(start_for_all: Callable, certificates: Path) -> Iterator[tuple[int, Path]]:
    """The port of an arm that waits for its main machine, and where other terminals find it."""
    port = free_port()
    arm = start_for_all(two_machines(certificates, port), machine="arm")
    arm.wait_for("the machine main is not linked")
    yield port, arm.runtime
    assert arm.end() == 130


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux lists the connections of other processes")
def test_doctor_names_connections_that_send_nothing(lone: tuple[int, Path]):
    port, runtime = lone
    silent: list[str] = []
    with ExitStack() as connections:
        while not silent:
            for _ in range(3):  # Zenoh ends each after ten seconds: on a busy machine one look may come too late
                connections.enter_context(socket.create_connection(("127.0.0.1", port)))
            findings = json.loads(busflow(runtime, "doctor", "--json", expect=(3,)))["findings"]
            silent = [each["fix"] for each in findings if each["code"] == "silent-connections"]
    assert "firewall" in silent[0]


@pytest.mark.long
def test_certificate_of_another_authority_is_not_linked(start: Callable, lone: tuple[int, Path], others: Path):
    main = start(two_machines(others, lone[0]), machine="main")
    main.wait_for("the machine arm is not linked: its certificate is not one of our authority")
    assert main.end() == 130
    assert main.topic("/numbers")["published"] > 0, "its nodes do not wait for anybody"


@pytest.mark.long
def test_nothing_but_tls_with_valid_certificate_is_accepted(
    lone: tuple[int, Path], certificates: Path, tmp_path: Path, expired: Callable
):
    port, _ = lone
    late = tmp_path / "late"
    late.mkdir()
    for name in ("ca.pem", "ca.key", "main.pem", "main.key"):
        (late / name).write_bytes((certificates / name).read_bytes())
    assert not opened(f"tcp/127.0.0.1:{port}", {})
    assert not opened(f"tls/127.0.0.1:{port}", {"transport/link/tls/root_ca_certificate": f"{certificates}/ca.pem"})
    assert opened(f"tls/127.0.0.1:{port}", shown(late)), "as long as it is valid"
    expired(late, "main")
    assert not opened(f"tls/127.0.0.1:{port}", shown(late))


def shown(folder: Path) -> dict:
    """The settings of Zenoh's of who shows the certificate of the main machine."""
    return {
        "transport/link/tls/root_ca_certificate": f"{folder}/ca.pem",
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/connect_certificate": f"{folder}/main.pem",
        "transport/link/tls/connect_private_key": f"{folder}/main.key",
    }


def opened(endpoint: str, settings: dict) -> bool:
    """Whether somebody with these settings of Zenoh's is let in there."""
    command = [sys.executable, NODES / "open_session.py", endpoint, json.dumps(settings)]
    code = subprocess.run(command, capture_output=True, timeout=PATIENCE_S).returncode
    assert code in {0, 7}
    return code == 0


@pytest.mark.parametrize("change", ["expired", "missing", "open", "other-key", "other-name", "other-host"])
def test_untrusted_certificate_is_an_error_before_start(
    project: Path, two: str, monkeypatch, capsys, change: str, expired: Callable, golden: Golden
):
    monkeypatch.chdir(project)
    text = two.split("network:", maxsplit=1)[0] + "network: {ca: certs/ca.pem}\n" + two[two.index("processes:") :]
    Path("run.yaml").write_text(f"plugins: [{NODES}]\n{text}")
    folder = project / "certs"
    authority = Authority.new(folder)
    authority.add("arm", addresses=[] if change == "other-host" else ["127.0.0.1"])
    authority.add("head", addresses=["127.0.0.1"])
    cert, key = folder / "arm.pem", folder / "arm.key"
    match change:
        case "expired":
            expired(folder, "arm")
        case "missing":
            cert.unlink()
        case "open":
            key.chmod(0o644)
        case "other-key":
            key.write_bytes((folder / "head.key").read_bytes())
        case "other-name":
            cert.write_bytes((folder / "head.pem").read_bytes())
            key.write_bytes((folder / "head.key").read_bytes())
        case _:
            pass
    assert main(["run", "run.yaml", "--machine", "arm"]) == 2
    golden(capsys.readouterr().err)


@pytest.mark.long
def test_three_machines_are_linked_each_to_each(start: Callable, certificates: Path, port: int, tmp_path: Path):
    text = f"""
machines:
  arm: {{connect: tls/127.0.0.1:{port}}}
  head: {{connect: tls/127.0.0.1:{free_port()}}}
network: {{ca: {certificates}/ca.pem, allow: {{viewer: all}}}}
processes: {{side: {{machine: arm}}}}
nodes:
  source: {{plugin: source, machine: head, parameters: {{rate_hz: 20}}}}
  sink: {{plugin: sink, machine: arm, parameters: {{enough: 40}}, subscriptions: {{numbers: {{depth: 1000}}}}}}
  here: {{plugin: sink, parameters: {{enough: 40}}, subscriptions: {{numbers: {{depth: 1000}}}}}}
  words: {{plugin: sink, remap: {{numbers: words}}, parameters: {{enough: 3}}}}
  arm_words: {{plugin: sink, machine: arm, remap: {{numbers: words}}, parameters: {{enough: 3}}}}
  side_words: {{plugin: sink, process: side, remap: {{numbers: words}}, parameters: {{enough: 3}}}}
  busy: {{plugin: "faulty:Busy", process: side}}
"""
    runs = {name: start(text, "--watchdog", "off", machine=name) for name in ("main", "arm", "head")}
    for own, run in runs.items():
        for name in runs.keys() - {own}:
            run.wait_for(f"the machine {name} is linked")
    for name in ("main", "arm"):
        runs[name].wait_for("received enough")
    one_message_reaches_every_process_of_every_machine(runs, tmp_path)
    # While the third machine joins, Zenoh chooses its ways between them anew, and may lose what is on them.
    (at_start,) = json.loads(busflow(runs["arm"].runtime, "topic", "stats", "numbers", "--json"))["topics"]
    assert runs["main"].end() == 130
    runs["arm"].wait_for("the machine main is not linked any more")
    busflow(runs["arm"].runtime, "topic", "echo", "numbers", "--once")
    assert runs["arm"].end() == runs["head"].end() == 130
    lost = Counter[str]()
    for name in ("main", "arm"):
        topic = runs[name].topic("/numbers")
        lost.update(topic["losses"])
        (line,) = topic["subscriptions"]
        assert topic["published"] == line["published"] == line["delivered"] + line["queued"], "nothing comes twice"
    assert lost == at_start["losses"], "nothing is missed when a machine leaves"


def one_message_reaches_every_process_of_every_machine(runs: dict[str, Run], folder: Path):
    """From a terminal of a machine with their nodes, of another machine, and of a machine that only looks."""
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    for number, where in enumerate((runs["main"].runtime, runs["head"].runtime, elsewhere), 1):
        run = ("--run", f"viewer@{folder}/run.yaml") if where == elsewhere else ()
        busflow(where, "topic", "pub", "-1", "-w", "3", "words", "std_msgs/msg/Int64", f"{{data: {number}}}", *run)
    for machine, node in (("main", "words"), ("arm", "arm_words"), ("arm", "side_words")):
        runs[machine].wait_for("received enough", f'"/{node}"')
