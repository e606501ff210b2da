"""A sentence of a model is shown only if the cited text supports it: `support` and `grounding`."""

import pytest

from busflow_assistant.support import Unsupported, unsupported

TEXT = (
    "`sensor_publisher` publishes IMU readings on `/imu/data` at 10 Hz. A message that is lost is not sent again. "
    "Ten joints are read every 100 ms."
)


@pytest.mark.parametrize(
    "sentence",
    [
        "The sensor_publisher publishes readings at 10 Hz.",
        "It publishes at 10.0 hertz on /imu/data.",
        "A lost message is not sent again.",
        "10 joints are read.",
    ],
)
def test_supported_sentence_is_shown(sentence):
    assert unsupported(sentence, TEXT) is None


@pytest.mark.parametrize(
    ("sentence", "why"),
    [
        ("It publishes at 20 Hz.", Unsupported.NUMBER),
        ("It publishes at 10 kHz.", Unsupported.NUMBER),
        ("Twelve joints are read.", Unsupported.NUMBER),
        ("Joints are read every 100 s.", Unsupported.NUMBER),
        ("It publishes on /joint_states.", Unsupported.NAME),
        ("The readings are published by Gazebo.", Unsupported.NAME),
        ("A lost message is sent again.", Unsupported.NEGATION),
        ("The joints are not read.", Unsupported.NEGATION),
        ("Readings are filtered by a Kalman estimator.", Unsupported.NAME),
        ("Readings are filtered and smoothed afterwards.", Unsupported.WORDS),
        ("Yes, it does.", Unsupported.NOTHING),
        ("The text does not say that.", Unsupported.NOTHING),
    ],
)
def test_sentence_without_support_is_withheld(sentence, why):
    assert unsupported(sentence, TEXT) is why
