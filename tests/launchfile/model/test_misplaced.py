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


def test_rest_is_checked_as_if_correctly_indented(folder):
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
    assert [line for line in report.splitlines() if "error" in line] == [
        "lab1.yaml:3:3: error: plugin and restart must stand below sonar",
        "lab1.yaml:4:12: error: nodes.sonar.restart must be one of never, on-failure, always, got text 'sometimes'",
        "lab1.yaml:6:3: error: plugin must stand below guard",
        "lab1.yaml:7:7: error: seed must be at least 0, got -1",
    ]
