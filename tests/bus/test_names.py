"""Tests of `names.py`: ROS 2's own cases, and the laws of expansion and remapping."""

import string

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from busflow.bus import names
from busflow.bus.names import RemapRule, Target
from busflow.errors import InvalidName
from tests.vectors import each_case

FAULTS = {
    "topic_name": names.topic_name_fault,
    "full_topic_name": names.full_topic_name_fault,
    "namespace": names.namespace_fault,
    "node_name": names.node_name_fault,
}


def rules(case):
    """Local rules come first: that is all that makes them local."""
    texts = [*(case.get("local_rules") or []), *(case.get("global_rules") or [])]
    return [RemapRule.parse(text) for text in texts]


@each_case("b_names", "topic_name/", "full_topic_name/", "namespace/", "node_name/")
def test_name_fault_has_kind_and_index(case):
    fault = FAULTS[case["kind"]](case["input"])
    assert (fault is None) == case["valid"]
    if fault is not None:
        assert fault.kind == case["error"]
        if case["invalid_index"] is not None:
            assert fault.index == case["invalid_index"]


@each_case("b_names", "hidden/")
def test_part_with_leading_underscore_hides_a_name(case):
    assert names.is_hidden(case["input"]) == case["expect"]


EXPAND_ERRORS = {
    "topic_name_invalid": "^topic name ",
    "node_name_invalid": "^node name ",
    "namespace_invalid": "^namespace ",
    "unknown_substitution": "nothing is known by the name between these braces",
}


@each_case("b_names", "expand/")
def test_names_expand_as_in_ros(case):
    def expand():
        return names.expand(
            case["topic"],
            node=case["node"],
            namespace=case["namespace"],
            substitutions=case.get("substitutions"),
        )

    if case["error"]:
        with pytest.raises(InvalidName, match=EXPAND_ERRORS[case["error"]]):
            expand()
    else:
        assert expand() == case["expect"]


@each_case("b_names", "remap/")
def test_the_first_rule_that_matches_renames(case):
    context = {"node": case["node"], "namespace": case["namespace"] or "/"}
    rule = names.remap(Target(case["what"]), rules(case), name=case["name"] or "", **context)
    new = rule and rule.replacement
    if new and case["what"] in ("topic", "service"):
        new = names.expand(new, **context)
    assert new == case["expect"]


@each_case("b_names", "resolve/")
def test_resolving_expands_then_remaps_once(case):
    remaps = [] if case["only_expand"] else rules(case)
    resolved = names.resolve(case["name"], node=case.get("node") or "node", namespace=case["namespace"], remaps=remaps)
    assert resolved.name == case["expect"]


@each_case("b_names", "fqn/")
def test_a_node_has_one_full_name(case):
    applied = rules(case if case["use_global"] else {**case, "global_rules": []})
    node, namespace = case["node"], case["namespace"] or ""
    if rule := names.remap(Target.NODE, applied, node=node):
        node = rule.replacement
    if rule := names.remap(Target.NAMESPACE, applied, node=node):
        namespace = rule.replacement
    assert names.fully_qualified(node, namespace) == case["expect"]


@each_case("b_names", "remap_rule/")
def test_remap_rule_is_read_or_refused(case):
    if case["valid"]:
        assert RemapRule.parse(case["input"])
    else:
        with pytest.raises(InvalidName):
            RemapRule.parse(case["input"])


def test_error_marks_the_character_and_states_the_fix(golden):
    with golden.raises(InvalidName):
        names.check_topic_name("imu/da ta")


def test_unknown_substitution_suggests_a_known_one(golden):
    with golden.raises(InvalidName):
        names.expand("{nod}/x", node="n", namespace="/")


@pytest.mark.parametrize("name", ["a\x1b[31m", "a\nb", "\u202egnp", "a\u0660", "é", "a" * 5000 + " "])
def test_error_text_is_escaped_and_bounded(name):
    with pytest.raises(InvalidName) as caught:
        names.check_topic_name(name)
    text = str(caught.value)
    assert len(text) < 1000
    assert all(line.isprintable() for line in text.splitlines())
    assert len(text.splitlines()) == 3


@pytest.mark.parametrize("check", [names.check_node_name, names.check_namespace, names.check_full_topic_name])
def test_a_trailing_newline_is_not_overlooked(check):
    with pytest.raises(InvalidName):
        check("/a\n")


