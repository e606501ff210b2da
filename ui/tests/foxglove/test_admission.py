"""Admission: which pages and names a handshake may have."""

import pytest

from busflow_ui.foxglove.admission import Admission, is_local


@pytest.mark.parametrize(
    "host", ["localhost", "localhost:8765", "127.0.0.1:1", "127.9.9.9:1", "[::1]:8765", "LOCALHOST"]
)
def test_this_machines_own_names_are_let_in(host: str):
    assert Admission("127.0.0.1").refusal(host, None) is None


@pytest.mark.parametrize(
    "host", [None, "", "evil.example", "evil.example:8765", "127.0.0.1.evil.example", "[::1", "0.0.0.0:1"]
)
def test_other_names_are_refused(host: str | None):
    assert Admission("127.0.0.1").refusal(host, None) is not None


def test_by_which_name_others_find_us_is_theirs():
    assert Admission("0.0.0.0").refusal("robot.lab:8765", None) is None  # noqa: S104  # what a user may ask for


@pytest.mark.parametrize(
    "origin",
    [
        "https://app.foxglove.dev",
        "file://",
        "http://localhost",
        "https://localhost:8080",
        "http://[::1]:3",
        "http://a.lab:80",
    ],
)
@pytest.mark.parametrize("host", ["127.0.0.1", "192.168.1.5"])
def test_these_pages_are_let_in(origin: str, host: str):
    assert Admission(host, ["http://a.lab:80"]).refusal(f"{host}:1", origin) is None


@pytest.mark.parametrize(
    "origin",
    [
        "",
        "null",
        "https://evil.example",
        "http://app.foxglove.dev",
        "https://app.foxglove.dev.evil.example",
        "http://localhost.evil.example",
        "http://evil.example@evil.example",
        "chrome-extension://localhost",
        "http://a.lab",
        "http://[",
    ],
)
@pytest.mark.parametrize("host", ["127.0.0.1", "192.168.1.5"])
def test_other_pages_are_refused(origin: str, host: str):
    refusal = Admission(host, ["http://a.lab:80"]).refusal(f"{host}:1", origin)
    assert refusal == f"a page of {origin} may not connect; --allow-origin {origin} lets it"


def test_only_addresses_of_this_machine_are_local():
    assert [is_local(each) for each in ("127.0.0.1", "::1", "Localhost", "10.0.0.1", "::", "")] == [True] * 3 + [
        False
    ] * 3
