"""`busflow ui`, through the command itself: a page speaks with it while the project's lab runs.

Of `access.py`, `bridge_source.py`, `certificate.py`, `command.py`, `files.py`, `recording_source.py`, `run_source.py`
and `server.py`; and of the questions that need a run.
"""

import http.client
import json
import re
import signal
import ssl
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import urlsplit

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from busflow.cli import main
from busflow.errors import InvalidInput
from busflow.recording.bag import Bag
from busflow_ui.page_server.access import Access, PageAdmission, Tokens
from busflow_ui.page_server.certificate import tls
from busflow_ui.page_server.files import PageFiles, page_folder
from tests.cli.test_cli import HEAVY, in_one_process
from tests.golden import Golden

PATIENCE_S = 60.0
PAGE = Path(__file__).parents[2] / "page"
EVERYWHERE = ("--host", "0.0.0.0")  # noqa: S104  # the command wants a certificate for it


@pytest.fixture(scope="module")
def serving(show: Any, lab1: Any) -> Any:
    return show("--allow-origin", "http://panel.lab:8080", environment=lab1[0].environment)


@pytest.fixture
def shown(serving: Any) -> Iterator[Any]:
    """The lab is shown; the test's pages go with it."""
    with serving.pages:
        yield serving


@pytest.fixture(scope="module")
def own_lab(show: Any, lab_folder: Path) -> Iterator[tuple[Any, Any]]:
    """A lab whose launch file may change, and what shows it."""
    from tests.cli.conftest import Place

    place = Place(lab_folder)
    run = place.run(lab_folder, "lab1.yaml")
    run.wait_for("All sensors operational")
    yield show(environment=place.environment, folder=lab_folder), run
    run.stop()


def get(url: str, **headers: str) -> tuple[int, Any, bytes]:
    address = urlsplit(url)
    connection = http.client.HTTPConnection(address.netloc, timeout=PATIENCE_S)
    with closing(connection):
        connection.request("GET", url.removeprefix(f"http://{address.netloc}"), headers=headers)
        response = connection.getresponse()
        return response.status, response.headers, response.read()


# The command.


def test_its_help_imports_nothing_heavy():
    done = in_one_process("ui --help", heavy=(*HEAVY, "zenoh", "websockets", "ssl"))
    assert done.stderr == "busflow ui --help: exit code 0, imported []\n"
    assert "--read-only" in done.stdout


@pytest.mark.parametrize(
    "arguments",
    [
        EVERYWHERE,
        (*EVERYWHERE, "--control"),
        ("--read-only", "--control"),
        ("--certificate", __file__),
        ("--certificate", __file__, "--key", __file__, "--run", "x"),
        ("--run", "x", "--bridge", "ws://x"),
        ("--bridge", "http://x"),
        ("--bridge", "ws://127.0.0.1:1"),
        (__file__,),
    ],
)
@pytest.mark.usefixtures("place", "built_page")
def test_what_cannot_be_shown_is_one_error(
    arguments: tuple[str, ...], capsys: pytest.CaptureFixture[str], golden: Golden
):
    assert main(["ui", "--port", "0", *arguments]) != 0
    out, err = capsys.readouterr()
    assert out == ""
    golden(err, mask={re.escape(__file__): "FILE", r"(cannot be reached|its key:).*": r"\1 …"})


# Who is let in.


def test_only_the_right_token_gives_rights():
    tokens = Tokens(read_only=False)
    assert tokens.access(tokens.own, is_foreign=False) is Access.CONTROL
    assert tokens.access(tokens.own, is_foreign=True) is Access.READ_ONLY
    assert tokens.access(tokens.foreign, is_foreign=False) is Access.READ_ONLY
    for wrong in ("", "x", tokens.own[:-1], f"{tokens.own} ", "\ud800"):
        assert tokens.access(wrong, is_foreign=False) is None
    assert Tokens(read_only=True).own != tokens.own
    looking = Tokens(read_only=True)
    assert looking.access(looking.own, is_foreign=False) is Access.READ_ONLY


