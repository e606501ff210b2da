"""Groups and defaults: settings that several nodes share."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.launchfile.load.load import examine
from busflow.launchfile.load.merge import compose

ARMS = """
    defaults:
      parameters: {rate: 1, noise: {imu: 1, joints: 1}}
      restart: on-failure
    groups:
      arms:
        namespace: arms
        defaults:
          parameters: {rate: 2}
        nodes:
          left: {plugin: talker}
          right: {plugin: talker, namespace: r, parameters: {rate: 3, noise: {imu: 3}}}
    nodes:
      head: {plugin: talker}
    """


def test_nodes_of_a_group_share_its_namespace(folder):
    assert [each.full_name for each in folder.load(ARMS).nodes] == ["/head", "/arms/left", "/arms/r/right"]


def test_nearer_default_wins_and_node_overrides_all(folder):
    parameters = {each.name: each.parameters.data for each in folder.load(ARMS).nodes}
    assert parameters == {
        "head": {"rate": 1, "noise": {"imu": 1, "joints": 1}},
        "left": {"rate": 2, "noise": {"imu": 1, "joints": 1}},
        "right": {"rate": 3, "noise": {"imu": 3, "joints": 1}},
    }


def test_default_is_reported_where_it_is_stated(folder):
    left = next(each for each in folder.load(ARMS).nodes if each.name == "left")
    assert str(left.parameters.find(("rate",)).origin) == "lab1.yaml:9:26"
    assert str(left.parameters.find(("noise", "imu")).origin) == "lab1.yaml:3:38"
    assert str(left.origin) == "lab1.yaml:11:7"


def test_parameter_file_overrides_defaults(folder):
    folder.write("a: file\nb: file\n", "p.yaml")
    found = folder.load("""
        defaults: {parameters: {a: default, b: default, c: default}}
        nodes: {x: {plugin: talker, parameters_from: p.yaml, parameters: {b: node}}}
        """)
    assert found.nodes[0].parameters.data == {"a": "file", "b": "node", "c": "default"}


def test_defaults_do_not_reach_included_files(folder):
    folder.write("nodes: {inner: {plugin: talker}}\n", "inner.yaml")
    found = folder.load("defaults: {parameters: {a: 1}}\ninclude: inner.yaml\nnodes: {x: {plugin: talker}}\n")
    assert {each.name: each.parameters.data for each in found.nodes} == {"inner": {}, "x": {"a": 1}}


def test_group_may_hold_topics_includes_and_groups(folder):
    folder.write("nodes: {inner: {plugin: talker}}\ntopics: {t: {qos: {depth: 1}}}\n", "inner.yaml")
    found = folder.load("""
        namespace: robot
        groups:
          arm:
            for_each: {side: [left, right]}
            namespace: ${each.side}
            include: inner.yaml
            topics: {imu: {qos: {depth: 2}}, /clock: {qos: {depth: 3}, when: "${each.side == 'left'}"}}
            groups:
              hand:
                namespace: hand
                nodes:
                  finger_${each.n}: {plugin: talker, for_each: {n: [1, 2]}, parameters: {side: "${each.side}"}}
              floor:
                namespace: /floor/${each.side}
                nodes: {sole: {plugin: talker}}
        """)
    names = [each.full_name for each in found.nodes]
    fingers = [f"/robot/{side}/hand/finger_{n}" for side in ("left", "right") for n in (1, 2)]
    assert sorted(names) == sorted([
        *fingers, "/floor/left/sole", "/floor/right/sole", "/robot/left/inner", "/robot/right/inner"
    ])  # fmt: skip
    sides = [each.parameters.data["side"] for each in found.nodes if "finger" in each.name]
    assert sides == ["left", "left", "right", "right"]
    topics = {each.topic: each.qos.depth for each in found.topics}
    assert topics == {"/robot/left/imu": 2, "/robot/right/imu": 2, "/clock": 3, "/robot/left/t": 1, "/robot/right/t": 1}


@pytest.mark.parametrize(("when", "expected"), [("true", ["/a", "/b"]), ("false", ["/a"])])
def test_omitted_group_omits_all_its_entries(folder, when, expected):
    folder.write("nodes: {}", "inner.yaml")
    text = f"""
        nodes: {{a: {{plugin: talker}}}}
        groups:
          g:
            when: {when}
            groups: {{h: {{nodes: {{b: {{plugin: talker}}}}, topics: {{t: {{qos: default}}}}}}}}
            include: {"inner" if when == "true" else "there_is_none"}.yaml
        """
    found = folder.load(text)
    assert [each.full_name for each in found.nodes] == expected
    assert len(found.topics) == len(expected) - 1


def test_entry_without_plugin_changes_an_expanded_node(folder):
    found = folder.load("""
        nodes:
          left/imu: {parameters: {b: 2}}
          head_${each.n}: {plugin: talker, for_each: {n: [1, 2]}, parameters: {a: 1}}
          head_2: {parameters: {a: 3}}
        groups:
          arms:
            for_each: {side: [left, right]}
            namespace: ${each.side}
            nodes: {imu: {plugin: talker, parameters: {a: 1}}}
        """)
    assert {each.full_name: each.parameters.data for each in found.nodes} == {
        "/left/imu": {"a": 1, "b": 2},
        "/right/imu": {"a": 1},
        "/head_1": {"a": 1},
        "/head_2": {"a": 3},
    }


NAMES = st.sampled_from(["a", "b", "/c", None])


@given(outer=NAMES, groups=st.lists(NAMES, min_size=1, max_size=3), inner=NAMES)
def test_namespaces_compose_however_deep_the_groups_are(outer, groups, inner, tmp_path_factory):
    text = f"{{n: {{plugin: talker, namespace: {inner or ''}}}}}"
    body = f"nodes: {text}"
    for each in reversed(groups):
        body = f"groups: {{g: {{namespace: {each or ''}, {body}}}}}"
    file = tmp_path_factory.mktemp("groups") / "lab.yaml"
    file.write_text(f"namespace: {outer or ''}\n{body}\n")
    found, problems = examine(file, environment={})
    assert problems == ()
    assert found is not None
    expected = "/"
    for each in (outer, *groups, inner):
        expected = compose(expected, each)
    assert found.nodes[0].namespace == expected


def test_dependencies_of_a_group_node_are_in_it(folder):
    found = folder.load("""
        namespace: robot
        groups:
          arm:
            for_each: {side: [left, right]}
            namespace: ${each.side}
            defaults: {restart: {policy: on-failure, max: 3}}
            nodes:
              imu: {plugin: talker, restart: never}
              filter: {plugin: talker, depends_on: {imu: ready, /robot/head: started}}
        nodes:
          head: {plugin: talker}
        """)
    filters = {each.full_name: each.supervision for each in found.nodes if each.name == "filter"}
    assert {name: set(each.depends_on) for name, each in filters.items()} == {
        "/robot/left/filter": {"/robot/left/imu", "/robot/head"},
        "/robot/right/filter": {"/robot/right/imu", "/robot/head"},
    }
    assert {each.restart.most for each in filters.values()} == {3}
