"""Tests of `events.py`: each change of an endpoint's state makes one event."""

from __future__ import annotations

from collections import Counter

from busflow.bus.events import LivelinessChanged, MessageLost, Notices, PublisherMatched


def test_each_change_of_matching_makes_one_event():
    notices = Notices(before=1)
    assert list(notices.matching(PublisherMatched, "/a", 3, 2)) == [PublisherMatched("/a", 2, 2, 2, 2)]
    assert list(notices.matching(PublisherMatched, "/a", 3, 2)) == []
    assert list(notices.matching(PublisherMatched, "/a", 3, 1)) == [PublisherMatched("/a", 2, 0, 1, -1)]


def test_each_change_of_liveliness_makes_one_event():
    notices = Notices()
    assert list(notices.liveliness("/a", 0, 0)) == []
    assert list(notices.liveliness("/a", 1, 1)) == [LivelinessChanged("/a", 1, 1)]
    assert list(notices.liveliness("/a", 1, 1)) == []


def test_unwanted_messages_are_not_reported_as_lost():
    notices = Notices()
    drops = Counter(overflow=2, expired=5, superseded=1)
    assert list(notices.losses("/a", drops)) == [MessageLost("/a", 2, 2)]
    drops["expired"] += 1
    assert list(notices.losses("/a", drops)) == []
    drops["overflow"] += 1
    assert list(notices.losses("/a", drops)) == [MessageLost("/a", 3, 1)]
