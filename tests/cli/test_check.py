"""`busflow check` and `busflow graph` on a launch file, without running it."""

import json
from pathlib import Path

import pytest

from busflow.cli import main
from busflow.wire.machines.certificates import Authority

pytestmark = pytest.mark.usefixtures("project")

Captured = pytest.CaptureFixture[str]


def replace(old: str, new: str) -> None:
    text = Path("talk.yaml").read_text()
    assert old in text
    Path("talk.yaml").write_text(text.replace(old, new))


def test_valid_file_has_exit_code_0(capsys: Captured):
    assert main(["check", "talk.yaml"]) == 0
    assert capsys.readouterr().out == "no problems\n"


def test_all_problems_are_reported_with_place_and_fix(capsys: Captured):
    replace("plugin: talker", "plugin: talkr")
    replace("plugin: listener", "plugin: listener\n    remap: {number: other}")
    assert main(["check", "talk.yaml"]) == 3
    out = capsys.readouterr().out
    assert "talk.yaml:7:13: error: there is no plugin 'talkr'" in out
    assert "fix: did you mean 'talker'?" in out
    assert "talk.yaml:11:13: error: the remap of number matches no topic" in out
    assert out.endswith("2 errors\n")


def test_unlisted_plugin_folder_is_pointed_out(capsys: Captured):
    replace("plugins: [plugins]\n", "")
    assert main(["check", "talk.yaml"]) == 3
    fix = "fix: its file is in a folder that this one does not name: add plugins: "
    assert capsys.readouterr().out.count(f"{fix}[plugins]") == 2
    Path("configs").mkdir()
    Path("talk.yaml").rename("configs/talk.yaml")
    assert main(["check", "configs/talk.yaml"]) == 3
    assert capsys.readouterr().out.count(f"{fix}[../plugins]") == 2


def test_listed_plugin_folder_is_not_pointed_out(capsys: Captured):
    replace("plugin: talker", 'plugin: "talker:Talkr"')
    assert main(["check", "talk.yaml"]) == 3
    out = capsys.readouterr().out
    assert "plugins/talker.py has no class 'Talkr'\n" in out
    assert "fix: did you mean 'Talker'?" in out


def test_file_problems_do_not_hide_node_problems(capsys: Captured):
    replace("name: talk", "nmae: talk")
    replace("plugin: listener", "plugin: listner")
    assert main(["check", "talk.yaml"]) == 3
    out = capsys.readouterr().out
    assert "did you mean 'name'?" in out
    assert "did you mean 'listener'?" in out


def test_json_holds_every_problem(capsys: Captured):
    replace("plugin: talker", "plugin: talkr")
    assert main(["check", "talk.yaml", "--json"]) == 3
    answer = json.loads(capsys.readouterr().out)
    assert (answer["file"], answer["ok"]) == ("talk.yaml", False)
    first = answer["problems"][0]
    assert (first["code"], first["file"], first["line"], first["column"]) == ("unknown-plugin", "talk.yaml", 7, 13)


def test_strict_makes_an_unpublished_topic_an_error(capsys: Captured):
    replace("plugin: listener", "plugin: listener\n    remap: {numbers: other}")
    assert main(["check", "talk.yaml"]) == 0
    assert "which has no publisher" in capsys.readouterr().out
    assert main(["check", "talk.yaml", "--strict"]) == 3
    assert main(["run", "talk.yaml", "--strict"]) == 2


def test_unreceived_topic_is_listed_with_verbose(capsys: Captured):
    replace("  listener:\n    plugin: listener\n", "")
    assert main(["check", "talk.yaml"]) == 0
    assert capsys.readouterr().out == "no problems\n"
    assert main(["check", "talk.yaml", "-v"]) == 0
    assert "which has no subscription" in capsys.readouterr().out


def test_a_missing_file_is_a_problem_too(capsys: Captured):
    assert main(["check", "missing.yaml"]) == 3
    assert "cannot read missing.yaml" in capsys.readouterr().out


