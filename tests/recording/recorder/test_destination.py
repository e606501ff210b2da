"""Where a recording goes: a new file, under a name that can be found."""

import errno
import os
import re
from pathlib import Path

import pytest

from busflow.errors import RecordingRefused
from busflow.recording.recorder.destination import Destination, named, new_recording


def test_a_file_that_is_there_is_not_overwritten(tmp_path, golden):
    path = tmp_path / "run.mcap"
    path.write_bytes(b"precious")
    with golden.raises(RecordingRefused):
        Destination(path)
    assert path.read_bytes() == b"precious"


def test_a_missing_folder_is_not_made_in_silence(tmp_path, golden):
    with golden.raises(RecordingRefused):
        Destination(tmp_path / "runs/run.mcap")


def test_the_advice_can_be_pasted_into_a_shell():
    with pytest.raises(RecordingRefused, match=r"mkdir -p '~/of a run'$"):
        Destination(Path("~/of a run/run.mcap"))


@pytest.mark.parametrize("name", ["", "."])
def test_a_file_without_a_name_is_none(name, golden):
    with golden.raises(RecordingRefused):
        Destination(Path(name))


def test_an_unwritable_folder_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingRefused, match=os.strerror(errno.ENOTDIR)):
        Destination(tmp_path / "file/run.mcap")


@pytest.mark.parametrize("name", ["run", "run.bag", "run.mcap.zst"])
def test_a_recording_is_called_mcap(tmp_path, name, golden):
    with golden.raises(RecordingRefused):
        Destination(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_file_name_may_hold_run_and_time():
    name = named("runs/{name}-{start}.mcap", run="lab1").as_posix()
    assert re.fullmatch(r"runs/lab1-\d{8}T\d{6}Z\.mcap", name)
    assert named("{name}.mcap", run="../../etc").as_posix() == ".._.._etc.mcap"


def test_a_placeholder_that_stands_for_nothing_is_refused(golden):
    with golden.raises(RecordingRefused):
        named("{seed}.mcap", run="lab1")


@pytest.mark.parametrize("loss", ["deleted", "moved", "replaced", "folder"])
def test_a_write_into_a_deleted_file_is_refused(tmp_path, loss, golden):
    folder = tmp_path / "runs"
    folder.mkdir()
    path = folder / "run.mcap"
    destination = Destination(path)
    assert destination.write(memoryview(b"one")) == 3
    match loss:
        case "deleted":
            path.unlink()
        case "moved":
            path.rename(folder / "other.mcap")
        case "replaced":
            path.rename(folder / "other.mcap")
            path.write_bytes(b"")
        case "folder":
            path.unlink()
            folder.rmdir()
    with golden.raises(OSError):
        destination.write(memoryview(b"two"))
    destination.close()


def test_a_partly_written_end_can_be_cut_off(tmp_path):
    destination = Destination(tmp_path / "run.mcap")
    destination.write(memoryview(b"whole half"))
    destination.cut_off(5)
    destination.close()
    destination.close()
    assert destination.path.read_bytes() == b"whole"


def test_nothing_is_left_of_what_was_not_begun(tmp_path, golden):
    with pytest.raises(KeyboardInterrupt), new_recording(tmp_path / "run.mcap"):
        raise KeyboardInterrupt
    with (
        golden.raises(RecordingRefused),
        new_recording(tmp_path / "b.mcap"),
    ):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert list(tmp_path.iterdir()) == []
