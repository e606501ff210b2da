"""Where a run can be found: who may have a directory, when it counts as living, and what is left of a dead one."""

import errno
import json
import multiprocessing
import os
import signal
import stat
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from busflow.errors import InspectionUnavailable, NoSuchRun
from busflow.wire.zenoh import run_directory
from busflow.wire.zenoh.run_directory import FoundRun, RunCard, RunDirectory, find_run, runs
from busflow.wire.zenoh.session import SOCKET
from tests.wire.conftest import NODES


@contextmanager
def folder_of_runs(path: Path) -> Iterator[Path]:
    """A folder for runs, whose path is short enough for a socket."""
    path.mkdir(mode=0o700)
    yield path
    subprocess.run(["rm", "-rf", str(path)], check=True)


@pytest.fixture
def home(runtime_folder: Path) -> Iterator[dict[str, str]]:
    with folder_of_runs(runtime_folder / "home") as folder:
        yield {"BUSFLOW_RUNTIME_DIR": str(folder)}


def card(name="lab1", **words) -> RunCard:
    return RunCard(**{"name": name, "pid": os.getpid(), "since_ns": 1, "file": "/robot/lab1.yaml"} | words)


def test_only_processes_that_inherit_a_directory_are_inside(home):
    directory = RunDirectory.claim("lab1", home)
    command = [sys.executable, "-c", f"import os; print(os.path.exists('{directory.inside}/run.lock'))"]
    for inherited, found in (((), "False\n"), ((directory.descriptor,), "True\n")):
        assert subprocess.run(command, pass_fds=inherited, capture_output=True, text=True).stdout == found
    directory.close()


def claimed(name, home, **words) -> RunDirectory:
    directory = RunDirectory.claim(name, home)
    directory.write_card(card(directory.path.name, **words))
    return directory


@contextmanager
def process(name, home):
    """Another process that has a run of this name, and the name that it got."""
    command = [sys.executable, NODES / "claim_run.py", name]
    running = subprocess.Popen(command, env=os.environ | home, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        yield running, Path(running.stdout.readline().strip()).name
    finally:
        running.kill()
        running.communicate()


def names(home):
    return [run.name for run in runs(home)]


def left(home):
    return sorted(path.name for path in Path(home["BUSFLOW_RUNTIME_DIR"]).iterdir() if path.name != ".lock")


def test_a_run_is_found_from_card_to_close(home):
    directory = RunDirectory.claim("lab1", home)
    assert runs(home) == []
    directory.write_card(card())
    assert runs(home) == [FoundRun(directory.path, card())]
    assert find_run(None, home).name == find_run("lab1", home).name == "lab1"
    directory.close()
    assert (runs(home), left(home)) == ([], [])


def test_a_second_run_of_a_name_is_numbered(home):
    first, second, third = (claimed("lab1", home, since_ns=number) for number in range(3))
    assert names(home) == ["lab1", "lab1-2", "lab1-3"]
    second.close()
    again = claimed("lab1", home)
    assert again.path.name == "lab1-2"
    for each in (first, third, again):
        each.close()
    assert left(home) == []


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("my run", "my_run"),
        ("../../etc", "_._.._etc"),
        (".hidden", "_hidden"),
        ("", "run"),
        ("a?b#c\x1b", "a_b_c_"),
        ("ü" * 100, "_" * 40),
        ("x" * 100, "x" * 40),
    ],
)
def test_a_run_name_becomes_a_safe_file_name(home, name, expected):
    directory = RunDirectory.claim(name, home)
    assert directory.path.name == expected
    directory.close()


def test_a_killed_runs_directory_is_removed(home):
    with process("lab1", home) as (running, name):
        assert name == "lab1"
        assert names(home) == ["lab1"]
        (find_run("lab1", home).directory / SOCKET).touch()
        running.kill()
        running.wait()
    assert left(home) == ["lab1"]
    assert names(home) == []
    assert left(home) == []
    claimed("lab1", home).close()


