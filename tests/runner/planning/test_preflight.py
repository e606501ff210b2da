"""Pre-flight: finds everything that would go wrong with the nodes of a graph before any of them starts."""
# ruff: noqa: E501  # a report is compared as it is printed, however long its lines

import pytest

from busflow import DEFAULT, Node, QoS, Reliability, publisher, service, subscription
from busflow.clock import SystemClock
from busflow.errors import Severity
from busflow.launchfile.load.load import examine
from busflow.launchfile.model.supervision import Supervision
from busflow.log import Log
from busflow.msgs.std_msgs import Float64, String
from busflow.msgs.std_srvs import Trigger
from busflow.runner.planning.preflight import Plan, Preflight


def rendered(plan: Plan) -> str:
    """Return all problems but those of severity INFO, rendered without the excerpts."""
    lines = "\n".join(each.render() for each in plan.problems if each.severity is not Severity.INFO).splitlines()
    return "\n".join(
        line
        for line in lines
        if not line.startswith("  ") or line.startswith(("  fix", "  known", "  included", "  used by"))
    )


BASE = "plugins: [plugins]\nnodes:\n  talker: {plugin: talker}\n  listener: {plugin: listener}\n"


def test_correct_graph_has_no_problem(check):
    plan = check(BASE)
    assert rendered(plan) == ""
    assert [planned.runtime.full_name for planned in plan.nodes] == ["/talker", "/listener"]


@pytest.mark.parametrize(
    ("text", "report"),
    [
        (
            "  reader: {plugin: reader}\n",
            (
                "plugins/reader.py:6:5: error: Reader.read uses /numbers as std_msgs/msg/String, but Talker.numbers uses it "
                "as std_msgs/msg/Float64\n"
                "  fix: use one type on both ends, or remap one of them: remap: {numbers: another_name}\n"
                "  used by lab1.yaml:5:3"
            ),
        ),
        (
            "  other: {plugin: listener, subscriptions: {numbers: {durability: transient_local}}}\n",
            (
                "lab1.yaml:5:55: error: Listener.on_number of /other cannot receive /numbers from /talker: durability: volatile "
                "is offered, transient_local is requested\n"
                "  fix: write durability: volatile at lab1.yaml:5:55, or write "
                "`publishers: {/numbers: {durability: transient_local}}` below talker (lab1.yaml:3:3)"
            ),
        ),
        (
            "  other: {plugin: listener, subscriptions: {nmbers: {depth: 3}}}\n",
            "lab1.yaml:5:45: error: /other does not subscribe to nmbers\n  fix: did you mean 'numbers'?",
        ),
        (
            "  other: {plugin: talker, publishers: {imu: {depth: 3}}}\n",
            "lab1.yaml:5:40: error: /other does not publish imu\n  known: /numbers, numbers",
        ),
        (
            "  other: {plugin: listener, remap: {numbrs: /numbers}}\n",
            "lab1.yaml:5:37: error: the remap of numbrs matches no topic or service of /other\n  fix: did you mean 'numbers'?",
        ),
        (
            "  other: {plugin: listener, remap: {numbers: words}}\n",
            (
                "lab1.yaml:5:3: warning: Listener.on_number of /other receives /words, which has no publisher\n"
                "  known: /numbers; if it is published from outside: topics: {/words: {external: true}}"
            ),
        ),
        (
            "  other: {plugin: talker, parameters: {rate_hz: 1000}}\n",
            (
                "lab1.yaml:5:49: error: /other: rate_hz must be at most 100, got 1000\n"
                "  fix: allowed: greater than 0, at most 100"
            ),
        ),
        (
            "  other: {plugin: talker, parameters: {broken: true}}\n",
            (
                "plugins/talker.py:16:13: error: other cannot declare its endpoints: AttributeError: 'Talker' object has "
                "no attribute 'nothing'\n  fix: correct the line that raises AttributeError"
            ),
        ),
        (
            "  other: {plugin: initial}\n",
            (
                "lab1.yaml:5:19: error: /other cannot be built: TypeError: Initial.__init__() got an unexpected keyword "
                "argument 'name'\n  fix: write no __init__: its ends are declared in the class, or in declare(), and "
                "start() sets up the rest"
            ),
        ),
        (
            "  other: {plugin: hinting}\n",
            (
                "plugins/hinting.py:8:5: error: other cannot declare its endpoints: Hinting.on_number is annotated with "
                "'Float64', but 'Float64' is not defined when the program runs; write `from busflow.msgs.std_msgs import "
                "Float64` outside `if TYPE_CHECKING:`\n"
                "  used by lab1.yaml:5:3"
            ),
        ),
        (
            "  other: {plugin: listener, depends_on: {tlker: ready}}\n",
            (
                "lab1.yaml:5:42: error: /other depends on /tlker, which is not a node or program of this graph\n"
                "  fix: did you mean '/talker'?"
            ),
        ),
        (
            "topics: {/numbrs: {qos: sensor_data}}\n",
            "lab1.yaml:5:10: error: no node publishes or receives the topic /numbrs\n  fix: did you mean '/numbers'?",
        ),
        (
            "topics: {/numbers: {type: std_msgs/msg/String}}\n",
            (
                "lab1.yaml:5:10: error: the topic /numbers carries std_msgs/msg/Float64, not std_msgs/msg/String\n"
                "  fix: write type: std_msgs/msg/Float64"
            ),
        ),
    ],
    ids=lambda value: value.partition(":")[0].strip(),
)
def test_each_mistake_has_its_place_and_fix(check, text, report):
    lines = rendered(check(BASE + text))
    assert lines == report


