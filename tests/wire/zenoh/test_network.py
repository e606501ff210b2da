"""What the clients of a machine's session may do, by the role of their certificate."""

from typing import Any

from busflow.launchfile.model.network import Role
from busflow.wire.zenoh.network import Network


def flows(access: dict[str, Any], client: str) -> set[tuple[str, str]]:
    """Each message kind that a client's certificate admits, with its direction."""
    subjects = {each["id"] for each in access["subjects"] if client in each.get("cert_common_names", ())}
    rules = {rule for each in access["policies"] if subjects & set(each["subjects"]) for rule in each["rules"]}
    return {
        (message, flow)
        for rule in access["rules"]
        if rule["id"] in rules
        for message in rule["messages"]
        for flow in rule["flows"]
    }


def test_without_allowed_clients_no_access_rules_are_needed():
    assert "access_control" not in Network(dials=()).settings()


def test_a_reader_receives_and_never_publishes():
    allow = {"desk": Role.READ, "tablet": Role.ALL}
    access = Network(dials=(), machines=("arm",), allow=allow).settings()["access_control"]
    assert access["default_permission"] == "deny"
    assert ("put", "egress") in flows(access, "desk")
    assert (
        flows(access, "desk") & {("put", "ingress"), ("delete", "ingress"), ("declare_queryable", "ingress")} == set()
    )
    assert flows(access, "tablet") == flows(access, "arm") >= {("put", "ingress"), ("put", "egress")}
    assert flows(access, "stranger") == set()