@pytest.mark.parametrize(
    ("find", "name", "kind", "index"),
    [
        (names.topic_name_fault, "7_up", "token_starts_with_number", 0),
        (names.topic_name_fault, "~f", "tilde_not_followed_by_slash", 1),
        (names.topic_name_fault, "{~}", "misplaced_tilde", 1),
        (names.full_topic_name_fault, "/a/1b//c", "token_starts_with_number", 3),
        (names.full_topic_name_fault, "/a//b/1c", "repeated_slash", 3),
        (names.full_topic_name_fault, "/1", "token_starts_with_number", 1),
        (names.full_topic_name_fault, "//1", "repeated_slash", 1),
    ],
)
def test_first_fault_of_a_name_is_reported(find, name, kind, index):
    fault = find(name)
    assert (fault.kind, fault.index) == (kind, index)


def test_substituted_text_is_checked_by_resolve(golden):
    assert names.expand("/foo/{ns}", node="n", namespace="/ns") == "/foo//ns"
    with golden.raises(InvalidName):
        names.resolve("/foo/{ns}", node="n", namespace="/ns")


def test_a_launch_file_can_rename_every_topic_name(golden):
    """ROS 2's rule syntax has no way to write two underscores; a mapping has."""
    resolved = names.resolve("a__b", node="n", namespace="/", remaps={"{ns}": "c", "a__b": "~/c"})
    assert resolved == names.Resolved("/n/c", "a__b")
    with golden.raises(InvalidName):
        names.resolve("a", node="n", namespace="/", remaps={"a": "b c"})


def test_a_service_rule_leaves_topics_alone():
    only_services = [RemapRule.parse("rosservice://reset:=other")]
    assert names.resolve("reset", node="n", namespace="/", remaps=only_services).name == "/reset"
    assert names.resolve("reset", node="n", namespace="/", remaps=only_services, service=True).name == "/other"


@pytest.mark.parametrize("text", ["a" * 50_000, "a_" * 25_000, "a/" * 25_000 + ":=", "a." * 25_000 + "!"])
def test_refusing_a_long_rule_takes_no_time(text):
    with pytest.raises(InvalidName):
        RemapRule.parse(text)


LETTERS = string.ascii_letters + "_"
part = st.builds("{}{}".format, st.sampled_from(LETTERS), st.text(LETTERS + string.digits, max_size=8))
relative = st.lists(part, min_size=1, max_size=4).map("/".join)
absolute = relative.map("/{}".format)
namespaces = st.just("/") | absolute


@given(absolute, part, namespaces)
def test_an_absolute_name_expands_to_itself(name, node, namespace):
    assert names.expand(name, node=node, namespace=namespace) == name


@given(relative | relative.map("~/{}".format) | st.just("~"), part, namespaces)
def test_expansion_is_absolute_valid_and_done_once(name, node, namespace):
    full = names.expand(name, node=node, namespace=namespace)
    assert names.full_topic_name_fault(full) is None
    assert names.expand(full, node="other", namespace="/elsewhere") == full


@given(relative, part, namespaces)
def test_a_private_name_lies_beneath_its_node(name, node, namespace):
    full = names.expand(f"~/{name}", node=node, namespace=namespace)
    assert full == f"{names.fully_qualified(node, namespace)}/{name}"


@given(relative, relative, relative, namespaces)
def test_a_rule_is_applied_once(first, second, third, namespace):
    remaps = {first: second, second: third}
    resolved = names.resolve(first, node="n", namespace=namespace, remaps=remaps)
    assert resolved.name == names.expand(remaps[first], node="n", namespace=namespace)


@given(st.text(max_size=30))
@example("/a" * 200)
def test_every_check_agrees_with_the_grammar(text):
    """What is a full name is a topic name too and can be used; a fault lies within the name."""
    for fault in (find(text) for find in FAULTS.values()):
        assert fault is None or 0 <= fault.index < max(1, len(text))
    if names.full_topic_name_fault(text) is None:
        assert names.topic_name_fault(text) is None
        assert names.resolve(text, node="n", namespace="/").name == text
    if names.namespace_fault(text) is None and text != "/":
        assert names.full_topic_name_fault(text) is None
