"""`busflow certs`: makes certificates, and reports why one cannot be made."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.conftest import Shell

DATES = {r"\d{4}-\d\d-\d\d": "DATE", r"\b([0-9A-F]{2}:)+[0-9A-F]{2}\b": "FINGERPRINT"}


def test_certificates_are_made_once_and_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shell: Shell):
    monkeypatch.chdir(tmp_path)
    for line, code in (
        ("new", 0),
        ("new", 2),
        ("add arm --address 2001:db8::1", 0),
        ("add viewer", 0),
        ("add arm", 2),
        ("add arm --address 192.0.2.9 --replace", 0),  # which shows the new address alone as one to connect to
        ("show", 0),
    ):
        assert shell(f"certs {line}", mask=DATES) == code
    assert Path("certs/.gitignore").read_text("utf-8") == "*.key\n"


def test_missing_cryptography_is_reported_with_the_fix(tmp_path: Path, shell: Shell):
    script = (
        "import sys; sys.modules['cryptography'] = None; from busflow.cli import main; sys.exit(main(['certs', 'new']))"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2
    shell.note(done.stderr)
    assert list(tmp_path.iterdir()) == []
