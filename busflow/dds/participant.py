"""Participant: one member of a DDS domain, which stays on the loopback interface unless a network is named."""

# The stubs of cyclonedds leave out what many of its functions take and return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import os
import re
import socket
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from cyclonedds.core import DDSException, GuardCondition, InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from busflow import timeouts
from busflow.dds.names import DdsName, user_data
from busflow.dds.qos import to_dds
from busflow.errors import InspectionUnavailable, InvalidName
from busflow.text import printable
from busflow.wire.zenoh.qos_text import WireQoS

# What XML would take for something else is in no such name; Linux itself forbids only slashes and spaces.
_INTERFACE = re.compile(r"[A-Za-z0-9_.:-]{1,64}")
_LOOPBACK = """\
<NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast></General>\
<Discovery><Peers><Peer address="127.0.0.1"/></Peers>"""
_NAMED = """<NetworkInterface name="{}"/></Interfaces></General><Discovery>"""
_CONFIGURATION = """\
<CycloneDDS><Domain Id="any"><General><Interfaces>{}<ParticipantIndex>auto</ParticipantIndex>\
<MaxAutoParticipantIndex>119</MaxAutoParticipantIndex></Discovery></Domain></CycloneDDS>"""
_ANY = SampleState.NotRead | ViewState.Any | InstanceState.Any
_AT_ONCE = 64
"""Samples that are taken before another reader gets its turn."""
_WAIT_NS = 1_000_000_000
_EVERYWHERE = "0.0.0.0"  # noqa: S104  # what is looked for, not what is bound


def configuration(interface: str | None) -> str:
    """Return Cyclone's configuration: the loopback interface without multicast, or the interface of this name.

    Raises:
        InvalidName: there is no interface of this name.
    """
    if interface is None:
        return _CONFIGURATION.format(_LOOPBACK)
    known = [name for _, name in socket.if_nameindex()]
    if interface not in known or _INTERFACE.fullmatch(interface) is None:
        shown = printable(interface, limit=80)
        raise InvalidName(f"no network interface is called {shown!r}; there are {', '.join(known)}")
    return _CONFIGURATION.format(_NAMED.format(interface))


class Participant:
    """A member of a domain, with its readers and writers."""

    def __init__(self, domain: int, interface: str | None) -> None:
        """Join the domain.

        Raises:
            InspectionUnavailable: DDS cannot open its sockets.
            InvalidName: there is no interface of this name.
        """
        text = configuration(interface)
        before = _open_files()
        try:
            self._domain = Domain(domain, text)
            self.entity: DomainParticipant = DomainParticipant(domain, qos=Qos(Policy.Userdata(user_data(enclave="/"))))
        except DDSException as error:
            where = "the loopback interface" if interface is None else f"the interface {interface}"
            raise InspectionUnavailable(f"DDS cannot join domain {domain} on {where}: {error.msg}") from None
        self.is_confined: bool = interface is not None or _confine(_open_files() - before)
        """False if other machines can send to the sockets though no network is named: this system cannot prevent it."""
        self.gid: bytes = self.entity.guid.bytes
        self._topics: dict[tuple[str, Any], Topic[Any]] = {}

    def close(self) -> None:
        """Leave the domain at once, with all readers and writers, whatever still refers to them."""
        self.entity.__del__()  # cyclonedds has no other method, and may call it again
        self._domain.__del__()

    def reader(self, name: DdsName | str, carrier: Any, qos: WireQoS, data: bytes = b"") -> DataReader[Any]:
        """Return a new reader, which lives until it is not referred to any more."""
        return DataReader(self.entity, self._topic(name, carrier), qos=to_dds(qos, data, is_reader=True))

    def writer(self, name: DdsName | str, carrier: Any, qos: WireQoS, data: bytes = b"") -> DataWriter[Any]:
        """Return a new writer, which lives until it is not referred to any more."""
        return DataWriter(self.entity, self._topic(name, carrier), qos=to_dds(qos, data))

    def _topic(self, name: DdsName | str, carrier: Any) -> Topic[Any]:
        key = str(name), carrier
        if key not in self._topics:
            self._topics[key] = Topic(self.entity, key[0], carrier)
        return self._topics[key]


def _open_files() -> set[int]:
    """Return the files that are open, without the one by which they are listed."""
    found: set[int] = set()
    for each in [int(path.name) for path in Path("/dev/fd").iterdir()]:
        with suppress(OSError):
            os.fstat(each)
            found.add(each)
    return found


def _confine(files: Iterable[int]) -> bool:
    """Have these sockets receive from the loopback interface alone; return whether the system can do that.

    Cyclone sends through the interface that is configured, and receives from all: it binds its sockets to 0.0.0.0 where
    it has one interface.
    """
    device = getattr(socket, "SO_BINDTODEVICE", None)
    for file in files:
        try:
            with socket.socket(fileno=os.dup(file)) as each:
                if each.type != socket.SOCK_DGRAM or each.getsockname()[0] != _EVERYWHERE:
                    continue
                if device is None:
                    return False
                each.setsockopt(socket.SOL_SOCKET, device, b"lo")
        except PermissionError:  # Linux before 5.7
            return False
        except OSError:  # it is no socket, or closed by now
            continue
    return True


class Intake:
    """A thread that takes the samples of readers, and hands those of each reader to its function."""

    def __init__(self, participant: Participant, name: str, *, on_error: Callable[[Exception], None]) -> None:
        """Start the thread; `on_error` is called in it with each unexpected error."""
        self._on_error = on_error
        self._waiting = WaitSet(participant.entity)
        self._wake = GuardCondition(participant.entity)
        self._waiting.attach(self._wake)
        self._readers: dict[DataReader[Any], tuple[ReadCondition, Callable[[list[Any]], None]]] = {}
        self._changing = threading.Lock()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def add(self, reader: DataReader[Any], on_samples: Callable[[list[Any]], None]) -> None:
        """Take the reader's samples from now on."""
        condition = ReadCondition(reader, _ANY)
        with self._changing:
            self._readers[reader] = condition, on_samples
            self._waiting.attach(condition)

    def remove(self, reader: DataReader[Any]) -> None:
        """Take no more; the function is not running once this returns."""
        with self._changing:
            condition, _ = self._readers.pop(reader)
            self._waiting.detach(condition)

    def close(self) -> None:
        """End the thread."""
        self._closed = True
        self._wake.set(True)
        self._thread.join(timeouts.current.participant_end)

    def _run(self) -> None:
        while not self._closed:
            try:
                self._waiting.wait(_WAIT_NS)
                with self._changing:
                    self._take()
            except Exception as error:  # noqa: BLE001  # the owner gets the error, and the thread goes on
                self._on_error(error)

    def _take(self) -> None:
        for reader, (_, on_samples) in self._readers.items():
            if samples := reader.take(N=_AT_ONCE):
                on_samples(samples)