def test_only_the_own_page_and_named_sites_connect():
    gate = PageAdmission("127.0.0.1", ["http://panel.lab:8080"])
    host = "127.0.0.1:8766"
    assert gate.refusal(host, f"http://{host}") is None
    assert gate.refusal("localhost:8766", "http://localhost:8766") is None
    assert gate.refusal(host, "http://panel.lab:8080") is None
    assert gate.refusal(host, None) is None
    for origin in ("http://127.0.0.1:8080", "http://evil.example", "null", "http://[", "file://", f"ftp://{host}"):
        assert gate.refusal(host, origin) is not None
    assert gate.refusal("evil.example:8766", "http://evil.example:8766") is not None
    assert gate.is_foreign(host, "http://panel.lab:8080")
    assert not gate.is_foreign(host, f"http://{host}")


@pytest.mark.parametrize("first", [{"op": "busflow/hello", "token": "wrong"}, {"op": "subscribe", "subscriptions": []}])
def test_a_second_user_is_refused(shown: Any, first: dict[str, Any], golden: Golden):
    page = shown.page(token="wrong")  # noqa: S106  # a wrong one
    with pytest.raises(ConnectionClosed) as refused:
        page.receive()
    assert refused.value.rcvd is not None
    assert refused.value.rcvd.code == 4401
    golden(refused.value.rcvd.reason)
    address = f"{shown.url.replace('http', 'ws')}/ws"
    with connect(address, subprotocols=["foxglove.sdk.v1"]) as socket:  # type: ignore[list-item]  # text will do
        socket.send(json.dumps(first))
        with pytest.raises(ConnectionClosed):
            socket.recv(timeout=PATIENCE_S)


def test_a_page_of_another_site_is_refused(shown: Any):
    with pytest.raises(InvalidStatus) as refused:
        shown.page(origin="http://evil.example")
    assert refused.value.response.status_code == 403


def test_a_named_site_only_looks(shown: Any):
    found = re.search(r"token (\S+)", shown.process.stdout.readline())
    assert found
    for token in (found[1], shown.token):
        page = shown.page(origin="http://panel.lab:8080", token=token)
        page.until(lambda _, page=page: page.info)
        assert page.info["metadata"]["access"] == "read-only"
        assert "clientPublish" not in page.info["capabilities"]
        values = {"noise.imu": 0.2}
        assert "may only look" in page.ask("set_parameters", node="/sensor_publisher", values=values)["error"]
        page.send("setParameters", parameters=[{"name": "/sensor_publisher.noise.imu", "value": 0.2}])
        assert "may only look" in page.until(lambda found: found["op"] == "status")["message"]
        assert page.answer("graph")["nodes"]


# The files.


def test_every_answer_forbids_other_sources(shown: Any):
    for path in ("/", "/app.js", "/nothing"):
        status, headers, _ = get(f"{shown.url}{path}")
        assert status == (404 if path == "/nothing" else 200)
        policy = headers["Content-Security-Policy"]
        assert policy.startswith("default-src 'self'; img-src 'self' blob:; connect-src 'self'")
        assert "frame-ancestors 'none'" in policy
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert "Content-Security-Policy" in get(f"{shown.url}/ws")[1]
    assert get(f"{shown.url}/", Host="evil.example")[0] == 403
    assert get(f"{shown.url}/", Origin="http://evil.example")[0] == 403


def test_only_a_named_site_may_embed_panels(shown: Any):
    _, headers, _ = get(f"{shown.url}/components.js", Origin="http://panel.lab:8080")
    assert headers["Access-Control-Allow-Origin"] == "http://panel.lab:8080"
    assert headers["Cross-Origin-Resource-Policy"] == "cross-origin"
    assert get(f"{shown.url}/app.js", Origin="http://panel.lab:8080")[1]["Access-Control-Allow-Origin"] is None


@pytest.mark.parametrize(
    "path", ["/../server.py", "//etc/passwd", "/%2e%2e/server.py", "/./index.html", "/index.html/"]
)
def test_no_path_leaves_the_folder(shown: Any, path: str):
    import http.client

    connection = http.client.HTTPConnection(shown.url.removeprefix("http://"), timeout=PATIENCE_S)
    connection.putrequest("GET", path)
    connection.endheaders()
    assert connection.getresponse().status == 404
    connection.close()


def test_the_policy_ignores_a_strange_host(tmp_path: Path):
    (tmp_path / "index.html").write_text("x")
    (tmp_path / "secret.key").write_text("x")

    files: Any = PageFiles(tmp_path)
    request = SimpleNamespace(path="/", headers={"Host": "x; script-src *"})
    assert "script-src" not in files.headers(request)["Content-Security-Policy"]
    assert list(files._files) == ["/index.html"]


