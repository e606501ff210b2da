"""`busflow graph`: drawings of a running graph and of a launch file."""

from pathlib import Path

import pytest

from tests.cli.conftest import Shell, edit

FORMS = ("text", "mermaid", "dot")


@pytest.mark.usefixtures("lab")
def test_without_a_file_the_running_graph_is_drawn(shell: Shell):
    for form in FORMS:
        assert shell(f"graph --format {form}") == 0
    answer = shell.data("graph -a")
    assert answer["version"] == 1
    assert "/rosout" in [topic["name"] for topic in answer["topics"]]
    assert "/imu_publisher/get_parameters" in [service["name"] for service in answer["services"]]


@pytest.mark.usefixtures("project", "place")
def test_with_a_file_nothing_has_to_run(shell: Shell):
    for form in (*FORMS, "json"):
        assert shell(f"graph talk.yaml --format {form}") == 0
    assert shell("graph talk.yaml --run talk") == 2
    assert shell("graph") == 4
    edit("plugin: listener", "plugin: listener\n    remap: {numbers: other}")
    assert shell("graph talk.yaml") == 0
    edit("plugin: talker", "plugin: talkr")
    assert shell("graph talk.yaml") == 2, "a graph that cannot be is not drawn"


@pytest.mark.usefixtures("project")
def test_graph_shows_services_with_their_clients(shell: Shell):
    edit('\n    parameters: {rate_hz: "${args.rate_hz}"}', "")
    Path("plugins/talker.py").write_text(
        "from busflow import Node, client, service\n"
        "from busflow.msgs.std_srvs import Trigger\n\n\n"
        "class Talker(Node):\n"
        "    other = client(Trigger, 'nowhere')\n\n"
        "    @service(Trigger, '~/reset')\n"
        "    def on_reset(self, request: Trigger.Request) -> Trigger.Response:\n"
        "        return Trigger.Response()\n"
    )
    Path("plugins/listener.py").write_text(
        "from busflow import Node, client\n"
        "from busflow.msgs.std_srvs import Trigger\n\n\n"
        "class Listener(Node):\n"
        "    reset = client(Trigger, 'talker/reset')\n"
    )
    for form in (*FORMS, "json"):
        assert shell(f"graph talk.yaml --format {form}") == 0
