"""`busflow check` on launch files, without running them."""

from pathlib import Path

import pytest

from busflow.cli import main
from busflow.wire.machines.certificates import Authority
from tests.cli.conftest import Shell, append, edit

pytestmark = pytest.mark.usefixtures("project")

LISTENER = "plugin: listener"
FORGOTTEN = f"{LISTENER}\n    remap: {{numbers: other}}"
CASES = {
    "a valid file": ([], "check talk.yaml", 0),
    "problems have places and fixes": (
        [("plugin: talker", "plugin: talkr"), (LISTENER, f"{LISTENER}\n    remap: {{number: other}}")],
        "check talk.yaml",
        3,
    ),
    "an unlisted folder of plugins": ([("plugins: [plugins]\n", "")], "check talk.yaml", 3),
    "a class that is not there": ([("plugin: talker", 'plugin: "talker:Talkr"')], "check talk.yaml", 3),
    "problems of the file and of a node": (
        [("name: talk", "nmae: talk"), (LISTENER, "plugin: listner")],
        "check talk.yaml",
        3,
    ),
    "an unpublished topic": ([(LISTENER, FORGOTTEN)], "check talk.yaml", 0),
    "an unpublished topic, strictly": ([(LISTENER, FORGOTTEN)], "check talk.yaml --strict", 3),
    "a run with an unpublished topic, strictly": ([(LISTENER, FORGOTTEN)], "run talk.yaml --strict", 2),
    "an unreceived topic": ([("  listener:\n    plugin: listener\n", "")], "check talk.yaml", 0),
    "an unreceived topic, in all detail": ([("  listener:\n    plugin: listener\n", "")], "check talk.yaml -v", 0),
    "a missing file": ([], "check missing.yaml", 3),
    "an unused argument": ([("args:", "args:\n  gain: {type: float, default: 1.0}")], "check talk.yaml", 0),
    "a repeated key": ([("args:", "args:\n  gain: {type: float, default: 1.0}\nargs:")], "check talk.yaml", 3),
    "a misspelt argument": ([("${args.rate_hz}", "${args.rate_hzz}")], "check talk.yaml", 3),
    "words of QoS": (
        [(LISTENER, f"{LISTENER}\n    subscriptions: {{numbers: {{reliability: often, liveliness: 3}}}}")],
        "check talk.yaml",
        3,
    ),
    "problems in the order of the file": (
        [
            (
                "plugin: talker\n",
                "plugin: talker\n    remap: {nmbers: x}\n    publishers: {numbers: loud, nubers: loud}\n",
            ),
            ('rate_hz: "${args.rate_hz}"', "rate_hz: fast"),
            ("plugin: listener\n", "plugin: listener\n    subscriptions: {numbrs: {depth: 0}}\n"),
            ("nodes:", "topics:\n  /nmbrs: {qos: sensr}\nnodes:"),
        ],
        "check talk.yaml",
        3,
    ),
    "an argument before the file": ([], "check rate_hz:=2 talk.yaml", 2),
}


@pytest.mark.parametrize("case", CASES)
def test_report(case: str, shell: Shell):
    edits, line, code = CASES[case]
    for old, new in edits:
        edit(old, new)
    assert shell(line) == code


def test_unlisted_plugin_folder_beside_the_file_is_pointed_out(shell: Shell):
    edit("plugins: [plugins]\n", "")
    Path("configs").mkdir()
    Path("talk.yaml").rename("configs/talk.yaml")
    assert shell("check configs/talk.yaml") == 3


def test_json_holds_every_problem(shell: Shell):
    edit("plugin: talker", "plugin: talkr")
    answer = shell.data("check talk.yaml", code=3)
    assert (answer["file"], answer["ok"]) == ("talk.yaml", False)
    first = answer["problems"][0]
    assert (first["code"], first["file"], first["line"], first["column"]) == ("unknown-plugin", "talk.yaml", 7, 13)


MISTAKES = [
    "@timer\n    def tick(self): ...",
    "@subscription\n    def on(self, number: Float64): ...",
    "@on_event\n    def on(self, event: DeadlineMissed): ...",
    '@subscription(Float64, "numbers")\n    def on(self, number: Float64): ...',
    '@subscription("numbers")\n    def on(number: Float64): ...',
    '@subscription("numbers")\n    def on(self): ...',
    '@on_event("numbers")\n    def on(self): ...',
    "@timer(1)\n    def tick(): ...",
    "@timer(1)\n    def tick(self, now): ...",
    "parameters = 3",
    "parameters: int",
    '@subscription("numbers")\n    def on(self, number): ...',
    '@subscription("numbers")\n    def on(self, number: int): ...',
    'out = publisher(Float64, "not a name")',
    "out = publisher(Float64, 3)",
    'out = subscription(Float64, "1st")',
    'def declare(self):\n        self.create_publisher(Float64, "not a name")',
    'out = publisher(Float64, "numbers", qos=5)',
    'out = publisher(Float64, "numbers", 10)',
    'out = subscription(Float64, "numbers", 10)',
    'out = subscription(Float64, "numbers", qos="latched")',
    '@subscription("numbers", qos=0)\n    def on(self, number: Float64): ...',
    '@subscription("numbers", 10)\n    def on(self, number: Float64): ...',
    'def declare(self):\n        self.create_publisher(Float64, "numbers", 10)',
    'def declare(self):\n        self.create_subscription(Float64, "numbers", print, 10)',
    'def declare(self):\n        self.create_subscription(Float64, "numbers", 10)',
]


@pytest.mark.parametrize("body", MISTAKES)
def test_node_error_shows_its_line_and_fix(body: str, shell: Shell):
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
    assert shell("check wrong.yaml") == 3


