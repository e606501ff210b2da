"""Connections: what a viewer knows, brought from one state to another, is the other."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from busflow_ui.foxglove.connections import Connections

ENDS = st.dictionaries(
    st.sampled_from(["/a", "/b", "/c"]), st.lists(st.sampled_from(["/x", "/y"]), min_size=1, unique=True).map(tuple)
)
CONNECTIONS = st.builds(Connections, ENDS, ENDS, ENDS)


def applied(former: Connections, told: Any) -> Connections:
    """What a viewer comes to that knew the former ones."""
    rows = [
        (former.published, told["publishedTopics"], "publisherIds", told["removedTopics"]),
        (former.subscribed, told["subscribedTopics"], "subscriberIds", told["removedTopics"]),
        (former.services, told["advertisedServices"], "providerIds", told["removedServices"]),
    ]
    found = [
        {name: ids for name, ids in (ends | {row["name"]: tuple(row[word]) for row in new}).items() if name not in gone}
        for ends, new, word, gone in rows
    ]
    return Connections(*({name: ids for name, ids in ends.items() if ids} for ends in found))


@given(CONNECTIONS, CONNECTIONS)
def test_the_difference_leads_from_one_to_the_other(former: Connections, now: Connections):
    told = now.since(former)
    assert applied(former, told) == now
    assert any(told.values()) == (former != now)