def test_run_that_closes_is_not_found(home):
    directory = claimed("lab1", home)
    found = find_run("lab1", home)
    with directory.ending():
        assert (names(home), found in runs(home)) == ([], False)
        next_one = RunDirectory.claim("lab1", home)
        assert next_one.path.name == "lab1-2", "it still holds its directory"
    next_one.close()
    assert left(home) == []


def test_a_dead_runs_directory_is_reused(home):
    with process("lab1", home) as (running, _):
        (Path(home["BUSFLOW_RUNTIME_DIR"]) / "lab1" / SOCKET).touch()
        running.kill()
        running.wait()
    directory = RunDirectory.claim("lab1", home)
    assert (directory.path.name, [each.name for each in directory.path.iterdir()]) == ("lab1", ["run.lock"])
    directory.close()


def test_what_is_half_made_or_half_removed_goes(home):
    folder = Path(home["BUSFLOW_RUNTIME_DIR"])
    (folder / "lab1").mkdir()
    (folder / ".lab1.77").mkdir()
    (folder / ".lab1.77" / SOCKET).touch()
    (folder / ".new").mkdir()
    (folder / "a file").touch()
    assert names(home) == []
    assert left(home) == ["a file"]


def test_concurrent_claims_get_distinct_names(home):
    count = 4
    with multiprocessing.get_context("spawn").Pool(count) as pool:
        got = pool.starmap(_claim_often, [("lab1", home)] * count)
    assert [each for many in got for each in many if not each.startswith("lab1")] == []
    assert (runs(home), left(home)) == ([], [])


def _claim_often(name, home):
    """Claim, be found by oneself and no stranger, and close, many times."""
    got = []
    for _ in range(25):
        directory = claimed(name, home)
        own = directory.path.name
        assert own in names(home)
        assert (directory.path / "run.lock").exists(), "somebody removed the directory of a living run"
        assert json.loads((directory.path / "run.json").read_text())["name"] == own
        directory.close()
        got.append(own)
    return got


def test_a_forked_child_keeps_no_run_alive(home):
    code = (
        "import os, sys, time\n"
        "from busflow.wire.zenoh.run_directory import RunCard, RunDirectory\n"
        "directory = RunDirectory.claim('lab1')\n"
        "directory.write_card(RunCard('lab1', 1, 1))\n"
        "if os.fork() == 0:\n"
        "    print(os.getpid(), flush=True)\n"
        "    time.sleep(60)\n"
        "    os._exit(0)\n"
        "time.sleep(60)\n"
    )
    running = subprocess.Popen([sys.executable, "-c", code], env=os.environ | home, stdout=subprocess.PIPE, text=True)
    child = int(running.stdout.readline())
    try:
        assert names(home) == ["lab1"]
        running.kill()
        running.wait()
        assert names(home) == []
    finally:
        os.kill(child, signal.SIGKILL)
        running.communicate()


# Who may open it.


@pytest.mark.parametrize("umask", [0, 0o077])
def test_a_run_directory_is_private_under_any_umask(home, umask):
    Path(home["BUSFLOW_RUNTIME_DIR"]).rmdir()
    before = os.umask(umask)
    try:
        directory = RunDirectory.claim("lab1", home)
        directory.write_card(card())
    finally:
        os.umask(before)
    for path in (directory.path, directory.path.parent):
        assert stat.S_IMODE(path.stat().st_mode) == 0o700
    assert names(home) == ["lab1"]
    directory.close()


def opened_to_others(folder, _elsewhere):
    folder.chmod(0o755)


def linked(folder, elsewhere):
    folder.rmdir()
    folder.symlink_to(elsewhere)


def linked_to_nowhere(folder, elsewhere):
    linked(folder, elsewhere / "nowhere")


def given_away(folder, _elsewhere):
    os.chown(folder, 12345, 12345)


ROOT = pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a directory away")


