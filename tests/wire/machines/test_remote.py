"""A run on other machines is joined with the certificate, rights and addresses that its launch file states."""

import re
import socket
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from busflow.errors import InspectionUnavailable, LaunchError, NoSuchRun, NotAllowed
from busflow.launchfile.model.network import Role
from busflow.wire.machines.certificates import Authority
from busflow.wire.machines.remote import RemoteRun, remote_run

NETWORK = """\
machines:
  arm: {connect: tls/127.0.0.1:7447}
network: {ca: certs/ca.pem, allow: {viewer: read, operator: all}}
nodes: {camera: {plugin: camera}}
"""


@pytest.fixture
def joined(tmp_path: Path) -> Callable[..., RemoteRun]:
    """Joins the run of a launch file as somebody with a certificate."""
    authority = Authority.new(tmp_path / "certs")
    for name in ("main", "arm", "viewer", "operator"):
        authority.add(name, addresses=["127.0.0.1"])

    def join(identity: str, text: str = NETWORK) -> RemoteRun:
        (tmp_path / "robot.yaml").write_text(text)
        return remote_run(f"{identity}@{tmp_path / 'robot.yaml'}")

    return join


def test_rights_are_those_of_the_file(joined: Callable[..., RemoteRun]):
    viewer, operator, machine = joined("viewer"), joined("operator"), joined("arm")
    assert (viewer.role, operator.role, machine.role) == (Role.READ, Role.ALL, Role.ALL)
    operator.require("set parameters")
    with pytest.raises(NotAllowed, match=re.escape("network: {allow: {viewer: all}}")):
        viewer.require("set parameters")


def test_the_identitys_files_lie_beside_the_authority(joined: Callable[..., RemoteRun], tmp_path: Path):
    found = joined("viewer").credentials
    assert found is not None
    assert (found.ca, found.cert, found.key) == tuple(
        tmp_path / "certs" / name for name in ("ca.pem", "viewer.pem", "viewer.key")
    )


def test_unencrypted_addresses_need_no_certificate(joined: Callable[..., RemoteRun], tmp_path: Path):
    (tmp_path / "certs" / "viewer.key").unlink()
    text = NETWORK.replace("tls/", "tcp/").replace("ca: certs/ca.pem, ", "")
    assert joined("viewer", text).credentials is None


def test_an_unknown_identity_gets_the_nearest_one(joined: Callable[..., RemoteRun]):
    with pytest.raises(NoSuchRun, match=r"'viewr'.*'viewer'"):
        joined("viewr")


def test_a_file_without_network_is_local(joined: Callable[..., RemoteRun]):
    with pytest.raises(NoSuchRun, match=r"robot.yaml"):
        joined("viewer", "nodes: {camera: {plugin: camera}}\n")


def test_a_file_without_address_is_refused(joined: Callable[..., RemoteRun]):
    text = NETWORK.replace("connect: tls/127.0.0.1:7447", "listen: tls/0.0.0.0:7447")
    with pytest.raises(NoSuchRun, match="connect"):
        joined("viewer", text)


def test_a_missing_key_is_refused(joined: Callable[..., RemoteRun], tmp_path: Path):
    (tmp_path / "certs" / "viewer.key").unlink()
    with pytest.raises(LaunchError, match=re.escape("viewer.key")):
        joined("viewer")


def test_an_unreadable_file_is_refused_with_its_problems(joined: Callable[..., RemoteRun]):
    with pytest.raises(LaunchError, match=re.escape("robot.yaml:1:1")):
        joined("viewer", "- no mapping\n")


def test_an_unreachable_run_says_why(joined: Callable[..., RemoteRun]):
    with closing(socket.socket()) as unused:
        unused.bind(("127.0.0.1", 0))
        port = unused.getsockname()[1]
        run = joined("viewer", NETWORK.replace("7447", str(port)))
        with pytest.raises(InspectionUnavailable, match=f"arm: .*tls/127.0.0.1:{port}"):
            run.open(0.2)


def test_an_answer_describes_the_run(joined: Callable[..., RemoteRun]):
    run = joined("viewer")
    card = {"name": "robot", "pid": 7, "since_ns": 8, "file": "robot.yaml", "version": "0.1"}
    assert run.answered([]).card.name == ""
    assert run.answered([{**card, "process": "main"}]).card.name == "robot"


def test_folders_of_another_machine_are_not_believed(joined: Callable[..., RemoteRun]):
    """They would be folders of this one, out of which `busflow foxglove` sends files."""
    card = {"name": "robot", "pid": 7, "since_ns": 8, "file": "robot.yaml", "version": "0.1"}
    assert joined("viewer").answered([card | {"packages": {"lab": "/etc"}}]).card.packages == {}
