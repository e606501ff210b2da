"""`Part`: a launch file with its includes and its parameter files."""

from busflow.launchfile.load.files import MAX_FILES
from busflow.launchfile.load.load import examine
from busflow.launchfile.load.part import MAX_INCLUDE_DEPTH
from busflow.launchfile.model.description import NodeSpec

TALKER = "nodes:\n  talker:\n    plugin: talker\n"


def node(folder, text: str, **how: object) -> NodeSpec:
    (found,) = folder.load(text, **how).nodes
    return found


def test_parameters_override_their_parameter_files(folder):
    folder.write("joints: [a, b]\nnoise: {imu: 1, joints: 1}\n", "config/one.yaml")
    folder.write("noise: {imu: 2}\nrate: ${args.rate}\n", "config/two.yaml")
    found = node(
        folder,
        "args: {rate: {type: int, default: 5}}\n"
        + TALKER
        + "    parameters_from: [config/one.yaml, config/two.yaml]\n    parameters: {joints: [c]}\n",
    )
    assert found.parameters.data == {"joints": ["c"], "noise": {"imu": 2, "joints": 1}, "rate": 5}
    value = found.parameters.find(("noise", "imu"))
    assert value is not None
    assert str(value.origin) == "config/two.yaml:1:14"
    assert [str(place) for place in value.origin.included_from] == ["lab1.yaml:5:40"]


def test_dotted_parameters_are_groups(folder):
    """In the launch file and in a plain parameter file; in a mapping, which may be a value, a dot is only a letter."""
    folder.write("noise.imu: 1\nnoise.joints: 1\n", "config/one.yaml")
    found = node(
        folder,
        TALKER + "    parameters_from: config/one.yaml\n    parameters: {noise.imu: 3, gains: {left.knee: 2}}\n",
    )
    assert found.parameters.data == {"noise": {"imu": 3, "joints": 1}, "gains": {"left.knee": 2}}
    value = found.parameters.find(("noise", "imu"))
    assert value is not None
    assert str(value.origin) == "lab1.yaml:5:29"
    shared = "defaults: {parameters: {noise.imu: 4}}\n"
    found = node(folder, shared + TALKER + "    parameters: {noise.joints: 5}\n")
    assert found.parameters.data == {"noise": {"imu": 4, "joints": 5}}
    deep = ".".join(["a"] * 100)
    folder.write(TALKER + f"    parameters: {{{deep}: 1, b: 2}}\n")
    found, problems = examine("lab1.yaml", environment={})
    assert "nested deeper than" in problems[0].render()


def test_wrong_expression_in_parameter_file_removes_its_parameter(folder):
    folder.write("a: ${args.nope}\nb: 1\n", "joints.yaml")
    folder.write(TALKER + "    parameters_from: joints.yaml\n")
    found, problems = examine("lab1.yaml", environment={})
    assert [(each.code, str(each.place)) for each in problems] == [("expression", "joints.yaml:1:6")]
    assert found is not None
    assert found.nodes[0].parameters.data == {"b": 1}


def test_namespaces_of_file_include_and_node_compose(folder):
    folder.write(
        "namespace: arm\nnodes:\n  a: {plugin: p, namespace: c}\n  d/b: {plugin: p}\ntopics: {t: {qos: sensor_data}}\n",
        "part.yaml",
    )
    found = folder.load("""
        namespace: robot
        include:
          - {file: part.yaml, namespace: left}
          - {file: part.yaml, namespace: /right}
        nodes:
          x: {plugin: p}
          y: {plugin: p, namespace: /abs}
    """)
    assert [each.full_name for each in found.nodes] == [
        "/robot/left/arm/c/a",
        "/robot/left/arm/d/b",
        "/right/arm/c/a",
        "/right/arm/d/b",
        "/robot/x",
        "/abs/y",
    ]
    assert [each.topic for each in found.topics] == ["/robot/left/arm/t", "/right/arm/t"]


def test_include_is_relative_to_its_file(folder):
    folder.write("", "b/plugins/p.py")
    folder.write("include: [../c/inner.yaml]\n", "b/outer.yaml")
    folder.write("plugins: [../b/plugins]\nnodes: {n: {plugin: p}}\n", "c/inner.yaml")
    found = folder.load("include: b/outer.yaml\n")
    assert [str(path) for path in found.files] == ["lab1.yaml", "b/outer.yaml", "c/inner.yaml"]
    assert [str(each.path) for each in found.folders] == ["b/plugins"]
    assert [str(place) for place in found.nodes[0].origin.included_from] == ["b/outer.yaml:1:11", "lab1.yaml:1:10"]


def test_plugin_folders_of_the_own_file_come_first(folder):
    for name in ("one", "two"):
        folder.write("", f"{name}/p.py")
    folder.write("plugins: [two]\nnodes: {b: {plugin: p}}\n", "b.yaml")
    found = folder.load("plugins: [one]\ninclude: [b.yaml]\nnodes: {a: {plugin: p}}\n")
    assert {each.name: [str(path) for path in each.folders] for each in found.nodes} == {
        "b": ["two", "one"],
        "a": ["one", "two"],
    }
    assert [str(each.path) for each in found.folders] == ["one", "two"]


def test_includes_without_end_are_refused(folder, golden):
    for number in range(MAX_INCLUDE_DEPTH + 5):
        folder.write(f"include: [{number + 1}.yaml, {number + 1}.yaml]\n", f"{number}.yaml")
    report = folder.report("include: [0.yaml]\n")
    golden(report)
    assert report.count(f"more than {MAX_FILES} files are read") == 1
    assert len(report) < 100_000
