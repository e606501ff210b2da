"""PageRecorder: the record button: one recording of a run at a time, in the folder where `busflow ui` was started."""

from __future__ import annotations

from typing import TYPE_CHECKING

from busflow.commands import Compression, RemoteRecorder, Selection
from busflow.errors import RecordingRefused
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.commands import Peer

_FILE = "{name}-{start}.mcap"


class PageRecorder:
    """Recording of all topics of a run that are not hidden. Each method blocks, and is for one thread at a time."""

    def __init__(self, peer: Peer) -> None:
        self._peer = peer
        self._recorder: RemoteRecorder | None = None

    def switch(self, *, on: bool) -> dict[str, object]:
        """Begin or end to record; return `state`.

        Raises:
            RecordingRefused: The file cannot be made, or not be written to its end.
        """
        if on and self._recorder is None:
            self._recorder = RemoteRecorder(self._peer, Selection(()), to=_FILE, compression=Compression.ZSTD)
            self.follow()
        if on or self._recorder is None:
            return self.state()
        recorder, self._recorder = self._recorder, None
        recorder.close()
        if recorder.failure is not None:
            raise RecordingRefused(f"{printable(recorder.path)} could not be written: {recorder.failure}")
        return {"on": False, **_counts(recorder)}

    def follow(self) -> None:
        """Record topics that are new; called about once a second."""
        if self._recorder is not None:
            self._recorder.follow()

    def state(self) -> dict[str, object]:
        """Return `{on, path, messages, missed}`; `{on}` alone where nothing is recorded."""
        return {"on": False} if self._recorder is None else {"on": True, **_counts(self._recorder)}

    def close(self) -> None:
        """End the recording, if there is one."""
        if self._recorder is not None:
            self._recorder.close()


def _counts(recorder: RemoteRecorder) -> dict[str, object]:
    return {"path": str(recorder.path.absolute()), "messages": recorder.published, "missed": recorder.missed}