@pytest.mark.parametrize(
    ("node", "fix"),
    [
        ("plugin: lonely, publishers: {imu: {depth: 3}}", "leave it out: the node does not publish any topic"),
        ("plugin: lonely, depends_on: {imu: ready}", "leave it out: the graph has no other node"),
        ("plugin: lonely, parameters: {rate: 3}", "leave it out: there are no parameters"),
        ("plugin: 'empty:Imu'", "write a class there that derives from busflow.Node"),
        ("plugin: lonely", "add a node that answers it"),
    ],
)
def test_fix_without_known_names_says_what_to_do(check, node, fix):
    plan = check(f"plugins: [plugins]\nnodes:\n  only: {{{node}}}\n")
    assert fix in [each.fix for each in plan.problems]


def test_entry_of_graph_without_topics_has_fix(check, golden):
    plan = check("plugins: [plugins]\nnodes: {a: {plugin: lonely}}\ntopics: {/imu: {qos: sensor_data}}\n")
    golden("\n".join(each.fix for each in plan.errors))


def test_missing_plugin_hides_no_other_problem(check):
    plan = check(BASE + "  lost: {plugin: taker}\n  other: {plugin: listener, remap: {x: y}}\n")
    assert [problem.code for problem in plan.errors] == ["unknown-plugin", "unused-remap"]
    assert plan.errors[0].place is not None
    assert (plan.errors[0].place.line, plan.errors[0].place.column) == (5, 18)


WRONG_DEFAULT = """
from busflow import Node, Parameters
class Rates(Parameters):
    rate_hz: float = "fast"
    name: str = "x"
class Broken(Node):
    parameters: Rates
"""


@pytest.mark.parametrize(
    ("code", "fault"),
    [
        ("import nowhere_at_all\n", "plugin-import"),
        (WRONG_DEFAULT, "declaration"),
    ],
)
def test_fault_of_a_plugin_is_reported_once(check, folder, code, fault):
    folder.write(code, "plugins/broken.py")
    plan = check("plugins: [plugins]\nnodes: {a: {plugin: broken}, b: {plugin: broken}}\n")
    assert [problem.code for problem in plan.errors] == [fault]


def test_wrong_default_hides_no_wrong_value(check, folder):
    folder.write(WRONG_DEFAULT, "plugins/broken.py")
    plan = check("plugins: [plugins]\nnodes: {a: {plugin: broken, parameters: {name: 3}}}\n")
    assert [problem.code for problem in plan.errors] == ["declaration", "wrong-type"]