def test_only_files_named_by_content_are_kept(tmp_path: Path):
    for name in ("index.html", "chunk-5PWC7DDA.js"):
        (tmp_path / name).write_text("x")
    files: Any = PageFiles(tmp_path)

    def cached(path: str) -> str:
        return files.headers(SimpleNamespace(path=path, headers={}))["Cache-Control"]

    assert cached("/chunk-5PWC7DDA.js") == "max-age=31536000, immutable"
    assert cached("/index.html") == cached("/chunk-GONE.js") == "no-cache"


def test_every_bundled_package_has_its_licence(shown: Any):
    """The list that the build makes of what it bundled, held against the lock file."""
    licences = json.loads(get(f"{shown.url}/licences.json")[2])
    bundled = {each["name"]: each["version"] for each in licences}
    assert all(len(each["text"]) > 200 and each["licence"] for each in licences)
    locked = json.loads((PAGE / "package-lock.json").read_text("utf-8"))["packages"]
    needed = {
        place.removeprefix("node_modules/"): each["version"]
        for place, each in locked.items()
        if place and not each.get("dev") and not each.get("optional")
    }
    assert "preact" in bundled
    assert bundled.items() <= needed.items()


# What a page is answered.


def test_a_page_has_the_whole_run(shown: Any):
    page = shown.page()
    page.until(lambda _: "/imu/data" in page.channels)
    assert "busflow" in page.info["capabilities"]
    assert page.info["metadata"] | {"busflow": ""} == {
        "busflow": "",
        "run": "lab1",
        "source": "run",
        "access": "control",
    }
    page.subscribe("/imu/data")
    assert page.message()["payload"]
    graph = page.answer("graph")
    nodes = {each["name"]: each for each in graph["nodes"]}
    assert re.search(r"plugins/sensor_publisher\.py:\d+$", nodes["/sensor_publisher"]["source"])
    assert nodes["/sensor_publisher"]["state"] == "running"
    assert page.answer("run")["name"] == "lab1"
    findings = page.answer("health")["findings"]  # a busy machine warns, e.g. of late timers
    assert [each for each in findings if each["severity"] == "error"] == []
    assert page.answer("log")["lines"][0]["text"] == "All sensors operational"
    assert page.answer("log", count=1)["lines"]
    rows = {each["name"]: each for each in page.answer("parameters", node="/sensor_publisher")["parameters"]}
    assert rows["noise.imu"]["bounds"]["maximum"] == 10
    assert "error" in page.ask("parameters", node="/nothing")


def test_a_followed_graph_has_rates(shown: Any):
    page = shown.page()
    page.follow("graph")

    def has_rate(answer: Any) -> bool:
        """Whether it has the rate of the launch file, 10 Hz: a busy machine may hold the run up for a while."""
        return any(each["name"] == "/imu/data" and 6 <= (each["rate_hz"] or 0) <= 14 for each in answer["topics"])

    page.update("graph", has_rate)


def test_new_lines_of_the_log_follow(own_lab: tuple[Any, Any]):
    page = own_lab[0].page()
    page.follow("log")
    assert page.update("log")["lines"]
    page.answer("order", node="/sensor_processor", order="restart")
    assert page.update("log", lambda answer: answer["lines"])["lines"][0]["node"] == "/sensor_processor"


def test_parameters_are_set_or_refused_with_reasons(own_lab: tuple[Any, Any], golden: Golden):
    page = own_lab[0].page()
    node = "/sensor_publisher"
    refused = page.answer("set_parameters", node=node, values={"noise.imu": -3})
    assert refused["changed"] == []
    golden(refused["faults"][0]["message"])
    assert page.answer("set_parameters", node=node, values={"noise.imu": 0.5})["changed"][0]["new"] == 0.5
    (row,) = [r for r in page.answer("parameters", node=node)["parameters"] if r["name"] == "noise.imu"]
    assert (row["value"], row["file_value"]) == (0.5, 0.1)