@pytest.mark.parametrize(
    ("change", "value"),
    [
        (opened_to_others, "mode 0755.*chmod 700"),
        (linked, "symbolic link"),
        (linked_to_nowhere, "symbolic link"),
        pytest.param(given_away, "another user", marks=ROOT),
    ],
)
def test_a_folder_that_others_could_change_is_refused(home, tmp_path, change, value):
    change(Path(home["BUSFLOW_RUNTIME_DIR"]), tmp_path)
    with pytest.raises(InspectionUnavailable, match=value):
        RunDirectory.claim("lab1", home)
    if change is not linked_to_nowhere:
        with pytest.raises(InspectionUnavailable, match=value):
            runs(home)


def test_a_linked_run_directory_is_not_followed(home, tmp_path):
    (tmp_path / "precious").touch()
    link = Path(home["BUSFLOW_RUNTIME_DIR"]) / "lab1"
    link.symlink_to(tmp_path)
    assert runs(home) == []
    directory = claimed("lab1", home)
    assert (directory.path.name, names(home)) == ("lab1-2", ["lab1-2"])
    directory.close()
    assert (tmp_path / "precious").exists()
    assert link.is_symlink()


# Where it is.


def folders(environment, **search):
    return [str(each) for each in run_directory._folders(environment, **search)]


def test_without_xdg_the_folder_is_in_tmp():
    shared = f"/tmp/busflow-{os.geteuid()}"  # noqa: S108  # what is tested; nothing is made there
    assert folders({}) == [shared]
    assert folders({"XDG_RUNTIME_DIR": "relative"}) == [shared]
    assert folders({"XDG_RUNTIME_DIR": "/run/user/7"}) == ["/run/user/7/busflow", shared]


def test_one_looks_where_runs_of_other_sessions_are():
    session = f"/run/user/{os.geteuid()}/busflow"
    assert folders({}, search=True)[0] == session
    assert folders({"XDG_RUNTIME_DIR": "/run/user/7"}, search=True)[:2] == ["/run/user/7/busflow", session]


@pytest.mark.parametrize("runtime", ["/" + "x" * 100, "/run/a?b", "/run/a#b"])
def test_a_too_long_runtime_directory_is_skipped(runtime):
    assert folders({"XDG_RUNTIME_DIR": runtime}) == folders({})


@pytest.mark.parametrize("stated", ["/" + "x" * 100, "/run/a?b"])
def test_one_that_is_stated_must_do(stated):
    with pytest.raises(InspectionUnavailable, match="BUSFLOW_RUNTIME_DIR"):
        RunDirectory.claim("lab1", {"BUSFLOW_RUNTIME_DIR": stated})


def test_a_deep_folder_shortens_the_run_name(home):
    deep = Path(home["BUSFLOW_RUNTIME_DIR"]) / ("d" * (72 - len(home["BUSFLOW_RUNTIME_DIR"])))
    directory = RunDirectory.claim("x" * 100, {"BUSFLOW_RUNTIME_DIR": str(deep)})
    assert 8 <= len(directory.path.name) < 20
    assert len(str(directory.path / SOCKET)) < 100
    directory.close()


def test_an_unusable_folder_falls_back_to_the_next(monkeypatch, home):
    shared = Path(home["BUSFLOW_RUNTIME_DIR"])
    monkeypatch.setattr(run_directory, "_folders", lambda *_args, **_search: [Path("/nowhere/busflow"), shared])
    directory = RunDirectory.claim("lab1", {})
    assert directory.path.parent == shared
    directory.close()
    monkeypatch.setattr(run_directory, "_folders", lambda *_args, **_search: [Path("/nowhere/busflow")])
    with pytest.raises(InspectionUnavailable, match=os.strerror(errno.ENOENT)):
        RunDirectory.claim("lab1", {})