def test_misspelt_name_in_declare_gets_the_nearest(check, folder):
    code = "from busflow import Node\nclass Broken(Node):\n    def declare(self):\n        self.create_publishr()\n"
    folder.write(code, "plugins/broken.py")
    (problem,) = check("plugins: [plugins]\nnodes: {a: {plugin: broken}}\n").errors
    assert problem.fix == "did you mean 'create_publisher'?"


def test_unreadable_nodes_leave_no_process_unused(folder):
    folder.write("groups: [{nodes: {a: {plugin: talker, process: motors}}}]\nprocesses: {motors: {}}\n")
    description, _ = examine("lab1.yaml", environment={})
    clock = SystemClock()
    assert Preflight(clock, Log(clock)).plan([description]).problems == []


def test_invalid_topic_name_is_reported_at_its_declaration(check):
    problem = check(BASE + "  other: {plugin: named}\n").errors[0]
    assert "not//a name" in problem.message


def test_layers_of_qos_are_merged_field_by_field(check):
    plan = check(
        BASE.replace(
            "listener: {plugin: listener}",
            "listener: {plugin: listener, subscriptions: {numbers: {overflow: drop_newest}}}",
        )
        + "topics: {/numbers: {qos: {depth: 3, reliability: best_effort, overflow: block}}}\n"
    )
    numbers = plan.nodes[1].subscriptions[0].qos
    assert (numbers.depth, numbers.overflow.value, numbers.reliability.value) == (3, "drop_newest", "best_effort")
    assert plan.nodes[0].publishers[0].qos.depth == 3


class Loud(Node):
    numbers = publisher(Float64, "numbers", qos=QoS(reliability=Reliability.BEST_EFFORT))


class Picky(Node):
    @subscription("numbers", qos=DEFAULT)
    def on_number(self, number: Float64) -> None: ...


class Wordy(Node):
    words = publisher(String, "numbers")


def test_graph_of_instances_is_checked_like_a_file():
    clock = SystemClock()
    plan = Preflight(clock, Log(clock)).plan((), [(each(), Supervision()) for each in (Loud, Picky, Wordy, Picky)])
    assert sorted(problem.code for problem in plan.errors) == [
        "duplicate-node",
        "qos-mismatch",
        "type-mismatch",
    ]
    places = {each.code: each.place.excerpt.strip() for each in plan.errors if each.place is not None}
    assert places == {
        "qos-mismatch": '@subscription("numbers", qos=DEFAULT)',
        "type-mismatch": 'words = publisher(String, "numbers")',
    }


class Receiver(Node):
    def declare(self):
        for number in range(500):
            self.create_subscription(String, f"word{number}", lambda _: None)


class Sender(Node):
    def declare(self):
        for number in range(500):
            self.create_publisher(String, f"words{number}")


def test_only_first_unmatched_topics_get_nearest_name():
    clock = SystemClock()
    plan = Preflight(clock, Log(clock)).plan((), [(each(), Supervision()) for each in (Sender, Receiver)])
    fixes = [problem.fix for problem in plan.problems if problem.code == "nobody-publishes"]
    assert len(fixes) == 500
    assert [fix for fix in fixes if fix] == fixes[:20]
    assert "words0" in fixes[0]


class Asking(Node):
    def declare(self):
        for number in range(25):
            self.create_client(Trigger, f"take{number}")


class Answering(Node):
    @service(Trigger, "takes0")
    def take(self, _: Trigger.Request) -> Trigger.Response:
        return Trigger.Response()


def test_only_first_unanswered_services_get_nearest_name():
    clock = SystemClock()
    plan = Preflight(clock, Log(clock)).plan((), [(each(), Supervision()) for each in (Asking, Answering)])
    fixes = [problem.fix for problem in plan.problems if problem.code == "nobody-answers"]
    assert [fix is not None for fix in fixes] == [True] * 20 + [False] * 5
    assert fixes[0] == "did you mean '/takes0'?"
