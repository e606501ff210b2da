"""KnownTypes: types of what crosses the bridge, as the run has them, else as this installation does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from busflow.errors import BusflowError
from busflow.wire.client.known_type import installed_service, known_type

if TYPE_CHECKING:
    from busflow.dds.carried import Carried
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.wire.client.client import Peer, ServiceKind


class KnownTypes:
    """Types by name and hash. For one that is not known, a line is logged, and it is not carried."""

    def __init__(self, peer: Peer, carried: Carried) -> None:
        self._peer, self._carried = peer, carried
        self._messages: dict[tuple[str, str], ForeignType] = {}

    def message(self, topic: str, name: str, type_hash: str) -> ForeignType | None:
        """Return a message's type, or None if it cannot cross."""
        key = name, type_hash
        if key not in self._messages:
            try:
                self._messages[key] = known_type(self._peer, name, type_hash)
            except BusflowError as error:
                self._carried.warn(f"{topic} does not cross the bridge to DDS: {error}")
                return None
        return self._messages[key]

    def services(self, names: list[str]) -> dict[str, ServiceKind]:
        """Return those services that the run knows."""
        if not names:
            return {}
        try:
            return self._peer.services(names)
        except BusflowError as error:
            self._carried.warn(f"the run does not say what its services take: {error}")
            return {}

    def installed_service(self, name: str, type_name: str) -> ServiceKind | None:
        """Return a service of a type that this installation has, or None."""
        try:
            return installed_service(name, type_name)
        except (BusflowError, LookupError):
            return None
