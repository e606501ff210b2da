"""Missing files and folders: the suggestions for them."""

import pytest

from busflow.launchfile.load.load import examine

TALKER = "nodes:\n  talker:\n    plugin: talker\n"


def test_missing_launch_file_suggests_a_neighbour(folder, golden):
    folder.write(TALKER)
    _, problems = examine("lab2.yaml", environment={})
    golden("\n".join(each.render() for each in problems))


def test_suggested_file_is_relative_to_the_naming_file(folder):
    folder.write(TALKER, "configs/lab1.yaml")
    folder.write("include: lab.yaml\n", "configs/all.yaml")
    folder.write("include: configs/lab.yaml\n", "above.yaml")
    fixes = {
        path: examine(path, environment={})[1][0].fix for path in ("configs/lab1.yml", "configs/all.yaml", "above.yaml")
    }
    assert fixes == {
        "configs/lab1.yml": "did you mean 'configs/lab1.yaml'?",
        "configs/all.yaml": "did you mean 'lab1.yaml'?",
        "above.yaml": "did you mean 'configs/lab1.yaml'?",
    }


@pytest.mark.parametrize(
    ("asked", "there"), [("lab1", "configs/lab1.yaml"), ("lab1.yaml", "configs/lab1.yaml"), ("lab1", "lab1.yaml")]
)
def test_bare_name_suggests_a_launch_file(folder, asked: str, there: str):
    folder.write(TALKER, there)
    _, problems = examine(asked, environment={})
    assert [each.fix for each in problems] == [f"did you mean {there!r}?"]


@pytest.mark.parametrize(
    ("path", "fix"),
    [
        ("labs/lab1.yaml", "did you mean 'lab/lab1.yaml'?"),
        ("labs/lba1.yaml", "did you mean 'lab/lab1.yaml'?"),
        ("labs/zzz.yaml", "did you mean 'lab'?"),
        ("lab", "did you mean 'lab/lab1.yaml'?"),
        ("/dev/null", None),
        ("zzz/lab1.yaml", "there is no folder zzz"),
        ("zzz/yyy/lab1.yaml", "there is no folder zzz"),
    ],
)
def test_folder_suggests_what_is_in_or_near_it(folder, path: str, fix: str | None):
    folder.write(TALKER, "lab/lab1.yaml")
    _, problems = examine(path, environment={})
    assert [each.fix for each in problems] == [fix]


def test_a_broken_link_is_not_its_own_fix(tmp_path):
    link = tmp_path / "lab1.yaml"
    link.symlink_to("nothing.yaml")
    _, problems = examine(link, environment={})
    assert [each.fix for each in problems] == [None]


@pytest.mark.parametrize(
    ("file", "fix"),
    [
        ("configs/lab1.yaml", ": or did you mean 'configs/lab1.yaml'?"),
        ("elsewhere/lab1.yaml", "; in a file, nodes: {talker: {plugin: talker}}"),
    ],
)
def test_plugin_instead_of_file_suggests_its_launch_file(folder, file: str, fix: str):
    folder.write("nodes: {other: {plugin: talkers}}\n", "configs/all.yaml")
    folder.write(TALKER, file)
    _, problems = examine("talker", environment={}, plugins=lambda: ["talker", "player"])
    alone = "talker is a plugin, which busflow run --plugin talker runs alone"
    assert [each.fix for each in problems] == [alone + fix]


@pytest.mark.usefixtures("folder")
def test_without_names_of_plugins_nothing_is_suggested():
    _, problems = examine("talker", environment={})
    assert [each.fix for each in problems] == [None]
