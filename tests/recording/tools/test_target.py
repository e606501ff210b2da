"""What is made of a recording is there when it is whole or not at all, and takes nobody's place."""

import errno
import os

import pytest

from busflow.errors import BagError
from busflow.recording.tools.target import new_directory, new_file


@pytest.fixture
def no_links(monkeypatch):
    """As on a USB stick with FAT, whose kernel module says this."""

    def link(_source, _target):
        raise PermissionError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", link)


@pytest.mark.parametrize("new", [new_file, new_directory])
def test_what_fails_half_way_leaves_nothing(tmp_path, new, golden):
    with golden.raises(BagError), new(tmp_path / "out"):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("new", [new_file, new_directory])
def test_another_writers_part_is_left_alone(tmp_path, new, golden):
    with new(tmp_path / "out"):
        part = tmp_path / ".out.part"
        with golden.raises(BagError):
            new(tmp_path / "out").__enter__()
        assert part.exists()
    assert (tmp_path / "out").exists()


@pytest.mark.parametrize("links", [True, False])
def test_file_of_another_program_is_not_overwritten(tmp_path, links, request, golden):
    if not links:
        request.getfixturevalue("no_links")
    target = tmp_path / "out"

    def write():
        with new_file(target) as part:
            part.write_text("ours")
            target.write_text("theirs")

    with golden.raises(BagError):
        write()
    assert [each.read_text() for each in tmp_path.iterdir()] == ["theirs"]


@pytest.mark.usefixtures("no_links")
def test_a_file_is_renamed_where_links_are_missing(tmp_path):
    with new_file(tmp_path / "out") as part:
        part.write_text("whole")
    assert [(each.name, each.read_text()) for each in tmp_path.iterdir()] == [("out", "whole")]
