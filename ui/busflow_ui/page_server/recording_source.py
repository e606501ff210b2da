"""RecordingSource: the recording that pages show, each page at a moment of its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from websockets.frames import CloseCode

import busflow
from busflow_ui.foxglove import protocol
from busflow_ui.page_server.access import Access
from busflow_ui.recordings.recording_page import RecordingPage

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

    from busflow_ui.recordings.recording import Recording


class RecordingSource:
    """Recording, shown to any number of pages."""

    def __init__(self, recording: Recording, *, print_message: Callable[[str], None]) -> None:
        self._recording, self._print = recording, print_message

    async def serve(self, connection: ServerConnection, access: Access) -> None:
        """Serve a page that has been let in, until either side ends the connection."""
        if access is Access.ASK:
            await connection.close(CloseCode.POLICY_VIOLATION, "a recording has no assistant")
            return
        greeting = protocol.text(
            "serverInfo",
            name=f"busflow: {self._recording.name}",
            capabilities=["time", "busflow"],
            metadata={
                "busflow": busflow.__version__,
                "run": self._recording.name,
                "source": "recording",
                "access": Access.READ_ONLY,
            },
            sessionId=f"{self._recording.path}-{self._recording.start_ns}",
        )
        page = RecordingPage(connection, self._recording, print_message=self._print)
        await page.serve(greeting)
