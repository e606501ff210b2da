"""Folders of definition files: those that a command line names come first, then those of a sourced ROS 2."""

import os

import pytest

from busflow.definitions.folders import found_folders, library, name_folders, named_folders
from tests.definitions.test_library import write


@pytest.fixture
def nothing_named():
    yield
    name_folders([])


@pytest.mark.usefixtures("nothing_named")
def test_named_folder_gives_its_types(tmp_path):
    write(tmp_path, {"grip_msgs/msg/Grip.msg": "float64 force\n"})
    assert library().owner("grip_msgs/msg/Grip") is None
    name_folders([tmp_path])
    assert named_folders() == [tmp_path]
    assert library().owner("grip_msgs/msg/Grip") == "grip_msgs/msg/Grip"


def test_folders_of_a_sourced_ros_2_are_found(tmp_path, monkeypatch):
    monkeypatch.setenv("AMENT_PREFIX_PATH", os.pathsep.join([str(tmp_path / "a"), "", str(tmp_path / "b")]))
    assert found_folders()[-2:] == [tmp_path / "a/share", tmp_path / "b/share"]