def test_saved_parameters_are_shown_before(own_lab: tuple[Any, Any], lab_folder: Path):
    page = own_lab[0].page()
    page.answer("set_parameters", node="/sensor_publisher", values={"noise.imu": 0.75})
    before = (lab_folder / "lab1.yaml").read_text("utf-8")
    shown = page.answer("save_parameters", dry_run=True)
    assert "-        imu: 0.1" in shown["edit"]
    assert "+        imu: 0.75" in shown["edit"]
    assert not shown["saved"]
    assert (lab_folder / "lab1.yaml").read_text("utf-8") == before
    assert page.answer("save_parameters", nodes=["/sensor_publisher"], dry_run=False)["saved"]
    assert "        imu: 0.75" in (lab_folder / "lab1.yaml").read_text("utf-8")
    assert page.answer("save_parameters", dry_run=True)["edit"] == ""


def test_a_layout_is_kept_in_the_launch_file(own_lab: tuple[Any, Any], lab_folder: Path):
    page = own_lab[0].page()
    layout = {"panels": [{"kind": "plot", "series": ["imu/data.linear_acceleration.y"]}], "dark": True}
    assert "+x-ui:" in page.answer("save_layout", layout=layout, dry_run=True)["edit"]
    assert page.answer("layout") == {"layout": None}
    page.answer("save_layout", layout=layout, dry_run=False)
    assert page.answer("layout") == {"layout": layout}
    assert main(["check", str(lab_folder / "lab1.yaml")]) == 0
    assert "error" in page.ask("save_layout", layout={"x": "y" * 100_000}, dry_run=True)


def test_a_node_is_stopped_and_started(own_lab: tuple[Any, Any]):
    page = own_lab[0].page()
    assert page.answer("order", node="/sensor_processor", order="stop")["state"] == "stopped by hand"
    fixes = {each["code"]: each["fix"] for each in page.answer("health")["findings"]}
    assert fixes["node-stopped"] == "busflow node start sensor_processor"
    assert page.answer("order", node="/sensor_processor", order="start")["state"] == "running"
    assert page.answer("log_level", node="/sensor_processor", level="debug")["level"] == "debug"
    assert "did you mean" in page.ask("order", node="/sensor_processo", order="stop")["error"]


def test_the_record_button_writes_a_recording(own_lab: tuple[Any, Any]):
    page = own_lab[0].page()
    assert page.answer("record") == {"on": False}
    path = page.answer("record", on=True)["path"]
    page.follow("record")
    page.update("record", lambda answer: answer.get("messages", 0) > 20)
    assert page.answer("record", on=False)["missed"] == 0
    with Bag(path) as bag:
        assert bag.complete
        assert bag.messages > 20


# Its end, and the next one.


def test_a_hanging_run_is_reported(own_lab: tuple[Any, Any]):
    shown, run = own_lab
    page = shown.page()
    page.until(lambda _: page.info)
    run.process.send_signal(signal.SIGSTOP)
    page.update("run", lambda answer: answer.get("silent_s"))
    run.process.send_signal(signal.SIGCONT)
    page.update("run", lambda answer: "silent_s" not in answer)


def test_a_page_comes_back_with_the_next_run(own_lab: tuple[Any, Any], lab_folder: Path):
    from tests.cli.conftest import Place

    shown, run = own_lab
    page = shown.page()
    page.until(lambda _: page.info)
    session = page.info["sessionId"]
    run.process.kill()
    ended = page.update("run", lambda answer: "ended" in answer)
    assert ended["name"] == "lab1"
    assert ended["ended"]["was_killed"]
    with pytest.raises(ConnectionClosed) as closed:
        page.until(lambda _: False)
    assert closed.value.rcvd is not None
    assert " lab1 " in closed.value.rcvd.reason
    waiting = shown.page()
    assert waiting.update("run")["ended"]
    again = Place(lab_folder).run(lab_folder, "lab1.yaml")
    try:
        waiting.until(lambda _: waiting.info)
        assert waiting.info["sessionId"] != session
        assert waiting.answer("run")["name"] == "lab1"
    finally:
        again.stop()


def test_an_end_names_the_last_errors(show: Any):
    from tests.cli.conftest import LABS, standing

    with standing(LABS / "talk.yaml") as (place, run):
        run.wait_for("heard")
        page = show(environment=place.environment).page()
        page.subscribe("/numbers")
        page.message()
        page.answer("set_parameters", node="/talker", values={"fail_at": 1})
        ended = page.update("run", lambda answer: "ended" in answer)["ended"]
    assert not ended["was_killed"]
    assert ended["elapsed_s"] > 0
    (error,) = ended["errors"]
    assert "/talker: failed in Talker.talk (" in error
    assert "\x1b" not in error


