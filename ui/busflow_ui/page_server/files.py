"""PageFiles: the built page, and the headers under which a browser runs it."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from http import HTTPStatus
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from websockets.datastructures import Headers
from websockets.http11 import Response

from busflow.errors import InvalidInput, Problem, how_to_install

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request

    from busflow_ui.book.site import BookSite

BOOK = "/book"
"""Path of the book's folder."""
SOCKET = "/ws"
"""Path of the WebSocket."""
_EMBEDDED = re.compile(r"/(?:components|assistant)\.js|/(?:app|assistant)\.css|/chunk-[\w-]+\.js")
"""Paths of the panels and of the assistant's button, which a page of another site embeds."""
_CHUNK = re.compile(r"/chunk-[\w-]+\.js")
"""Paths of files whose name says what is in them: a browser keeps them, with what it has compiled of them."""
_HERE = Path(__file__).parent
_PLACES = (_HERE / "static", _HERE.parents[1] / "page" / "dist")
"""The folder in an installed distribution, and the one of a clone."""
_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".json": "application/json",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".map": "application/json",
}
_OWN_NAME = re.compile(r"[\w.:\[\]-]+")
_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
}


def page_folder() -> Path:
    """Return the folder with the built page.

    Raises:
        InvalidInput: It is not built.
    """
    for folder in _PLACES:
        if (folder / "index.html").is_file():
            return folder
    built = f"in a clone: cd {_PLACES[1].parent} && npm ci --ignore-scripts && node build.mjs"
    fix = f"{built}; or {how_to_install('busflow-ui')}"
    raise InvalidInput(Problem("no-page", f"the page is not built: {_PLACES[1]} has no index.html", fix))


class PageFiles:
    """Files of the page, by their paths; nothing else of the disk has one."""

    def __init__(self, folder: Path, origins: Collection[str] = (), book: BookSite | None = None) -> None:
        """List the files of a folder.

        Args:
            folder: the built page.
            origins: sites whose pages may embed the panels.
            book: the pages of a book beside it.
        """
        self._book = book
        files = [path for path in sorted(folder.iterdir()) if path.is_file() and path.suffix in _TYPES]
        self._files: Mapping[str, Path] = {f"/{path.name}": path for path in files}
        self._origins = frozenset(origins)

    def answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the file of a path; None where the request is for the WebSocket."""
        path = _path(request)
        if path == SOCKET:
            return None
        if self._book is not None and (path == BOOK or path.startswith(f"{BOOK}/")):
            return _page_of_book(connection, self._book, path)
        file = self._files.get("/index.html" if path == "/" else path)
        if file is None:
            return connection.respond(HTTPStatus.NOT_FOUND, "there is no such page\n")
        return _response(file.read_bytes(), _TYPES[file.suffix])

    def headers(self, request: Request) -> Mapping[str, str]:
        """Return the headers of an answer: a page may load and connect to nothing but this server."""
        host = request.headers.get("Host", "")
        own = f" ws://{host} wss://{host}" if _OWN_NAME.fullmatch(host) else ""
        policy = (
            "default-src 'self'; img-src 'self' blob:; "
            f"connect-src 'self'{own}; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        )
        stated = {"Content-Security-Policy": policy, "Cache-Control": self._caching(_path(request))}
        return {**_HEADERS, **stated, **self._sharing(request)}

    def _caching(self, path: str) -> str:
        return "max-age=31536000, immutable" if path in self._files and _CHUNK.fullmatch(path) else "no-cache"

    def _sharing(self, request: Request) -> Mapping[str, str]:
        """Return the headers that let a named site use the panels, and no other one anything."""
        if not self._origins or not _EMBEDDED.fullmatch(_path(request)):
            return {"Cross-Origin-Resource-Policy": "same-origin"}
        origin = request.headers.get("Origin")
        allowed = {"Access-Control-Allow-Origin": origin} if origin is not None and origin in self._origins else {}
        return {"Cross-Origin-Resource-Policy": "cross-origin", "Vary": "Origin", **allowed}


def _page_of_book(connection: ServerConnection, book: BookSite, path: str) -> Response:
    answer = book.answer(path.removeprefix(f"{BOOK}/")) if path != BOOK else None
    moved = f"{BOOK}/" if path == BOOK else answer and answer.moved
    if moved:
        response = connection.respond(HTTPStatus.FOUND, "")
        response.headers["Location"] = moved
        return response
    if answer is None:
        return connection.respond(HTTPStatus.NOT_FOUND, "there is no such page in the book\n")
    return _response(answer.body, answer.kind)


def _response(body: bytes, kind: str) -> Response:
    headers = Headers({"Content-Type": kind, "Content-Length": str(len(body)), "Connection": "close"})
    return Response(HTTPStatus.OK, "OK", headers, body)


def _path(request: Request) -> str:
    try:
        return urlsplit(request.path).path
    except ValueError:
        return ""