def test_folder_of_another_user_hides_no_run(home, tmp_path, monkeypatch):
    (tmp_path / "theirs").mkdir(mode=0o755)
    folders = [Path(home["BUSFLOW_RUNTIME_DIR"]), tmp_path / "theirs"]
    monkeypatch.setattr(run_directory, "_folders", lambda *_args, **_search: folders)
    directory = claimed("lab1", {})
    assert names({}) == ["lab1"]
    directory.close()
    with pytest.raises(InspectionUnavailable, match="theirs"):
        runs({})


# What it says of itself.


@pytest.mark.parametrize(
    "text",
    [
        "",
        "null",
        "[]",
        "[" * 60_000,
        '{"a":' * 10_000,
        '{"name": "x"}',
        '{"name": "x", "pid": "1", "since_ns": 1}',
        '{"name": "x", "pid": 1, "since_ns": 1e400}',
        '{"name": "x", "pid": true, "since_ns": 1}',
        '{"name": "x", "pid": -1, "since_ns": 1}',
        '{"name": "x", "pid": 1, "since_ns": ' + "9" * 30 + "}",
        '{"name": ["x"], "pid": 1, "since_ns": 1}',
        '{"name": "x", "pid": 1, "since_ns": 1, "packages": ["/etc"]}',
        '{"name": "' + "x" * 100_000 + '", "pid": 1, "since_ns": 1}',
        "\ud800".encode("utf-16", "surrogatepass"),
    ],
)
def test_a_run_with_an_invalid_card_is_omitted(home, text):
    good, bad = claimed("good", home), RunDirectory.claim("bad", home)
    (bad.path / "run.json").write_bytes(text if isinstance(text, bytes) else text.encode())
    assert names(home) == ["good"]
    assert bad.path.exists(), "it lives all the same"
    good.close()
    bad.close()


def test_card_names_packages_and_may_have_unknown_keys(home):
    directory = claimed("lab1", home)
    (directory.path / "run.json").write_text('{"name": "lab1", "pid": 7, "since_ns": 8, "mood": "fine"}')
    assert runs(home)[0].card == RunCard("lab1", 7, 8)
    directory.write_card(card(packages={"lab": "/home/you/lab"}))
    assert runs(home)[0].card.packages == {"lab": "/home/you/lab"}
    directory.close()


@pytest.fixture
def two_folders(runtime_folder: Path, home: dict[str, str]) -> Iterator[list[Path]]:
    with folder_of_runs(runtime_folder / "other") as other:
        yield [Path(home["BUSFLOW_RUNTIME_DIR"]), other]


def test_runs_alike_in_two_folders_are_distinguished(two_folders, monkeypatch):
    monkeypatch.setattr(run_directory, "_folders", lambda *_args, **_search: two_folders)
    first = claimed("lab1", {})
    alone = find_run("lab1", {})
    two_folders.reverse()
    second = claimed("lab1", {}, pid=7, since_ns=2)
    assert names({}) == [str(first.path), str(second.path)]
    with pytest.raises(NoSuchRun, match=rf"2 .*'lab1'.*--run {first.path} .*\| {second.path} .*7"):
        find_run("lab1", {})
    assert find_run(str(second.path), {}).directory == second.path
    assert alone in runs({})
    first.close()
    assert find_run("lab1", {}).name == "lab1"
    assert find_run(str(second.path), {}).card.pid == 7
    second.close()


def test_error_lists_the_living_runs(home):
    with pytest.raises(NoSuchRun):
        find_run(None, home)
    first, second = claimed("lab1", home), claimed("arm", home, since_ns=2)
    with pytest.raises(NoSuchRun, match=r"2 .*--run lab1 \| arm\n"):
        find_run(None, home)
    with pytest.raises(NoSuchRun, match=r"'lab'.*'lab1'"):
        find_run("lab", home)
    assert NoSuchRun.exit_code == 4
    first.close()
    second.close()


def test_removed_directory_is_closed_without_error(home):
    directory = claimed("lab1", home)
    subprocess.run(["rm", "-r", str(directory.path)], check=True)
    directory.close()
    assert left(home) == []
