"""What the build has described are the classes."""

import json
from pathlib import Path

import pytest

from busflow.errors import UnknownType
from busflow.interfaces.encoding.builtin_types import builtin_types, fingerprint, read
from busflow.interfaces.encoding.typesupport import describe
from busflow.interfaces.message import find_type

TYPES = builtin_types()


@pytest.mark.parametrize("name", TYPES.messages)
def test_a_message_read_from_source_equals_its_class(name: str):
    assert TYPES.description(name) == describe(find_type(name))


@pytest.mark.parametrize("name", TYPES.services)
@pytest.mark.parametrize("part", ["Request", "Response"])
def test_so_are_the_two_halves_of_a_service(name: str, part: str):
    assert TYPES.description(f"{name}_{part}") == describe(getattr(find_type(name), part))


def test_names_are_of_messages_services_and_actions():
    assert {"sensor_msgs/msg/Imu", "std_srvs/srv/Trigger", "example_interfaces/action/Fibonacci"} <= {*TYPES.names}
    assert "sensor_msgs/msg/Imu" in TYPES
    assert "sensor_msgs/msg/Imuu" not in TYPES


def test_comments_are_those_of_the_source(golden):
    imu = TYPES.comments("sensor_msgs/msg/Imu")
    golden("\n".join([imu.text, imu.fields["orientation"], TYPES.comments("std_srvs/srv/SetBool").text]))


@pytest.mark.parametrize("installed", [True, False])
def test_missing_or_outdated_description_says_what_to_install(golden, tmp_path: Path, installed: bool):
    file, sources = tmp_path / "a/b/c/types.json", tmp_path / "msgs"
    file.parent.mkdir(parents=True)
    sources.mkdir()
    if installed:
        (tmp_path / "pyproject.toml").write_text("")
    (sources / "one.py").write_text("x = 1")
    with golden.raises(UnknownType):
        read(file, sources)
    file.write_text(json.dumps({"sources": fingerprint(sources)}))
    assert read(file, sources) == {"sources": fingerprint(sources)}
    (sources / "one.py").write_text("x = 2")
    with golden.raises(UnknownType):
        read(file, sources)
