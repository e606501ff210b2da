"""Certificates are what they say, and are never written over in silence."""

import ssl
import stat
from pathlib import Path

import pytest

from busflow.errors import CertificateError
from busflow.runner.planning.credentials import Credentials, common_name
from busflow.wire.machines.certificates import Authority


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    return Authority.new(tmp_path / "certs")


def credentials(folder: Path, name: str) -> Credentials:
    return Credentials(folder / "ca.pem", folder / f"{name}.pem", folder / f"{name}.key")


def test_a_certificate_is_valid_for_its_addresses_only(authority: Authority):
    authority.add("arm", addresses=["192.0.2.7", "arm.local", "2001:db8::1"])
    shown = credentials(authority.folder, "arm")
    assert common_name(shown.verified_by_peer()) == "arm"
    for host in ("192.0.2.7", "arm.local", "2001:db8::1", "arm"):
        shown.verified_by_peer(host)
    with pytest.raises(ssl.SSLCertVerificationError):
        shown.verified_by_peer("192.0.2.8")


def test_that_of_another_authority_is_not(authority: Authority, tmp_path: Path):
    other = Authority.new(tmp_path / "other")
    other.add("arm")
    shown = Credentials(authority.folder / "ca.pem", other.folder / "arm.pem", other.folder / "arm.key")
    with pytest.raises(ssl.SSLCertVerificationError):
        shown.verified_by_peer()


def test_keys_are_their_owner_s(authority: Authority):
    made = authority.add("arm")
    for path in (authority.folder / "ca.key", made.key):
        assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_nothing_is_written_over_unless_that_is_said(authority: Authority):
    first = authority.add("arm", addresses=["192.0.2.7"]).cert.read_bytes()
    with pytest.raises(CertificateError, match="--replace"):
        authority.add("arm")
    assert (authority.folder / "arm.pem").read_bytes() == first
    made = authority.add("arm", addresses=["arm.local"], replace=True)
    assert made.addresses == ("192.0.2.7", "arm.local")
    assert made.cert.read_bytes() != first
    with pytest.raises(CertificateError, match="certs"):
        Authority.new(authority.folder)


@pytest.mark.parametrize(
    ("name", "addresses"), [("ca", []), ("../x", []), ("a b", []), ("", []), ("arm", ["a b"]), ("arm", ["a/b"])]
)
def test_what_cannot_be_named_is_refused(authority: Authority, name: str, addresses: list[str]):
    with pytest.raises(CertificateError):
        authority.add(name, addresses=addresses)
    assert authority.certificates() == []


def test_without_the_authoritys_key_no_certificate_is_made(authority: Authority, tmp_path: Path):
    (authority.folder / "ca.key").unlink()
    with pytest.raises(CertificateError, match="certs"):
        Authority.open(authority.folder)
    assert Authority.open(authority.folder, to_sign=False).certificates() == []
    with pytest.raises(CertificateError, match="certs new"):
        Authority.open(tmp_path / "nowhere")


def test_existing_certificates_are_listed(authority: Authority, tmp_path: Path):
    authority.add("arm", days=7)
    other = Authority.new(tmp_path / "other")
    (authority.folder / "far.pem").write_bytes(other.add("far").cert.read_bytes())
    told = {each.name: each.fault for each in authority.certificates()}
    assert told == {"arm": "", "far": "of another authority"}
