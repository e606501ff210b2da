"""Certificates: a small authority in a folder, and certificates for machines and for clients.

They are made with `cryptography`, the extra `certs`, which is needed only where certificates are made, not on robots.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from importlib.util import find_spec
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Self

from busflow.clock import NS_PER_S, SystemClock
from busflow.errors import CertificateError, how_to_install
from busflow.launchfile.model.network import NAME

if TYPE_CHECKING:
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey

AUTHORITY = "ca"
_AUTHORITY_DAYS = 3650
DAYS = 730
"""How long a certificate is valid: long enough for a robot in the field, short enough for a lost key."""
_SKEW = timedelta(hours=1)
"""A certificate is valid from a little before it is made, because clocks differ."""
_ONLY_OWNER = 0o600


def require_cryptography() -> None:
    """Check that certificates can be made here.

    Raises:
        CertificateError: they cannot.
    """
    if find_spec("cryptography") is None:
        text = "certificates are made with cryptography, which is not installed here"
        raise CertificateError(f"{text}; {how_to_install('busflow[certs]')}")


@dataclass(frozen=True, slots=True)
class Certificate:
    """A certificate in an authority's folder, and whether it will be trusted."""

    name: str
    cert: Path
    addresses: tuple[str, ...]
    until: datetime
    fault: str = ""
    """Why it will not be trusted; empty if it will."""

    @property
    def key(self) -> Path:
        """Path of its private key."""
        return self.cert.with_suffix(".key")


class Authority:
    """Certificate authority of a folder: it signs the folder's certificates."""

    def __init__(self, folder: Path, cert: x509.Certificate, key: EllipticCurvePrivateKey | None) -> None:
        self.folder: Path = folder
        self._cert, self._key = cert, key

    @classmethod
    def new(cls, folder: Path) -> Self:
        """Make an authority in a folder that has none.

        Raises:
            CertificateError: there is one, or the folder cannot be written to.
        """
        require_cryptography()
        from cryptography import x509

        for path in (folder / f"{AUTHORITY}.pem", folder / f"{AUTHORITY}.key"):
            if path.exists():
                text = f"{path} exists already: a new one would lock out the machines with its certificates"
                raise CertificateError(f"{text}; choose another folder, or remove it first")
        key = _new_key()
        subject = _subject(f"busflow {folder.resolve().name}")
        usage = _usage(signs_certificates=True)
        cert = (
            _draft(subject, subject, key, _AUTHORITY_DAYS)
            .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .add_extension(usage, critical=True)
            .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
            .sign(key, _hash())
        )
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if not (folder / ".gitignore").exists():  # the launch file is in a repository, and keys must not get there
                (folder / ".gitignore").write_text("*.key\n", encoding="utf-8")
        except OSError as error:
            raise CertificateError(f"cannot make {folder}: {error.strerror}") from None
        _save(folder / AUTHORITY, cert, key)
        return cls(folder, cert, key)

    @classmethod
    def open(cls, folder: Path, *, to_sign: bool = True) -> Self:
        """Open the authority of a folder.

        Raises:
            CertificateError: there is none, or without `to_sign`'s key.
        """
        require_cryptography()
        from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey
        from cryptography.hazmat.primitives.serialization import load_pem_private_key

        path = folder / f"{AUTHORITY}.pem"
        if not path.is_file():
            raise CertificateError(f"there is no {path}: make an authority with busflow certs new {folder}")
        cert = _read(path)
        if not to_sign:
            return cls(folder, cert, None)
        path = folder / f"{AUTHORITY}.key"
        try:
            key = load_pem_private_key(path.read_bytes(), None)
        except FileNotFoundError:
            text = f"there is no {path}: certificates are made where the authority's key is"
            raise CertificateError(f"{text}, which is nowhere else") from None
        except (ValueError, TypeError, OSError) as error:
            raise CertificateError(f"{path} is not a private key that can be read: {error}") from None
        if not isinstance(key, EllipticCurvePrivateKey):
            raise CertificateError(f"{path} is no key that busflow has made")
        return cls(folder, cert, key)

    @property
    def until(self) -> datetime:
        """The end of its validity."""
        return self._cert.not_valid_after_utc

    def add(self, name: str, *, addresses: Sequence[str] = (), days: int = DAYS, replace: bool = False) -> Certificate:
        """Make a certificate; a replacement keeps the addresses of its predecessor.

        Args:
            name: the machine or the client that it is for.
            addresses: where others look for it: addresses or names of hosts.
            days: how many days it is valid.
            replace: whether it may replace one of this name.

        Raises:
            CertificateError: the name or an address is none, or there is one, or it cannot be written.
        """
        from cryptography import x509
        from cryptography.x509.oid import ExtendedKeyUsageOID

        if self._key is None or not NAME.fullmatch(name) or name == AUTHORITY:
            text = "up to 32 letters, digits, _ and -, a letter first, and not ca"
            raise CertificateError(f"{name!r} cannot be the name of a certificate: {text}")
        path = self.folder / f"{name}.pem"
        there = path.exists() or path.with_suffix(".key").exists()
        if there and not replace:
            raise CertificateError(f"{path} or its key exists already; --replace makes a new one in its place")
        former = _addresses(_read(path)) if path.exists() else ()
        wanted = tuple(dict.fromkeys([*former, *addresses]))
        names = [x509.DNSName(name), *(_general(each) for each in wanted if each != name)]
        key = _new_key()
        both = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]
        cert = (
            _draft(_subject(name), self._cert.subject, key, days)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(_usage(signs_certificates=False), critical=True)
            .add_extension(x509.ExtendedKeyUsage(both), critical=False)
            .add_extension(x509.SubjectAlternativeName(names), critical=False)
            .add_extension(x509.AuthorityKeyIdentifier.from_issuer_public_key(self._key.public_key()), critical=False)
            .sign(self._key, _hash())
        )
        _save(self.folder / name, cert, key)
        return self._check(path)

    def certificates(self) -> list[Certificate]:
        """Return every certificate of the folder by name, without the authority's own."""
        paths = sorted(path for path in self.folder.glob("*.pem") if path.stem != AUTHORITY)
        return [self._check(path) for path in paths]

    def _check(self, path: Path) -> Certificate:
        from cryptography.exceptions import InvalidSignature

        cert = _read(path)
        fault = "" if cert.not_valid_after_utc > _now() else "expired"
        try:
            cert.verify_directly_issued_by(self._cert)
        except (InvalidSignature, ValueError, TypeError):
            fault = "of another authority"
        return Certificate(path.stem, path, _addresses(cert), cert.not_valid_after_utc, fault)