def test_read_only_is_for_the_own_page_too(show: Any, lab1: Any):
    page = show("--read-only", environment=lab1[0].environment).page()
    assert "may only look" in page.ask("order", node="/sensor_publisher", order="stop")["error"]
    assert "may only look" in page.ask("record", on=True)["error"]
    assert page.info["metadata"]["access"] == "read-only"


# Recordings, and other servers.


def test_a_recording_is_shown(show: Any, lab_folder: Path, lab1: Any):
    command = [sys.executable, "-m", "busflow", "run", "lab1.yaml", "--sim", "--for", "5s", "--record", "a.mcap"]
    subprocess.run(command, cwd=lab_folder, check=True, capture_output=True)
    page = show("a.mcap", environment=lab1[0].environment, folder=lab_folder).page()
    span = page.answer("time")
    assert page.info["metadata"]["source"] == "recording"
    assert page.info["capabilities"] == ["time", "busflow"]
    page.subscribe("/imu/data")
    page.answer("seek", stamp_ns=span["end_ns"])
    assert page.message()["stamp_ns"] == int(span["end_ns"])
    assert page.answer("run")["name"] == "a"


@pytest.fixture
def foxglove_url() -> Iterator[str]:
    """A server of Foxglove's own, as ROS 2's bridge has it."""
    foxglove: Any = pytest.importorskip("foxglove")
    server = foxglove.start_server(
        port=0, capabilities=[foxglove.Capability.Parameters, foxglove.Capability.ClientPublish]
    )
    channel = foxglove.Channel("/hello", message_encoding="json", schema={"type": "object"})
    yield f"ws://127.0.0.1:{server.port}"
    channel.close()
    server.stop()


@pytest.mark.parametrize(("options", "access"), [((), "control"), (("--read-only",), "read-only")])
def test_a_foreign_bridge_is_shown(
    show: Callable[..., Any], lab1: Any, foxglove_url: str, options: tuple[str, ...], access: str
):
    page = show("--bridge", foxglove_url, *options, environment=lab1[0].environment).page()
    page.until(lambda _: "/hello" in page.channels)
    assert page.info["metadata"]["source"] == "bridge"
    assert page.info["metadata"]["access"] == access
    assert "busflow" not in page.info["capabilities"]
    assert ("clientPublish" in page.info["capabilities"]) == (access == "control")
    assert "error" in page.ask("graph")
    page.send("getParameters", parameterNames=[], id="p")
    page.send("setParameters", parameters=[{"name": "x", "value": 1}], id="q")
    if access == "read-only":
        assert "may only look" in page.until(lambda found: found["op"] == "status")["message"]


# Other machines.


def test_no_certificate_is_refused():
    with pytest.raises(InvalidInput) as caught:
        tls(Path(__file__), Path(__file__))
    assert caught.value.code == "certificate"


def test_missing_page_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("busflow_ui.page_server.files._PLACES", (tmp_path, tmp_path))
    with pytest.raises(InvalidInput) as caught:
        page_folder()
    assert caught.value.code == "no-page"


def certificate(folder: Path) -> tuple[Path, Path]:
    """A certificate of this machine's name, with its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "localhost")])
    now = datetime.now(tz=UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(now - timedelta(days=1))
        .not_valid_after(now + timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName([x509.DNSName("localhost")]), critical=False)
        .sign(key, hashes.SHA256())
    )
    pem = serialization.Encoding.PEM
    (folder / "a.crt").write_bytes(made.public_bytes(pem))
    plain = serialization.NoEncryption()
    (folder / "a.key").write_bytes(key.private_bytes(pem, serialization.PrivateFormat.PKCS8, plain))
    return folder / "a.crt", folder / "a.key"


def test_beyond_this_machine_pages_only_look_encrypted(show: Any, lab1: Any, tmp_path: Path):
    crt, key = certificate(tmp_path)
    options = (*EVERYWHERE, "--certificate", str(crt), "--key", str(key))
    for more, access in (((), "read-only"), (("--control",), "control")):
        shown = show(*options, *more, environment=lab1[0].environment)
        shown.url = shown.url.replace(f"https://{EVERYWHERE[1]}", "https://localhost")
        page = shown.page(ssl=ssl.create_default_context(cafile=str(crt)))
        page.until(lambda _, page=page: page.info)
        assert page.info["metadata"]["access"] == access
