"""Values that YAML has read as numbers, in the environment and among the words of a command."""

from busflow.launchfile.load.variables import texts, variables
from busflow.launchfile.yaml.value import Origin, StatedBy, Value


def test_variables_are_texts_as_yaml_spells_them():
    env = Value.of({"A": "x", "B": 1, "C": 0.5, "D": True}, Origin(StatedBy.CALLER))
    assert variables(env) == {"A": "x", "B": "1", "C": "0.5", "D": "true"}


def test_words_keep_their_order():
    assert texts(["a", 2, "b", 1e6]) == ("a", "2", "b", "1000000.0")
