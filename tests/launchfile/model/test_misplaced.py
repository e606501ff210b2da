"""Misplaced keys: correct keys stay in place, however odd; the gallery of mistakes has the wrong ones."""

import pytest

from busflow.launchfile.load.load import examine


@pytest.mark.parametrize(
    "text",
    [
        "nodes:\n  process:\n    plugin: talker\n  parameters:\n    plugin: talker\n    parameters: {plugin: 1}\n",
        "nodes: {\nsonar: {\nplugin: talker\n},\nparameters: {\nplugin: talker}}\n",
        "topics:\n  imu:\n  type:\n  qos: {}\nnodes:\n  sonar: {plugin: talker, remap: {plugin: x, parameters: y}}\n",
        "x-mine:\nplugins: []\nx-yours:\nnodes:\n  sonar:\n    plugin: talker\n    parameters:\n    remap: {a: b}\n",
        "args:\n  type: {type: int, default: 1}\n  default: {type: int, default: 1}\nnodes: {type: {plugin: talker}}\n",
        'nodes:\n  sonar:\n    plugin: talker\n    parameters: {url: "http://x", "a:b": }\n',
    ],
)
def test_names_like_keys_stay_in_place(text: str, folder):
    folder.write(text)
    description, problems = examine("lab1.yaml", environment={})
    assert [problem.render() for problem in problems] == []
    assert description is not None
    assert [node.plugin for node in description.nodes] == ["talker"] * len(description.nodes)


def test_rest_is_checked_as_if_correctly_indented(folder, golden):
    report = folder.report(
        """\
        nodes:
          sonar:
          plugin: sonar
          restart: sometimes
          guard:
          plugin: guard
        seed: -1
        """
    )
    golden("\n".join(line for line in report.splitlines() if "error" in line))
