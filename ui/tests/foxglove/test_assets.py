"""Files for viewers, out of the folders of `packages:` alone; and the humanoid, as a viewer sees it in 3D."""

import re
import struct
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from busflow.errors import NoSuchTarget
from busflow_ui.foxglove.assets import read_asset
from tests.cli.conftest import standing
from tests.golden import Golden
from ui.tests.foxglove.test_command import PATIENCE_S, Client, Served, serving

CONFIGS = Path(__file__).parents[3] / "configs"
HUMANOID = f"include: [{{file: {CONFIGS}/humanoid_3d.yaml, args: {{rate_hz: 20}}}}]\npackages: {{lab: meshes}}\n"
BODY = f"include: {CONFIGS}/lab_balance_3d.yaml\n"


@pytest.fixture
def packages(tmp_path: Path) -> dict[str, Path]:
    """A folder of a package, with things in and beside it that viewers must not get."""
    return {"lab": furnished(tmp_path)}


def furnished(folder: Path) -> Path:
    meshes = folder / "meshes"
    (meshes / "inner").mkdir(parents=True)
    (meshes / "inner/arm.STL").write_bytes(b"solid arm")
    (meshes / "key.pem").write_text("secret")
    (folder / "beside.stl").write_text("secret")
    (meshes / "out.stl").symlink_to("../beside.stl")
    (meshes / "key.stl").symlink_to("key.pem")
    return meshes


def test_mesh_is_read_whatever_its_case(packages: dict[str, Path]):
    assert read_asset("package://lab/inner/arm.STL", packages) == b"solid arm"


@pytest.mark.parametrize(
    "uri",
    [
        "package://lab/../beside.stl",
        "package://lab/out.stl",
        "package://lab/%2e%2e/beside.stl",
        "package://lab/key.pem",
        "package://lab/key.stl",
        "package://lab/inner",
        "package://lib/arm.stl",
        "file:///etc/passwd",
        "https://example.org/arm.stl",
    ],
)
def test_file_outside_of_named_packages_is_refused(packages: dict[str, Path], uri: str, golden: Golden):
    with golden.raises(NoSuchTarget) as refused:
        read_asset(uri, packages)
    assert str(packages["lab"].parent) not in str(refused.value)


def test_file_of_the_largest_size_is_sent(packages: dict[str, Path], golden: Golden):
    (packages["lab"] / "large.stl").write_bytes(b"x" * 1024)
    assert len(read_asset("package://lab/large.stl", packages, most_bytes=1024)) == 1024
    with golden.raises(NoSuchTarget):
        read_asset("package://lab/large.stl", packages, most_bytes=1023)


# A viewer of the humanoid.


def served(folder: Path, launch: str) -> Iterator[Served]:
    """A launch file with a package beside it, served."""
    furnished(folder)
    (folder / "lab.yaml").write_text(launch, "utf-8")
    with standing(folder / "lab.yaml") as (place, run):
        run.wait_for("All sensors operational")
        with serving(place) as found:
            yield found


@pytest.fixture(scope="module")
def served_humanoid(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """The humanoid that is a formula."""
    yield from served(tmp_path_factory.mktemp("humanoid"), HUMANOID)


@pytest.fixture(scope="module")
def served_body(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """The humanoid that obeys physics."""
    yield from served(tmp_path_factory.mktemp("body"), BODY)


@pytest.fixture
def viewer(served_humanoid: Served) -> Iterator[Client]:
    """A viewer that comes late."""
    with served_humanoid.clients:
        yield served_humanoid.client()


class Reader:
    """Decodes a channel's messages by the schema that it was announced with, as a viewer does."""

    def __init__(self, client: Client, topic: str, id_: int) -> None:
        self._client, self._id = client, id_
        client.subscribe(topic, id_)
        channel = client.channels[topic]
        self._type, self._store = channel["schemaName"], get_typestore(Stores.EMPTY)
        self._store.register(get_types_from_msg(channel["schema"], self._type))

    def read(self) -> Any:
        return self._store.deserialize_cdr(self._client.message(self._id)["payload"], self._type)


@pytest.mark.parametrize(
    ("run", "base", "links", "moving"), [("served_humanoid", "pelvis", 37, 31), ("served_body", "world", 14, 11)]
)
def test_late_viewer_sees_the_whole_robot_move(
    run: str, base: str, links: int, moving: int, request: pytest.FixtureRequest
):
    served: Served = request.getfixturevalue(run)
    with served.clients:
        viewer = served.client()
        description = Reader(viewer, "/robot_description", 1).read().data
        fixed = Reader(viewer, "/tf_static", 2).read().transforms
        moves = Reader(viewer, "/tf", 3)
        seen = [each for _ in range(40) for each in moves.read().transforms]
    named = set(re.findall(r'<link name="(\w+)"', description))
    assert len(named) == links
    parents = {each.child_frame_id: each.header.frame_id for each in (*fixed, *seen)}
    assert {root(link, parents) for link in named} == {base}
    turns = {(each.child_frame_id, turn(each)) for each in seen}
    assert len({link for link, _ in turns}) == moving
    assert min(Counter(link for link, _ in turns).values()) > 1  # each of them in several places


def root(link: str, parents: dict[str, str]) -> str:
    return root(parents[link], parents) if link in parents else link


def turn(transform: Any) -> tuple[float, ...]:
    rotation = transform.transform.rotation
    return rotation.x, rotation.y, rotation.z, rotation.w


def test_viewer_gets_meshes_and_nothing_else(viewer: Client, golden: Golden):
    assert "assets" in viewer.info["capabilities"]
    asked = ["lab/inner/arm.STL", "lab/../beside.stl", "lab/out.stl", "lab/key.pem", "lab/nothing.stl"]
    for number, path in enumerate(asked, 100):
        viewer.ask("fetchAsset", uri=f"package://{path}", requestId=number)
    answers = [fetched(viewer) for _ in asked]
    assert answers[0] == (100, 0, "", b"solid arm")
    assert [(number, status, content) for number, status, _, content in answers[1:]] == [
        (number, 1, b"") for number in range(101, 105)
    ]
    golden("\n".join(reason for *_, reason, _ in answers[1:]))


def fetched(client: Client) -> tuple[int, int, str, bytes]:
    """The next file that comes: its request, whether it failed, why, and the content."""
    while True:
        frame = client.socket.recv(timeout=PATIENCE_S)
        if isinstance(frame, bytes) and frame[0] == 4:
            _, request, status, length = struct.unpack_from("<BIBI", frame)
            return request, status, frame[10 : 10 + length].decode(), frame[10 + length :]


def test_run_without_packages_offers_no_files(lab1: Any, golden: Golden):
    with serving(lab1[0]) as served:
        client = served.client()
        assert "assets" not in client.info["capabilities"]
        client.ask("fetchAsset", uri="package://lab/arm.stl", requestId=1)
        request, status, reason, _ = fetched(client)
        assert (request, status) == (1, 1)
        golden(reason)
