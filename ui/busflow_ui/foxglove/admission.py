"""Admission: accepts or refuses connections by the page and the address that their handshake names.

A page of any site that is open in a browser may connect to a port of this machine. The browser names the page's site in
`Origin`. Only browsers need this check: any other program can do as much in other ways. `Host` is the name by which the
server was found; a foreign one belongs to a site whose name was made to lead to this machine.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence
from urllib.parse import urlsplit

APPS = ("https://app.foxglove.dev", "file://")
"""Origins of Foxglove in the browser, and of installed viewers such as Lichtblick's desktop application."""


class Admission:
    """Accepts or refuses handshakes.

    >>> gate = Admission("127.0.0.1", ["http://robot.lab:8080"])
    >>> gate.refusal("localhost:8765", "https://app.foxglove.dev"), gate.refusal("127.0.0.1:8765", None)
    (None, None)
    >>> gate.refusal("localhost:8765", "https://evil.example")
    'a page of https://evil.example may not connect; --allow-origin https://evil.example lets it'
    """

    def __init__(self, host: str, origins: Sequence[str] = ()) -> None:
        """Set which viewers may connect.

        Args:
            host: the address at which we are; where it is this machine's own, we have to be found by one of its names.
            origins: pages that may connect beside this machine's own and the viewers'.
        """
        self._host, self._origins = host.casefold(), {*APPS, *origins}
        self._is_local = is_local(host)

    def refusal(self, host: str | None, origin: str | None) -> str | None:
        """Return why a handshake with these headers is refused; None if it is accepted."""
        if self._is_local and not self._is_here(_name_of(f"//{host}") if host else None):
            return f"there is no {host} here; connect to localhost"
        if origin is None or origin in self._origins:
            return None
        page = _name_of(origin)
        if page is not None and is_local(page) and origin.startswith(("http://", "https://")):
            return None
        return f"a page of {origin} may not connect; --allow-origin {origin} lets it"

    def _is_here(self, name: str | None) -> bool:
        return name is not None and (is_local(name) or name == self._host)


def is_local(host: str) -> bool:
    """Return whether a name or address means this machine and nothing beyond it.

    >>> [is_local(each) for each in ("localhost", "127.0.0.1", "::1", "0.0.0.0", "robot.lab")]
    [True, True, True, False, False]
    """
    if host.casefold() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _name_of(address: str) -> str | None:
    """Return the host name in an address, without the port; None if there is none."""
    try:
        return urlsplit(address).hostname
    except ValueError:
        return None
