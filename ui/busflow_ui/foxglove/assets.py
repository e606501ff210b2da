"""Assets: the files of a robot's description that viewers ask for, out of the folders that its launch file names."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from websockets.exceptions import ConnectionClosed

from busflow.commands import package_file
from busflow.errors import NoSuchTarget
from busflow.text import printable, quoted
from busflow_ui.foxglove import protocol

if TYPE_CHECKING:
    from collections.abc import Callable

    from websockets.asyncio.server import ServerConnection

MOST_BYTES = 64 * 1024 * 1024
"""The largest file that is sent."""
EXTENSIONS = frozenset(
    {
        *(".dae", ".fbx", ".glb", ".gltf", ".mtl", ".obj", ".stl", ".urdf"),
        *(".bmp", ".jpeg", ".jpg", ".png", ".tga", ".tif", ".tiff", ".webp"),
    }
)
"""The kinds of files that are sent: meshes, their materials and textures, and descriptions."""
MOST_WAITING = 1000
"""The most requests of a viewer that wait; a robot has some hundred meshes."""
_FULL = f"{MOST_WAITING} files are asked for already; ask again when some have come"


def read_asset(uri: str, packages: Mapping[str, Path], most_bytes: int = MOST_BYTES) -> bytes:
    """Return the content of a file that a viewer asks for; it waits for the disk.

    Raises:
        NoSuchTarget: It is no file below one of the folders, of no kind that is sent, or too large.
    """
    file = package_file(uri, packages)
    if file.suffix.casefold() not in EXTENSIONS:
        kinds = " ".join(sorted(EXTENSIONS))
        raise NoSuchTarget(f"{quoted(uri)} is no mesh, texture or description; these are sent: {kinds}")
    try:
        with file.open("rb") as stream:
            content = stream.read(most_bytes + 1)
    except OSError as error:
        raise NoSuchTarget(f"{quoted(uri)} cannot be read: {error.strerror}") from None
    if len(content) > most_bytes:
        raise NoSuchTarget(f"{quoted(uri)} has more than {most_bytes >> 20} MiB; make the mesh coarser")
    return content


class AssetRun(Protocol):
    """Interface that sending assets needs of a bridge."""

    packages: Mapping[str, Path]

    async def call(self, question: Callable[..., Any]) -> Any:
        """Call a function in a thread."""


class AssetSender:
    """Sends one viewer the files that it asks for, one after the other, so that at most one is in memory."""

    def __init__(self, connection: ServerConnection, run: AssetRun) -> None:
        self._connection, self._run = connection, run
        self._turn = asyncio.Lock()
        self._tasks: set[asyncio.Task[None]] = set()

    def begin(self, request: protocol.FetchAsset, tasks: asyncio.TaskGroup) -> None:
        """Send a file, or the reason why not, as soon as the ones before are sent."""
        is_full = len(self._tasks) >= MOST_WAITING
        task = tasks.create_task(self._refuse(request, _FULL) if is_full else self._send(request))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def end(self) -> None:
        """Send nothing more."""
        for task in self._tasks:
            task.cancel()

    async def _send(self, request: protocol.FetchAsset) -> None:
        async with self._turn:
            try:
                content = await self._run.call(partial(read_asset, request.uri, self._run.packages))
            except NoSuchTarget as error:
                await self._refuse(request, str(error))
            else:
                with suppress(ConnectionClosed):
                    await self._connection.send(protocol.asset(request.request, content))

    async def _refuse(self, request: protocol.FetchAsset, reason: str) -> None:
        with suppress(ConnectionClosed):
            await self._connection.send(protocol.asset_failed(request.request, printable(reason)))
