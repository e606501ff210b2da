"""Probe: why a machine is not linked. Zenoh retries silently; the probe connects once and reads the error."""

from __future__ import annotations

import asyncio
import socket
import ssl
from contextlib import suppress
from typing import TYPE_CHECKING

from busflow import timeouts
from busflow.launchfile.model.network import TLS
from busflow.runner.planning.credentials import EXPIRED, OTHER_HOST, TOO_EARLY, common_name

if TYPE_CHECKING:
    from busflow.launchfile.model.network import NetworkAddress
    from busflow.runner.planning.credentials import Credentials

_ALERTS = {
    "UNKNOWN_CA": "it does not trust our certificate, which another authority than its own has made",
    "CERTIFICATE_EXPIRED": "our certificate has expired",
    "CERTIFICATE_REQUIRED": "it wants a certificate of ours",
    "BAD_CERTIFICATE": "it does not accept our certificate",
    "CERTIFICATE_UNKNOWN": "it does not accept our certificate",
}


async def why_not_linked(end: NetworkAddress, credentials: Credentials | None, machine: str) -> str:
    """Return why there is no link to a machine, as text for people; empty if nothing prevents it.

    Args:
        end: its address.
        credentials: the certificate to show; None without encryption.
        machine: its name, which its certificate must have.
    """
    try:
        async with asyncio.timeout(timeouts.current.machine_probe):
            return await _tried(end, credentials, machine)
    except ssl.SSLCertVerificationError as error:
        return _distrust(error, end)
    except ssl.SSLError as error:
        return _refusal(error)
    except ConnectionRefusedError:
        return f"nothing listens at {end}: its run has not started, or listens elsewhere"
    except ConnectionResetError:
        return f"what listens at {end} ends the connection"
    except socket.gaierror as error:
        return f"{end.host} is not known here: {error.strerror}"
    except TimeoutError:
        return f"{end} does not answer: it is switched off, not in this network, or behind a firewall"
    except OSError as error:
        return f"{end} cannot be reached: {error.strerror or error}"


async def _tried(end: NetworkAddress, credentials: Credentials | None, machine: str) -> str:
    context = None
    if end.protocol == TLS and credentials is not None:
        context = credentials.context(server=False)
        context.check_hostname = True
    host = end.host if context is not None else None
    reader, writer = await asyncio.open_connection(end.host, end.port, ssl=context, server_hostname=host)
    try:
        if context is not None:
            owner = common_name(writer.get_extra_info("peercert") or {})
            if owner != machine:
                return f"what listens at {end} is {owner or 'a program without a name'}, not {machine}"
        with suppress(TimeoutError):
            async with asyncio.timeout(timeouts.current.machine_alert):
                if not await reader.read(1):  # a machine that accepts us waits for our first message
                    return f"what listens at {end} ends the connection"
        return ""
    finally:
        writer.transport.abort()


def _distrust(error: ssl.SSLCertVerificationError, end: NetworkAddress) -> str:
    if error.verify_code == EXPIRED:
        return "its certificate has expired"
    if error.verify_code == TOO_EARLY:
        return "its certificate is not valid yet: one of the two clocks is wrong"
    if error.verify_code in OTHER_HOST:
        return f"its certificate is not for {end.host}: busflow certs add … --replace --address {end.host}"
    return f"its certificate is not one of our authority: {error.verify_message}"


def _refusal(error: ssl.SSLError) -> str:
    reason = error.reason or str(error)
    alert = next((text for word, text in _ALERTS.items() if word in reason.upper().replace(" ", "_")), None)
    return alert or f"what listens there does not speak TLS as it should: {reason}"
