"""Profiles, and the variables that `env` states."""

from functools import reduce
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from busflow.launchfile.load.expand import readable
from busflow.launchfile.load.expression import Scope
from busflow.launchfile.load.profiles import chosen, from_command_line
from busflow.launchfile.model.description import ClockMode
from busflow.launchfile.model.problems import Problems
from busflow.launchfile.yaml.document import Limits
from busflow.launchfile.yaml.value import Origin, StatedBy, Value

LAB = """
    args:
      rate: {type: float, default: 1, max: 50}
    nodes:
      talker: {plugin: talker, parameters: {rate: "${args.rate}", a: file}}
      camera: {plugin: camera}
    profiles:
      fast: {args: {rate: {default: 10}}}
      ci:
        clock: {mode: sim}
        seed: 7
        nodes: {camera: {when: false}, talker: {parameters: {a: ci}}}
    """


def test_without_a_choice_no_profile_holds(folder):
    found = folder.load(LAB)
    assert ([each.name for each in found.nodes], found.seed) == (["talker", "camera"], None)
    assert found.nodes[0].parameters.data == {"rate": 1.0, "a": "file"}


def test_profile_overrides_file_but_not_command_line(folder):
    found = folder.load(LAB, profiles=["ci"], sets=["seed=8"])
    assert ([each.name for each in found.nodes], found.seed, found.clock.mode) == (["talker"], 8, ClockMode.SIM)
    assert str(found.nodes[0].parameters.find(("a",)).origin) == "lab1.yaml:12:61"


def test_several_profiles_hold_together(folder):
    talker, *_ = folder.load(LAB, profiles=["fast", "ci"]).nodes
    assert talker.parameters.data == {"rate": 10.0, "a": "ci"}
    assert folder.load(LAB, profiles=["fast"], assignments=["rate:=20"]).nodes[0].parameters.data["rate"] == 20.0


def test_file_states_its_default_profile(folder):
    text = "    profile: ${env.LAB_PROFILE:-fast}" + LAB
    assert folder.load(text).nodes[0].parameters.data["rate"] == 10.0
    assert folder.load(text, profiles=["ci"]).nodes[0].parameters.data["rate"] == 1.0
    assert folder.load(text, env={"LAB_PROFILE": "ci"}).seed == 7


def test_an_include_chooses_the_profile_of_its_file(folder):
    folder.write(LAB, "inner.yaml")
    found = folder.load("include: [{file: inner.yaml, profile: ci, namespace: x}]\n")
    assert [each.full_name for each in found.nodes] == ["/x/talker"]
    assert folder.load("include: inner.yaml\n").seed is None


def test_unknown_profile_is_reported_at_its_request(folder, golden):
    golden(folder.report(LAB, profiles=["sci"]))


plain: Any = st.recursive(st.integers(0, 3), lambda inner: st.dictionaries(st.sampled_from("abc"), inner), max_leaves=6)
trees: Any = st.dictionaries(st.sampled_from("abc"), plain)


def merged(below: Any, above: Any) -> Any:
    if not (isinstance(below, dict) and isinstance(above, dict)):
        return above
    return {key: merged(below[key], above[key]) if key in below and key in above else (above | below | above)[key]
            for key in below | above}  # fmt: skip


@given(base=trees, overlays=st.lists(trees, max_size=3))
def test_last_chosen_profile_wins(base: Any, overlays: list[Any]):
    data = base | {"profiles": {str(n): each for n, each in enumerate(overlays)}}
    root = Value.of(data, Origin(StatedBy.CALLER))
    problems = Problems()
    under = chosen(root, from_command_line(map(str, range(len(overlays)))), Scope({}), problems)
    assert problems.sorted([]) == ()
    assert under.without(("profiles",)).data == reduce(merged, overlays, base)


def test_unchosen_profile_needs_no_variables():
    profiles = Value.of({"ci": {"seed": "${env.NO}", "name": "x"}}, Origin(StatedBy.CALLER))
    assert readable(profiles, Scope({}), Limits()).data == {"ci": {"name": "x"}}


def test_stated_variables_reach_expressions_and_includes(folder):
    folder.write(
        'env: {ROBOT: inner, B: 2}\nnodes: {b: {plugin: "${env.ROBOT}", parameters: {b: "${env.B}"}}}', "b.yaml"
    )
    text = """
        env: {ROBOT: "${env.ROBOT:-r1}", THREADS: 1, QUIET: true}
        include: b.yaml
        nodes: {a: {plugin: "${env.ROBOT}", parameters: {threads: "${env.THREADS}"}}}
        """
    found = folder.load(text)
    assert {each.name: (each.plugin, each.parameters.data) for each in found.nodes} == {
        "a": ("r1", {"threads": 1}),
        "b": ("r1", {"b": 2}),
    }
    assert found.environment == {"ROBOT": "r1", "B": "2", "THREADS": "1", "QUIET": "true"}
    assert folder.load(text, env={"ROBOT": "r2"}).environment["ROBOT"] == "r2"


def test_nul_byte_in_a_variable_is_named(folder, golden):
    report = folder.report('env: {A: "x\\0y"}\nnodes: {}\n')
    golden(report.splitlines()[0])