def _now() -> datetime:
    return datetime.fromtimestamp(SystemClock().now().nanoseconds // NS_PER_S, UTC)


def _new_key() -> EllipticCurvePrivateKey:
    from cryptography.hazmat.primitives.asymmetric import ec

    return ec.generate_private_key(ec.SECP256R1())


def _hash() -> hashes.SHA256:
    from cryptography.hazmat.primitives import hashes

    return hashes.SHA256()


def _subject(name: str) -> x509.Name:
    from cryptography import x509
    from cryptography.x509.oid import NameOID

    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    from cryptography import x509

    return x509.KeyUsage(
        digital_signature=True,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        encipher_only=False,
        decipher_only=False,
    )


def _draft(subject: x509.Name, issuer: x509.Name, key: EllipticCurvePrivateKey, days: int) -> x509.CertificateBuilder:
    from cryptography import x509

    now = _now()
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _SKEW)
        .not_valid_after(now + timedelta(days=days))
    )


def _general(address: str) -> x509.GeneralName:
    """Return an address as a certificate's general name.

    Raises:
        CertificateError: it is none.
    """
    from cryptography import x509

    try:
        return x509.IPAddress(ip_address(address))
    except ValueError:
        pass
    if not address or not all(part and part.replace("-", "a").isalnum() for part in address.split(".")):
        raise CertificateError(f"{address!r} is neither an address nor the name of a host") from None
    return x509.DNSName(address)


def _addresses(cert: x509.Certificate) -> tuple[str, ...]:
    """Return the addresses in a certificate, without its own name."""
    from cryptography import x509

    try:
        names = cert.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return ()
    own = {str(each.value) for each in cert.subject}
    return tuple(str(each.value) for each in names if str(each.value) not in own)


def _read(path: Path) -> x509.Certificate:
    from cryptography import x509

    try:
        return x509.load_pem_x509_certificate(path.read_bytes())
    except (ValueError, OSError) as error:
        raise CertificateError(f"{path} is no certificate that can be read: {error}") from None


def _save(stem: Path, cert: x509.Certificate, key: EllipticCurvePrivateKey) -> None:
    """Write certificate and key; the key is never readable by others, not even for a moment."""
    from cryptography.hazmat.primitives import serialization

    secret = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    public = cert.public_bytes(serialization.Encoding.PEM)
    for suffix, content, mode in ((".key", secret, _ONLY_OWNER), (".pem", public, 0o644)):
        path = stem.with_name(f"{stem.name}{suffix}")
        draft = path.with_name(f".{path.name}.new")
        try:
            draft.unlink(missing_ok=True)
            with os.fdopen(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
                file.write(content)
            draft.replace(path)
        except OSError as error:
            raise CertificateError(f"cannot write {path}: {error.strerror}") from None
