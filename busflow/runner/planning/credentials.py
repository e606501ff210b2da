"""`Credentials`: a machine's certificate and key, and their checks before other machines see them.

A certificate is checked by the code that will judge it later: a TLS handshake with itself, in memory.
"""

from __future__ import annotations

import ssl
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from busflow.errors import Problem
from busflow.launchfile.model.network import TLS, NetworkSpec
from busflow.launchfile.model.problems import problem_at, warning_at
from busflow.launchfile.yaml.value import StatedPath

if TYPE_CHECKING:
    from busflow.clock import Time

EXPIRED, TOO_EARLY, OTHER_HOST = 10, 9, (62, 64)
"""OpenSSL's codes for refused certificates: expired, not valid yet, issued for another host."""
_SOON_DAYS = 30
_SECONDS_PER_DAY = 86_400
_ROUNDS = 10
_THERE = ", where the authority's key is, and copy what it makes here"


@dataclass(frozen=True, slots=True)
class Credentials:
    """Certificate and key of a machine or other participant, and the authority that it trusts."""

    ca: Path
    cert: Path
    key: Path

    def context(self, *, server: bool) -> ssl.SSLContext:
        """Return the TLS settings of one side; both sides need a certificate of the same authority.

        Raises:
            OSError: A file cannot be read, or holds no certificate, or the key does not fit the certificate.
        """
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER if server else ssl.PROTOCOL_TLS_CLIENT)
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        context.load_verify_locations(self.ca)
        context.load_cert_chain(self.cert, self.key, password="")  # else OpenSSL asks on the terminal
        context.check_hostname = False
        context.verify_mode = ssl.CERT_REQUIRED
        return context

    def verified_by_peer(self, host: str = "") -> Mapping[str, Any]:
        """Return the certificate as a peer reads it after verification, for this host if one is given.

        Raises:
            OSError: Peers will refuse it; `ssl.SSLCertVerificationError` says why.
        """
        client, server = self.context(server=False), self.context(server=True)
        client.check_hostname = bool(host)
        ways = ssl.MemoryBIO(), ssl.MemoryBIO()
        near = client.wrap_bio(ways[0], ways[1], server_hostname=host or None)
        far = server.wrap_bio(ways[1], ways[0], server_side=True)
        for _ in range(_ROUNDS):
            finished = [_continue_handshake(near), _continue_handshake(far)]
            if all(finished):
                break
        return near.getpeercert() or {}


def credentials_of(network: NetworkSpec, machine: str) -> Credentials | None:
    """Return the credentials of a machine; None if nothing is encrypted."""
    spec = network.machines[machine]
    if network.ca is None or spec.cert is None or spec.key is None:
        return None
    return Credentials(network.ca.path, spec.cert.path, spec.key.path)


def credential_problems(network: NetworkSpec, machine: str, now: Time) -> Iterator[Problem]:
    """Yield the problems of this machine's certificate files: why other machines would refuse it, and unsafe modes."""
    spec = network.machines[machine]
    ends = [spec.listen, *network.dialled_by(machine)]
    if network.ca is None or spec.cert is None or spec.key is None or all(e is None or e.protocol != TLS for e in ends):
        return
    hosts = [spec.connect.host] if spec.connect is not None and spec.connect.protocol == TLS else []
    yield from credential_faults(machine, (network.ca, spec.cert, spec.key), hosts, now)


def credential_faults(
    name: str, files: tuple[StatedPath, StatedPath, StatedPath], hosts: Sequence[str], now: Time
) -> Iterator[Problem]:
    """Yield the problems of the `ca`, certificate and key of a participant that is reached at these hosts."""
    ca, cert, key = files
    missing = [_missing(name, each, each is ca) for each in files if not each.path.is_file()]
    if missing:
        yield from missing
        return
    mode = key.path.stat().st_mode & 0o077
    if mode:
        text = f"the private key {key.path} can be read by others (mode {key.path.stat().st_mode & 0o777:04o})"
        yield problem_at("open-key", text, f"chmod 600 {key.path}", key.origin)
    credentials = Credentials(ca.path, cert.path, key.path)
    again = f"busflow certs add {name} {cert.path.parent} --replace{_THERE}"
    try:
        certificate = credentials.verified_by_peer()
    except ssl.SSLCertVerificationError as error:
        yield problem_at("bad-certificate", _refused(cert.path, ca.path, error), again, cert.origin)
        return
    except OSError as error:
        yield problem_at("bad-certificate", _unfit(cert.path, key.path, ca.path, error), again, cert.origin)
        return
    owner = common_name(certificate)
    if owner != name:
        text = f"the certificate {cert.path} is that of {owner or 'no machine'}, and this is {name}"
        yield problem_at("other-certificate", text, f"busflow certs add {name} {cert.path.parent}{_THERE}", cert.origin)
    yield from _about_hosts(name, credentials, hosts, cert)
    left_days = (ssl.cert_time_to_seconds(str(certificate["notAfter"])) - now.nanoseconds / 1e9) / _SECONDS_PER_DAY
    if left_days < _SOON_DAYS:
        text = f"the certificate {cert.path} expires in {left_days:.0f} days, on {certificate['notAfter']}"
        yield warning_at("expires-soon", text, again, cert.origin)


def common_name(certificate: Mapping[str, Any]) -> str:
    """Return the name of a certificate's owner."""
    names = [value for part in certificate.get("subject", ()) for word, value in part if word == "commonName"]
    return str(names[0]) if names else ""


def _about_hosts(name: str, credentials: Credentials, hosts: Sequence[str], cert: StatedPath) -> Iterator[Problem]:
    for host in hosts:
        try:
            credentials.verified_by_peer(host)
        except ssl.SSLCertVerificationError:
            text = f"the certificate {cert.path} is not for {host}, where the others look for it"
            fix = f"busflow certs add {name} {cert.path.parent} --replace --address {host}{_THERE}"
            yield problem_at("other-host", text, fix, cert.origin)


def _missing(name: str, file: StatedPath, is_ca: bool) -> Problem:
    folder = file.path.parent
    fix = f"busflow certs new {folder}" if is_ca else f"busflow certs add {name} {folder}"
    return problem_at("missing-file", f"there is no file {file.path}", fix if is_ca else fix + _THERE, file.origin)


def _refused(cert: Path, ca: Path, error: ssl.SSLCertVerificationError) -> str:
    if error.verify_code == EXPIRED:
        return f"the certificate {cert} has expired"
    if error.verify_code == TOO_EARLY:
        return f"the certificate {cert} is not valid yet: is the clock of this machine right?"
    return f"the certificate {cert} is not one of {ca}: {error.verify_message}"


def _unfit(cert: Path, key: Path, ca: Path, error: OSError) -> str:
    reason = getattr(error, "reason", None) or error.strerror or str(error)
    if reason == "KEY_VALUES_MISMATCH":
        return f"the key {key} is not that of the certificate {cert}"
    return f"{ca}, {cert} and {key} are not what TLS needs: {reason}"


def _continue_handshake(side: ssl.SSLObject) -> bool:
    """Continue a handshake until it needs more data; return whether it is finished."""
    try:
        side.do_handshake()
    except ssl.SSLWantReadError:
        return False
    return True
