"""Tests of `qos.py`: ROS 2's profiles and words, and the merge of layers."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from busflow.bus import qos
from busflow.bus.qos import (
    PRESETS,
    Durability,
    History,
    Liveliness,
    Overflow,
    QoS,
    Reliability,
    checked_qos,
    qos_faults,
)
from busflow.errors import InvalidDeclaration
from tests.vectors import each_case

POLICIES = {
    "history": History, "reliability": Reliability, "durability": Durability, "liveliness": Liveliness,
}  # fmt: skip


def profile(fields):
    """A case's profile. The history is left out where it decides nothing, for busflow has but one."""
    names = {"lease_ns": "lease_s", "deadline_ns": "deadline_s", "lifespan_ns": "lifespan_s"}
    known = {names.get(key, key): value for key, value in fields.items() if key not in ("history", "id")}
    for name in set(names.values()) & {names.get(key) for key in fields if key.endswith("_ns")}:
        known[name] = known[name] / 1e9 if known[name] is not None else None
    return QoS.model_validate(known)


@each_case("a_qos_profiles", "preset/")
def test_presets_are_those_of_ros_2(case):
    preset = PRESETS[case["name"]]
    assert {name: getattr(preset, name) for name in case["expect"]} == case["expect"]


@each_case("a_qos_profiles", "construct/")
def test_profile_holds_what_it_is_given(case):
    fields = case["input"]
    if "equal" in case["expect"]:
        assert (profile(fields["a"]) == profile(fields["b"])) == case["expect"]["equal"]
        return
    made = profile(fields)
    for name in case["expect"].keys() - {"ok", "roundtrip"}:
        assert getattr(made, name) == case["expect"][name]
    assert QoS.model_validate(made.model_dump()) == made
    assert QoS.model_validate_json(made.model_dump_json()) == made


@each_case("a_qos_profiles", "shortkey/", "string/")
def test_policies_have_the_words_of_ros(case):
    policy = POLICIES[case["policy"]]
    found = {
        "policy_from_short_key": lambda: policy(case["input"]).name,
        "string_roundtrip": lambda: policy.read(case["input"]).word,
        "from_string": lambda: policy.read(case["input"]).value,
        "to_string": lambda: policy(case["input"]).word,
    }[case["kind"]]
    assert found() == case["expect"]


@pytest.mark.parametrize("depth", [0, -1, True, "5", 2.0, None])
def test_a_depth_is_a_whole_number_above_zero(depth):
    with pytest.raises(InvalidDeclaration):
        QoS(depth=depth)
    assert [fault.path for fault in qos_faults({"depth": depth})] == [("depth",)]


def test_a_misspelt_qos_field_is_put_right(golden):
    with golden.raises(InvalidDeclaration):
        QoS(deadlne_s=1)


def test_a_profile_cannot_change():
    with pytest.raises(ValidationError):
        QoS().depth = 5
    assert len({QoS(), QoS(depth=10)}) == 1


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("50ms", 0.05), ("1s", 1.0), (2, 2.0), (0.5, 0.5), (None, None), (math.inf, None), ("1ns", 1e-9)],
)
@pytest.mark.parametrize("word", ["deadline", "lifespan", "lease"])
def test_time_limits_are_seconds_or_have_a_unit(word, text, seconds):
    assert getattr(QoS.model_validate({word: text}), f"{word}_s") == seconds
    assert getattr(QoS.model_validate({f"{word}_s": text}), f"{word}_s") == seconds
    assert qos_faults({word: text}) == ()


@pytest.mark.parametrize("text", ["soon", "5", "-1s", 0, -1, True, math.nan, [], "1e9999s", 1e300])
def test_invalid_duration_is_a_fault_at_its_key(text):
    (fault,) = qos_faults({"depth": 3, "deadline": text})
    assert fault.path == ("deadline",)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("relaibility", "reliable"),
        ("deadlin", 1),
        ("history", "keep_all"),
        ("reliability", "relable"),
        ("durability", "unknown"),
        ("deadline_s", 1),
    ],
)
def test_wrong_key_or_word_gets_a_suggestion(golden, key, value):
    (fault,) = qos_faults({"deadline": 1, key: value} if key == "deadline_s" else {key: value})
    assert fault.path == (key,)
    golden(f"{fault.message}: {fault.fix}")


def test_habits_of_rclpy_are_answered(golden):
    with golden.raises(InvalidDeclaration):
        QoS(10)
    with golden.raises(InvalidDeclaration):
        QoS(history="keep_last")


def test_all_faults_are_reported_at_once():
    faults = qos_faults({"depth": 0, "lease": "x", "overflow": "explode", "foo": 1})
    assert sorted(fault.path[0] for fault in faults) == ["depth", "foo", "lease", "overflow"]


layers = st.lists(
    st.fixed_dictionaries(
        {},
        optional={
            "depth": st.integers(1, 99),
            "overflow": st.sampled_from(Overflow),
            "durability": st.sampled_from(["volatile", "transient_local"]),
            "deadline": st.none() | st.sampled_from([1, 2.5, "10ms"]),
        },
    ),
    max_size=4,
)


@given(layers)
def test_last_layer_that_states_a_field_wins(stated):
    merged = QoS.merge(*(QoS.model_validate(layer) for layer in stated))
    assert merged == QoS.model_validate(dict(itertools.chain.from_iterable(layer.items() for layer in stated)))
    assert merged.model_fields_set == {{"deadline": "deadline_s"}.get(key, key) for layer in stated for key in layer}


@given(layers, st.integers(0, 4))
def test_merging_in_two_steps_is_merging_at_once(stated, cut):
    all_layers = [QoS.model_validate(layer) for layer in stated]
    assert QoS.merge(QoS.merge(*all_layers[:cut]), *all_layers[cut:]) == QoS.merge(*all_layers)


def test_a_layer_alone_is_the_profile_itself():
    latched = QoS(durability=Durability.TRANSIENT_LOCAL)
    assert QoS.merge(latched) is latched
    assert QoS.merge() is QoS.merge()
    assert QoS.merge(qos.SYSTEM_DEFAULT) is not qos.SYSTEM_DEFAULT


def test_system_default_brings_busflows_default_back():
    latched = QoS(durability=Durability.TRANSIENT_LOCAL)
    assert QoS.merge(latched, qos.SYSTEM_DEFAULT).durability is Durability.VOLATILE
    assert QoS.merge(latched, QoS.merge(qos.SYSTEM_DEFAULT)).durability is Durability.VOLATILE


def test_schema_uses_the_yaml_names():
    schema = QoS.model_json_schema()
    properties = schema["properties"]
    assert {"deadline", "lifespan", "lease", "block_timeout", "depth", "overflow"} <= properties.keys()
    assert all("description" in entry or "$ref" in entry for entry in properties.values())
    assert all(entry["description"] for entry in schema["$defs"].values())


@pytest.mark.parametrize("given", [5, 0, True, "reliable"])
def test_bare_depth_is_answered_with_a_profile(golden, given):
    with golden.raises(InvalidDeclaration):
        checked_qos(given, "publisher(…)")
