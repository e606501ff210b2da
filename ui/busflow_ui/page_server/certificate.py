"""Certificate: encrypts the connections of browsers on other machines."""

from __future__ import annotations

import ssl
from pathlib import Path

from busflow.errors import InvalidInput, Problem
from busflow.text import printable


def tls(certificate: Path, key: Path) -> ssl.SSLContext:
    """Return what encrypts with a certificate and its key.

    Raises:
        InvalidInput: A file is missing, is none, or they do not belong together.
    """
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    try:
        context.load_cert_chain(certificate, key, password=_no_password)
    except (OSError, ssl.SSLError, _LockedKeyError) as error:
        why = printable(error.strerror or error) if isinstance(error, OSError) else str(error)
        fix = "give two PEM files, the key without a password; busflow certs makes certificates for machines"
        message = f"{printable(certificate)} and {printable(key)} are no certificate and its key: {why}"
        raise InvalidInput(Problem("certificate", message, fix)) from None
    return context


class _LockedKeyError(Exception):
    """Error of a key that needs a password: none can be typed here."""


def _no_password() -> str:
    raise _LockedKeyError("the key is locked by a password")
