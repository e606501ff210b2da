"""Edits of launch files that can be looked at before they are written."""

from pathlib import Path

from busflow.launchfile.yaml.file_edit import LaunchFileEdit, launch_key, saved_key


def test_a_key_is_written_and_read(tmp_path: Path):
    file = tmp_path / "lab.yaml"
    file.write_bytes(b"name: lab  # the lab\r\n")
    file.chmod(0o640)
    assert launch_key(file, "x-ui") is None
    edit = saved_key(file, "x-ui", {"dark": True})
    assert file.read_bytes() == b"name: lab  # the lab\r\n"
    assert edit.before == "name: lab  # the lab\r\n"
    edit.write()
    assert file.read_bytes() == edit.after.encode()
    assert b"# the lab\r\n" in file.read_bytes()
    assert file.stat().st_mode & 0o777 == 0o640
    assert launch_key(file, "x-ui") == {"dark": True}


def test_an_edit_without_a_change_writes_nothing(tmp_path: Path):
    file = tmp_path / "lab.yaml"
    file.write_text("name: lab\n")
    before = file.stat()
    LaunchFileEdit.of(file, lambda text: text).write()
    assert (file.stat().st_ino, file.stat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)
    assert list(tmp_path.iterdir()) == [file]
