"""What a file's text tells of its node classes, without importing it."""

import gc
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from busflow.node.plugin_outline import UNREADABLE, Outline, files_with_nodes


def written(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def outline(folder: Path, name: str) -> dict[str, str]:
    return {each.name: each.summary for each in Outline().of_plugin(folder / name)}


CAMERA = "from busflow import Node\nclass Camera(Node):\n    '''Sees.\n\n    More.'''\nraise SystemExit\n"


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (CAMERA, {"Camera": "Sees."}),
        ("'''The file.'''\nimport busflow as b\nclass Left(b.Node): ...\nclass Right(Left): ...", ["Left", "Right"]),
        ("from busflow.node.node import Node as N\nclass A(object, N): ...", {"A": ""}),
        ("from lab import CameraNode\nclass Mine(CameraNode): ...", {"Mine": ""}),
        ("from .camera import Camera as Raw\nclass Straight(Raw): ...", {"Straight": ""}),
        ("from . import camera\nclass Straight(camera.Camera): ...", {"Straight": ""}),
        ("from . import parts, absent as b\nclass Straight(parts.Camera, b.C): ...", {}),
        ("from .camera import *\nclass Straight(Camera): ...", {"Straight": ""}),
        ("from .parts.lens import Lens\nclass Zoom(Lens): ...", {"Zoom": ""}),
        ("if True:\n    from busflow import Node\nclass A(Node): ...", {"A": ""}),
        ("from .camera import Camera", {}),
        ("from .missing import Camera\nclass A(Camera): ...", {}),
        ("class Node: ...\nclass A(Node): ...", {}),
        ("def make():\n    from busflow import Node\n    class A(Node): ...", {}),
        ("class A(make()): ...", {}),
        ("", {}),
    ],
)
def test_a_node_is_a_subclass_of_one(tmp_path: Path, text: str, found: object):
    folder = written(tmp_path, {"camera.py": CAMERA, "parts/lens.py": CAMERA.replace("Camera", "Lens"), "x.py": text})
    assert outline(folder, "x.py") == (dict.fromkeys(found, "The file.") if isinstance(found, list) else found)


@pytest.mark.parametrize(
    ("files", "found"),
    [
        ({"eye/__init__.py": "from .iris import *", "eye/iris.py": CAMERA, "eye/other.py": CAMERA}, ["Camera"]),
        ({"eye/__init__.py": CAMERA, "eye/iris.py": CAMERA.replace("Camera", "Iris")}, ["Camera"]),
        ({"eye/__init__.py": "", "eye/iris.py": CAMERA}, ["Camera"]),
        ({"eye/a.py": CAMERA, "eye/b.py": CAMERA.replace("Camera", "Iris")}, ["Camera", "Iris"]),
        ({"eye/__init__.py": "from ..camera import Camera", "camera.py": CAMERA}, []),
        ({"eye/notes.txt": ""}, []),
    ],
)
def test_a_package_offers_its_inits_or_files_classes(tmp_path: Path, files: dict[str, str], found: list[str]):
    assert list(outline(written(tmp_path, files), "eye")) == found


def test_circular_imports_end(tmp_path: Path):
    circle = "from .{0} import {1}\nfrom busflow import Node\nclass {2}(Node): ..."
    folder = written(tmp_path, {"a.py": circle.format("b", "B", "A"), "b.py": circle.format("a", "A", "B")})
    assert list(outline(folder, "a.py")) == ["A"]


@pytest.mark.parametrize("text", [b"class (", b"x = '\x00'", b"\xff\xfe", b"(" * 100_000, b"# coding: nonsense\n"])
def test_what_is_not_python_is_refused(tmp_path: Path, text: bytes):
    written(tmp_path, {"eye/iris.py": CAMERA, "eye/lens.py": ""})
    (tmp_path / "eye/bad.py").write_bytes(text)
    with pytest.raises(UNREADABLE):
        Outline().of_plugin(tmp_path / "eye/bad.py")
    assert [path.stem for path in files_with_nodes(tmp_path / "eye")] == ["bad", "iris"]


def test_a_warning_in_the_file_is_not_printed(tmp_path: Path):
    assert outline(written(tmp_path, {"x.py": CAMERA + "pattern = '\\d'\n"}), "x.py") == {"Camera": "Sees."}


def test_files_are_read_in_several_threads(tmp_path: Path):
    """The collector's callback lets another thread go on in the midst of parsing, as a full processor does at times."""
    file = written(tmp_path, {"x.py": CAMERA + "class Part: ...\n" * 300}) / "x.py"
    callback = lambda *_: None  # noqa: E731  # Python code, in which threads take turns
    threshold, interval = gc.get_threshold(), sys.getswitchinterval()
    gc.callbacks.append(callback)
    gc.set_threshold(50)
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(2) as threads:
            found = list(threads.map(lambda _: list(Outline().of_file(file)), range(40)))
    finally:
        gc.callbacks.remove(callback)
        gc.set_threshold(*threshold)
        sys.setswitchinterval(interval)
    assert found == [found[0]] * 40
