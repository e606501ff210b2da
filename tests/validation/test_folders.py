"""A folder that cannot be read is a problem; a missing one is not, since others report it."""

from busflow.validation.folders import unreadable


def test_unlistable_folder_is_a_problem(tmp_path):
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    problem = unreadable(tmp_path / "loop")
    assert problem is not None
    assert problem.code == "unreadable-folder"
    assert str(tmp_path / "loop") in problem.message
    assert problem.fix is not None
    assert problem.fix.endswith(f"chmod u+rx {tmp_path / 'loop'}")


def test_readable_or_missing_folder_is_no_problem(tmp_path):
    file = tmp_path / "camera.py"
    file.write_text("")
    (tmp_path / "arm").mkdir()
    (tmp_path / "hand").mkdir()
    (tmp_path / "hand/__init__.py").write_text("")
    for each in (tmp_path, tmp_path / "arm", tmp_path / "hand", tmp_path / "absent", file):
        assert unreadable(each) is None