def test_graph_shows_topics_with_their_endpoints(capsys: Captured):
    assert main(["graph", "talk.yaml"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "/talker  (talker)",
        "  /numbers  std_msgs/msg/Float64  →  /listener",
        "/listener  (listener)",
    ]


def test_graph_shows_unmatched_topics(capsys: Captured):
    replace("plugin: listener", "plugin: listener\n    remap: {numbers: other}")
    assert main(["graph", "talk.yaml"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "/talker  (talker)",
        "  /numbers  std_msgs/msg/Float64  →  no node",
        "/listener  (listener)",
        "no node",
        "  /other  std_msgs/msg/Float64  →  /listener",
    ]


def test_the_graph_as_mermaid_dot_and_json(capsys: Captured):
    assert main(["graph", "talk.yaml", "--format", "mermaid"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "flowchart LR",
        '  n0["/talker"]',
        '  n1["/listener"]',
        '  t0(["/numbers<br/>std_msgs/msg/Float64"])',
        "  n0 --> t0",
        "  t0 --> n1",
    ]
    assert main(["graph", "talk.yaml", "--format", "dot"]) == 0
    assert "  t0 -> n1" in capsys.readouterr().out
    assert main(["graph", "talk.yaml", "--format", "json"]) == 0
    drawn = json.loads(capsys.readouterr().out)
    assert drawn["topics"] == [
        {
            "name": "/numbers",
            "type": "std_msgs/msg/Float64",
            "publishers": ["/talker"],
            "subscriptions": ["/listener"],
        }
    ]


def test_graph_shows_services_with_their_clients(capsys: Captured):
    replace('\n    parameters: {rate_hz: "${args.rate_hz}"}', "")
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
    assert main(["graph", "talk.yaml"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "/talker  (talker)",
        "  /talker/reset  std_srvs/srv/Trigger  ←  /listener",
        "/listener  (listener)",
        "no node",
        "  /nowhere  std_srvs/srv/Trigger  ←  /talker",
    ]
    assert main(["graph", "talk.yaml", "--format", "mermaid"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert '  s0{{"/talker/reset<br/>std_srvs/srv/Trigger"}}' in lines
    assert lines[-3:] == ["  n1 --> s0", "  s0 --> n0", "  n0 --> s1"]
    assert main(["graph", "talk.yaml", "--format", "dot"]) == 0
    assert '  s0 [shape=hexagon, label="/talker/reset\\nstd_srvs/srv/Trigger"]' in capsys.readouterr().out
    assert main(["graph", "talk.yaml", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["services"][0] == {
        "name": "/talker/reset",
        "type": "std_srvs/srv/Trigger",
        "servers": ["/talker"],
        "clients": ["/listener"],
    }


def test_a_graph_that_cannot_be_is_not_drawn(capsys: Captured):
    replace("plugin: talker", "plugin: talkr")
    assert main(["graph", "talk.yaml"]) == 2
    assert capsys.readouterr().out == ""


MISTAKES = [
    ("@timer\n    def tick(self): ...", "write @timer(0.1), or @timer(hz=10), above tick", 7),
    ("@subscription\n    def on(self, number: Float64): ...", 'write @subscription("imu/data") above on', 7),
    ("@on_event\n    def on(self, event: DeadlineMissed): ...", "@on_event(…) needs the topic's name", 7),
    (
        '@subscription(Float64, "numbers")\n    def on(self, number: Float64): ...',
        'above a method write @subscription("numbers"): the method itself states the type, def on(self, message: ',
        7,
    ),
    ('@subscription("numbers")\n    def on(number: Float64): ...', "write def on(self, message: Imu)", 7),
    ('@subscription("numbers")\n    def on(self): ...', "write def on(self, message: Imu)", 7),
    ('@on_event("numbers")\n    def on(self): ...', "write def on(self, event: DeadlineMissed)", 7),
    ("@timer(1)\n    def tick(): ...", "write def tick(self)", 7),
    ("@timer(1)\n    def tick(self, now): ...", "write def tick(self)", 7),
    ("parameters = 3", "write parameters: WrongParameters in the class", 5),
    ("parameters: int", "a class derived from busflow.Parameters, not <class 'int'>", 5),
    ('@subscription("numbers")\n    def on(self, number): ...', "def on(self, message: Imu) -> None", 7),
    ('@subscription("numbers")\n    def on(self, number: int): ...', "needs a message type", 7),
    ('out = publisher(Float64, "not a name")', "topic name 'not a name': ' ' is not allowed", 7),
    ("out = publisher(Float64, 3)", "publisher(Float64, …) needs the topic's name, a text, not 3", 7),
    ('out = subscription(Float64, "1st")', "topic name '1st'", 7),
    ('def declare(self):\n        self.create_publisher(Float64, "not a name")', "topic name 'not a name'", 8),
    ('out = publisher(Float64, "numbers", qos=5)', "qos must be a QoS: write qos=QoS(depth=5), not 5", 7),
    ('out = publisher(Float64, "numbers", 10)', "qos must be a QoS: write qos=QoS(depth=10), not 10", 7),
    ('out = subscription(Float64, "numbers", 10)', "qos must be a QoS: write qos=QoS(depth=10), not 10", 7),
    ('out = subscription(Float64, "numbers", qos="latched")', "write qos=QoS(depth=10), not 'latched'", 7),
    ('@subscription("numbers", qos=0)\n    def on(self, number: Float64): ...', "write qos=QoS(depth=10), not 0", 7),
    (
        '@subscription("numbers", 10)\n    def on(self, number: Float64): ...',
        "nothing more but qos=QoS(depth=…), got 10",
        7,
    ),
    ('def declare(self):\n        self.create_publisher(Float64, "numbers", 10)', "write qos=QoS(depth=10), not 10", 8),
    (
        'def declare(self):\n        self.create_subscription(Float64, "numbers", print, 10)',
        "write qos=QoS(depth=10), not 10",
        8,
    ),
    (
        'def declare(self):\n        self.create_subscription(Float64, "numbers", 10)',
        "create_subscription needs a method to call with each message, or none, not 10",
        8,
    ),
]


@pytest.mark.parametrize(("body", "remedy", "line"), MISTAKES, ids=[body for body, *_ in MISTAKES])
def test_node_error_shows_its_line_and_fix(body: str, remedy: str, line: int, capsys: Captured):
    Path("plugins/wrong.py").write_text(
        "from busflow import DeadlineMissed, Node, on_event, publisher, subscription, timer\n"
        "from busflow.msgs.std_msgs import Float64\n"
        "\n"
        "\n"
        "class Wrong(Node):\n"
        '    """A node with a mistake."""\n'
        f"    {body}\n"
    )
    Path("wrong.yaml").write_text("plugins: [plugins]\nnodes: {wrong: {plugin: wrong}}\n")
    assert main(["check", "wrong.yaml"]) == 3
    first = capsys.readouterr().out.splitlines()[0]
    assert first.startswith(f"plugins/wrong.py:{line}:")
    assert remedy in first
    assert "Error" not in first
    assert "InvalidDeclaration" not in first


def test_broken_node_causes_no_further_problems(capsys: Captured):
    Path("plugins/talker.py").write_text("import nothing_like_this\n")
    assert main(["check", "talk.yaml", "--strict"]) == 3
    out = capsys.readouterr().out
    assert "nothing_like_this" in out
    assert "has no publisher" not in out
    assert out.endswith("1 error\n")


def test_unused_argument_is_a_warning(capsys: Captured):
    replace("args:", "args:\n  gain: {type: float, default: 1.0}")
    assert main(["check", "talk.yaml"]) == 0
    assert capsys.readouterr().out == (
        "talk.yaml:4:3: warning: nothing uses the argument gain\n"
        "    gain: {type: float, default: 1.0}\n"
        "    ^^^^\n"
        "  fix: write ${args.gain} where it is meant\n"
        "1 warning\n"
    )


def test_repeated_key_stands_before_what_follows(capsys: Captured):
    replace("args:", "args:\n  gain: {type: float, default: 1.0}\nargs:")
    assert main(["check", "talk.yaml"]) == 3
    out = capsys.readouterr().out
    assert out.startswith("talk.yaml:5:1: error: the key args stands twice; it was first at talk.yaml:3:1\n")
    assert out.endswith("fix: leave one of them out\n1 error\n")


@pytest.mark.parametrize("use", ["name: ${args.gain}", "name: x${args.rate_hz or args.gain}"])
def test_argument_in_any_expression_is_used(use: str, capsys: Captured):
    replace("args:", "args:\n  gain: {type: str, default: talk}")
    replace("name: talk", use)
    main(["check", "talk.yaml"])
    assert "nothing uses" not in capsys.readouterr().out


def test_qos_words_are_those_of_profiles(capsys: Captured):
    replace("plugin: listener", "plugin: listener\n    subscriptions: {numbers: {reliability: often, liveliness: 3}}")
    assert main(["check", "talk.yaml"]) == 3
    out = capsys.readouterr().out
    assert "reliability must be one of system_default, reliable, best_effort, got text 'often'" in out
    assert "unknown" not in out
    assert "best_available" not in out


def test_misspelt_argument_does_not_affect_others(capsys: Captured):
    replace("${args.rate_hz}", "${args.rate_hzz}")
    assert main(["check", "talk.yaml"]) == 3
    out = capsys.readouterr().out
    assert "unknown argument rate_hzz" in out
    assert "nothing uses" not in out


@pytest.mark.parametrize(
    ("stated", "made", "column", "expected"),
    [
        ("runs/{name}.mcap", "", 9, "cannot record to runs/talk.mcap: make its folder first: mkdir -p runs"),
        ("{to: run.mcap}", "run.mcap", 14, "run.mcap is there already, and a recording overwrites nothing"),
        ("{to: file/run.mcap}", "file", 14, "cannot record to file/run.mcap: Not a directory"),
        ("'{day}.mcap'", "", 9, "{day}.mcap: {day} stands for nothing"),
        ("run.bag", "", 9, "a recording is an MCAP file: write run.bag.mcap"),
    ],
)
def test_impossible_recording_is_an_error(stated, made, column, expected, capsys: Captured):
    text = Path("talk.yaml").read_text()
    Path("talk.yaml").write_text(f"{text}record: {stated}\n")
    line = len(text.splitlines()) + 1
    if made:
        Path(made).touch()
    assert main(["check", "talk.yaml"]) == 3
    assert f"talk.yaml:{line}:{column}: error: {expected}" in capsys.readouterr().out


def test_possible_recording_leaves_nothing_behind(capsys: Captured):
    before = sorted(Path().iterdir())
    Path("talk.yaml").write_text(f"{Path('talk.yaml').read_text()}record: run.mcap\n")
    assert main(["check", "talk.yaml"]) == 0
    assert capsys.readouterr().out == "no problems\n"
    assert sorted(Path().iterdir()) == before


MACHINES = """
machines: {arm: {connect: 'tls/127.0.0.1:7447'}}
network: {ca: certs/ca.pem}
"""


@pytest.fixture
def certs(project: object) -> None:  # noqa: ARG001  # its folder is where we are
    """A file of two machines, and the certificates of both."""
    replace("plugin: listener", "plugin: listener\n    machine: arm")
    Path("talk.yaml").write_text(f"{Path('talk.yaml').read_text()}{MACHINES}")
    authority = Authority.new(Path("certs"))
    authority.add("main", addresses=[])
    authority.add("arm", addresses=["127.0.0.1"])


@pytest.mark.usefixtures("certs")
def test_valid_certificates_are_no_problem_on_any_machine(capsys: Captured):
    for asked in ([], ["--machine", "main"], ["--machine", "arm"]):
        assert main(["check", "talk.yaml", *asked]) == 0
        assert capsys.readouterr().out == "no problems\n"


@pytest.mark.usefixtures("certs")
def test_wrong_certificate_is_an_error_at_its_line(capsys: Captured):
    Path("certs/arm.key").write_bytes(Path("certs/main.key").read_bytes())
    line = len(Path("talk.yaml").read_text().splitlines())
    assert main(["check", "talk.yaml"]) == 3
    out = capsys.readouterr().out
    assert f"talk.yaml:{line}:15: error: the key " in out
    assert "is not that of the certificate" in out
    assert "fix: busflow certs add arm" in out
    assert out.endswith("1 error\n")
    assert main(["check", "talk.yaml", "--machine", "main"]) == 0


@pytest.mark.usefixtures("certs")
def test_missing_certificate_matters_only_on_its_machine(capsys: Captured):
    Path("certs/arm.pem").unlink()
    assert main(["check", "talk.yaml"]) == 0, "it is where it belongs"
    assert main(["check", "talk.yaml", "--machine", "arm"]) == 3
    Path("certs/main.pem").unlink()
    capsys.readouterr()
    assert main(["check", "talk.yaml"]) == 0
    out = capsys.readouterr().out
    assert "warning: there is no file" in out
    assert "certs/main.pem" in out
    assert out.endswith("1 warning\n")


@pytest.mark.usefixtures("certs")
def test_unknown_machine_is_an_error(capsys: Captured):
    assert main(["check", "talk.yaml", "--machine", "amr"]) == 3
    assert "talk has no machine amr" in capsys.readouterr().out


def problem_lines(capsys: Captured) -> list[str]:
    """The errors and warnings of a report, without the name of the file."""
    return [
        line.removeprefix("talk.yaml:")
        for line in capsys.readouterr().out.splitlines()
        if ": error:" in line or ": warning:" in line
    ]


def test_problems_beside_wrong_parameters_keep_file_order(capsys: Captured):
    replace(
        "plugin: talker\n", "plugin: talker\n    remap: {nmbers: x}\n    publishers: {numbers: loud, nubers: loud}\n"
    )
    replace('rate_hz: "${args.rate_hz}"', "rate_hz: fast")
    replace("plugin: listener\n", "plugin: listener\n    subscriptions: {numbrs: {depth: 0}}\n")
    with Path("talk.yaml").open("a") as file:
        file.write("topics:\n  /nmbrs: {qos: sensr}\n")
    assert main(["check", "talk.yaml"]) == 3
    errors = [line for line in problem_lines(capsys) if "warning" not in line]
    assert [int(line.partition(":")[0]) for line in errors] == [8, 9, 9, 9, 10, 13, 13, 15, 15]
    assert "the remap of nmbers matches no topic" in errors[0]
    assert [("no QoS profile loud" in line, "does not publish nubers" in line) for line in errors[1:4]].count(
        (True, False)
    ) == 2
    assert "rate_hz must be a number" in errors[4]
    assert "does not subscribe to numbrs" in errors[5]
    assert "depth must be at least 1" in errors[6]
    assert "no node publishes or receives the topic /nmbrs" in errors[7]
    assert main(["run", "talk.yaml"]) == 2
    assert [
        line.removeprefix("talk.yaml:") for line in capsys.readouterr().err.splitlines() if ": error:" in line
    ] == errors


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("nodes:", "include: none.yaml\nnodes:"),  # its content is not known
        ("plugin: talker\n", "plugin: talker\n    namespace: ${args.side}\n"),
        ("plugin: talker\n", 'plugin: talker\n    remap: {numbers: "${args.side}"}\n'),
        ("plugin: talker\n", "plugin: talker\n    remap: {nmbers: other}\n"),
        ("plugin: talker\n", "plugin: talker\n    plugin: listener\n"),
        ("plugin: talker\n", 'plugin: talker\n    for_each: {n: "${args.side}"}\n'),
        ("plugins: [plugins]", "plugins: [plugns]"),
        ("  talker:\n", "  talker:\n    when: ${args.side}\n"),
        ("  talker:\n", "  tal-ker:\n"),
    ],
)
def test_consequential_problems_are_not_reported(old: str, new: str, capsys: Captured):
    replace(old, new)
    replace("plugin: listener\n", "plugin: listener\n    depends_on: {talker: started}\n    remap: {numbers: other}\n")
    with Path("talk.yaml").open("a") as file:
        file.write("topics:\n  /other: {qos: sensor_data}\nexpect: {topics: {/other: {max_dropped: 1}}}\n")
    assert main(["check", "talk.yaml"]) == 3
    assert len(problem_lines(capsys)) == 1


@pytest.mark.parametrize("stated", ["parameters: {limit: '${args.lmit}'}", "parameters_from: none.yaml"])
def test_misplaced_parameter_is_not_reported_missing(stated: str, capsys: Captured):
    Path("plugins/needy.py").write_text(
        "from busflow import Node, Parameters\n\n\nclass NeedyParameters(Parameters):\n    limit: float\n\n\n"
        "class Needy(Node):\n    parameters: NeedyParameters\n"
    )
    replace("plugin: listener\n", f"plugin: listener\n  needy:\n    plugin: needy\n    {stated}\n")
    assert main(["check", "talk.yaml"]) == 3
    assert len(problem_lines(capsys)) == 1


@pytest.fixture
def other() -> Path:
    """A second launch file, beside talk.yaml and with another argument."""
    path = Path("other.yaml")
    path.write_text(
        Path("talk.yaml").read_text().replace("rate_hz: {type", "hertz: {type").replace("rate_hz}", "hertz}")
    )
    return path


def test_several_files_are_checked_separately(capsys: Captured, other: Path):
    assert main(["check", "talk.yaml", "other.yaml"]) == 0
    assert capsys.readouterr().out == "talk.yaml: no problems\nother.yaml: no problems\n"
    other.write_text(other.read_text().replace("plugin: talker", "plugin: talkr"))
    assert main(["check", "other.yaml", "talk.yaml", "none.yaml"]) == 3
    out = capsys.readouterr().out.splitlines()
    assert [line for line in out if line.startswith("other.yaml:7:13: error: there is no plugin 'talkr'")]
    assert [line for line in out if line.endswith(("problems", "1 error", "directory"))] == [
        "other.yaml: 1 error",
        "talk.yaml: no problems",
        "error: cannot read none.yaml: No such file or directory",
        "none.yaml: 1 error",
    ]


def test_several_files_as_json_are_a_report_each(capsys: Captured, other: Path):
    other.write_text(other.read_text().replace("name: talk", "nmae: talk"))
    assert main(["check", "talk.yaml", "other.yaml", "--json"]) == 3
    report = json.loads(capsys.readouterr().out)
    assert report["ok"] is False
    assert [(each["file"], each["ok"], len(each["problems"])) for each in report["files"]] == [
        ("talk.yaml", True, 0),
        ("other.yaml", False, 1),
    ]


@pytest.mark.parametrize(
    ("argument", "wrong"),
    [("rate_hz:=2000", ["talk.yaml"]), ("hertz:=2000", ["other.yaml"]), ("rat_hz:=1", ["talk.yaml"]), ("hertz:=5", [])],
)
def test_argument_applies_to_files_that_declare_it(argument: str, wrong: list[str], capsys: Captured, other: Path):
    assert main(["check", "talk.yaml", argument, str(other), "--json"]) == (3 if wrong else 0)
    report = json.loads(capsys.readouterr().out)
    assert [each["file"] for each in report["files"] if not each["ok"]] == wrong


def test_environment_of_one_file_ends_with_it(capsys: Captured, other: Path):
    replace("name: talk", "name: talk\nenv: {LAB_NAME: here}")
    other.write_text(other.read_text().replace("name: talk", "name: ${env.LAB_NAME}"))
    assert main(["check", "talk.yaml", "other.yaml"]) == 3
    assert "other.yaml:1:9: error: the environment variable LAB_NAME is not set" in capsys.readouterr().out


def test_a_recording_among_several_files_is_refused(capsys: Captured):
    Path("run.mcap").touch()
    assert main(["check", "talk.yaml", "run.mcap"]) == 2
    assert "run.mcap is a recording" in capsys.readouterr().err


def test_argument_before_the_file_is_refused(capsys: Captured):
    assert main(["check", "rate_hz:=2", "talk.yaml"]) == 2
    assert "error: rate_hz:=2 is an argument of the launch file: name the file first" in capsys.readouterr().err
