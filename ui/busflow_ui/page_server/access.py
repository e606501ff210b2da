"""Access: which browsers are let in, and what they may do: by their token, and by the page that they show."""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Sequence
from enum import StrEnum
from urllib.parse import urlsplit

from busflow_ui.foxglove.admission import Admission


class Access(StrEnum):
    """Rights of a page."""

    CONTROL = "control"
    READ_ONLY = "read-only"
    ASK = "ask"
    """The assistant may be asked, and nothing else be seen."""


class Tokens:
    """Secrets of one start of the server: for its own page, and for pages of other sites that look, or only ask."""

    def __init__(self, *, read_only: bool) -> None:
        """Draw them; with `read_only` the own page may only look too."""
        self.own: str = secrets.token_urlsafe(32)
        self.foreign: str = secrets.token_urlsafe(32)
        self.ask: str = secrets.token_urlsafe(32)
        self._read_only = read_only

    def access(self, token: str, *, is_foreign: bool) -> Access | None:
        """Return the rights that a token gives; None if it is wrong.

        A page of another site may only look, whatever its token. Each comparison takes the same time for every token.
        """
        given = token.encode(errors="replace")
        is_own = hmac.compare_digest(given, self.own.encode())
        is_guest = hmac.compare_digest(given, self.foreign.encode())
        if hmac.compare_digest(given, self.ask.encode()):
            return Access.ASK
        if not is_own and not is_guest:
            return None
        return Access.CONTROL if is_own and not is_foreign and not self._read_only else Access.READ_ONLY


class PageAdmission:
    """Accepts handshakes of the page itself, of the named sites, and of programs that are no browser."""

    def __init__(self, host: str, origins: Sequence[str] = ()) -> None:
        """Set which pages may connect.

        Args:
            host: the address at which we are.
            origins: sites beside our own page's.
        """
        self._names, self._origins = Admission(host), frozenset(origins)

    def refusal(self, host: str | None, origin: str | None) -> str | None:
        """Return why a request with these headers is refused; None if it is accepted."""
        if (wrong_name := self._names.refusal(host, None)) is not None:
            return wrong_name
        if origin is None or origin in self._origins or self._is_own(host, origin):
            return None
        return f"a page of {origin} may not connect; --allow-origin {origin} lets it look"

    def is_foreign(self, host: str | None, origin: str | None) -> bool:
        """Return whether a request comes from the page of another site."""
        return origin is not None and not self._is_own(host, origin)

    @staticmethod
    def _is_own(host: str | None, origin: str) -> bool:
        try:
            found = urlsplit(origin)
        except ValueError:
            return False
        return found.scheme in ("http", "https") and host is not None and found.netloc == host