def test_broken_node_causes_no_further_problems(shell: Shell):
    Path("plugins/talker.py").write_text("import nothing_like_this\n")
    assert shell("check talk.yaml --strict") == 3


@pytest.mark.parametrize("use", ["name: ${args.gain}", "name: x${args.rate_hz or args.gain}"])
def test_argument_in_any_expression_is_used(use: str, shell: Shell):
    edit("args:", "args:\n  gain: {type: str, default: talk}")
    edit("name: talk", use)
    assert "unused-argument" not in [each["code"] for each in shell.data("check talk.yaml", code=None)["problems"]]


@pytest.mark.parametrize(
    ("stated", "made"),
    [
        ("runs/{name}.mcap", ""),
        ("{to: run.mcap}", "run.mcap"),
        ("{to: file/run.mcap}", "file"),
        ("'{day}.mcap'", ""),
        ("run.bag", ""),
    ],
)
def test_impossible_recording_is_an_error(stated: str, made: str, shell: Shell):
    append(f"record: {stated}\n")
    if made:
        Path(made).touch()
    assert shell("check talk.yaml") == 3


def test_possible_recording_leaves_nothing_behind():
    before = sorted(Path().iterdir())
    append("record: run.mcap\n")
    assert main(["check", "talk.yaml"]) == 0
    assert sorted(Path().iterdir()) == before


@pytest.fixture
def certs(project: object) -> None:  # noqa: ARG001  # its folder is where we are
    """A file of two machines, and the certificates of both."""
    edit(LISTENER, f"{LISTENER}\n    machine: arm")
    append("machines: {arm: {connect: 'tls/127.0.0.1:7447'}}\nnetwork: {ca: certs/ca.pem}\n")
    authority = Authority.new(Path("certs"))
    authority.add("main", addresses=[])
    authority.add("arm", addresses=["127.0.0.1"])


@pytest.mark.usefixtures("certs")
def test_valid_certificates_are_no_problem_on_any_machine():
    for asked in ([], ["--machine", "main"], ["--machine", "arm"]):
        assert main(["check", "talk.yaml", "--strict", *asked]) == 0


@pytest.mark.usefixtures("certs")
def test_wrong_certificate_is_an_error_at_its_line(shell: Shell):
    Path("certs/arm.key").write_bytes(Path("certs/main.key").read_bytes())
    assert shell("check talk.yaml") == 3
    assert shell("check talk.yaml --machine main") == 0
    assert shell("check talk.yaml --machine amr") == 3


@pytest.mark.usefixtures("certs")
def test_missing_certificate_matters_only_on_its_machine(shell: Shell):
    Path("certs/arm.pem").unlink()
    assert shell("check talk.yaml") == 0, "it is where it belongs"
    assert shell("check talk.yaml --machine arm") == 3
    Path("certs/main.pem").unlink()
    assert shell("check talk.yaml") == 0


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
def test_consequential_problems_are_not_reported(old: str, new: str, shell: Shell):
    edit(old, new)
    edit("plugin: listener\n", "plugin: listener\n    depends_on: {talker: started}\n    remap: {numbers: other}\n")
    append("topics:\n  /other: {qos: sensor_data}\nexpect: {topics: {/other: {max_dropped: 1}}}\n")
    assert len(shell.data("check talk.yaml", code=3)["problems"]) == 1


@pytest.mark.parametrize("stated", ["parameters: {limit: '${args.lmit}'}", "parameters_from: none.yaml"])
def test_misplaced_parameter_is_not_reported_missing(stated: str, shell: Shell):
    Path("plugins/needy.py").write_text(
        "from busflow import Node, Parameters\n\n\nclass NeedyParameters(Parameters):\n    limit: float\n\n\n"
        "class Needy(Node):\n    parameters: NeedyParameters\n"
    )
    edit("plugin: listener\n", f"plugin: listener\n  needy:\n    plugin: needy\n    {stated}\n")
    assert len(shell.data("check talk.yaml", code=3)["problems"]) == 1


@pytest.fixture
def other(project: Path) -> None:
    """A second launch file, beside talk.yaml and with another argument."""
    text = (project / "talk.yaml").read_text()
    (project / "other.yaml").write_text(text.replace("rate_hz: {type", "hertz: {type").replace("rate_hz}", "hertz}"))


@pytest.mark.usefixtures("other")
def test_several_files_are_checked_separately(shell: Shell):
    assert shell("check talk.yaml other.yaml") == 0
    edit("plugin: talker", "plugin: talkr", "other.yaml")
    assert shell("check other.yaml talk.yaml none.yaml") == 3
    report = shell.data("check talk.yaml other.yaml", code=3)
    assert report["ok"] is False
    assert [(each["file"], each["ok"]) for each in report["files"]] == [("talk.yaml", True), ("other.yaml", False)]
    Path("run.mcap").touch()
    assert shell("check talk.yaml run.mcap") == 2


@pytest.mark.usefixtures("other")
@pytest.mark.parametrize(
    ("argument", "wrong"),
    [("rate_hz:=2000", ["talk.yaml"]), ("hertz:=2000", ["other.yaml"]), ("rat_hz:=1", ["talk.yaml"]), ("hertz:=5", [])],
)
def test_argument_applies_to_files_that_declare_it(argument: str, wrong: list[str], shell: Shell):
    report = shell.data(f"check talk.yaml {argument} other.yaml", code=3 if wrong else 0)
    assert [each["file"] for each in report["files"] if not each["ok"]] == wrong


@pytest.mark.usefixtures("other")
def test_environment_of_one_file_ends_with_it(shell: Shell):
    edit("name: talk", "name: talk\nenv: {LAB_NAME: here}")
    edit("name: talk", "name: ${env.LAB_NAME}", "other.yaml")
    assert shell("check talk.yaml other.yaml") == 3
