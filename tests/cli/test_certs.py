"""`busflow certs`: makes certificates, and reports why one cannot be made."""

import subprocess
import sys
from pathlib import Path

from busflow.cli import main


def certs(*arguments: str) -> int:
    return main(["certs", *arguments])


def test_authority_and_certificates_are_made_and_shown(tmp_path: Path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert certs("new") == 0
    assert "Made certs/ca.pem and certs/ca.key" in capsys.readouterr().out
    assert Path("certs/.gitignore").read_text("utf-8") == "*.key\n"
    assert certs("add", "arm", "--address", "2001:db8::1") == 0
    assert "connect: tls/[2001:db8::1]:7447" in capsys.readouterr().out
    assert certs("add", "viewer") == 0
    assert "viewer: read" in capsys.readouterr().out
    assert certs("add", "arm", "--address", "192.0.2.9", "--replace") == 0
    out = capsys.readouterr().out
    assert "found at 2001:db8::1, 192.0.2.9" in out
    assert "connect: tls/192.0.2.9:7447" in out  # what was just said, and not what was said before
    assert "from the launch file's folder:" in out
    assert certs("show") == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ["NAME", "arm", "viewer"]


def test_existing_certificates_are_not_overwritten(tmp_path: Path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert certs("new") == 0
    assert certs("new") == 2
    assert "certs/ca.pem exists already" in capsys.readouterr().err
    assert certs("add", "arm") == 0
    assert certs("add", "arm") == 2
    assert "--replace" in capsys.readouterr().err


def test_missing_cryptography_is_reported_with_the_fix(tmp_path: Path):
    script = (
        "import sys; sys.modules['cryptography'] = None; from busflow.cli import main; sys.exit(main(['certs', 'new']))"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2
    message = "error: certificates are made with cryptography, which is not installed here"
    assert done.stderr == f"{message}; in a clone of busflow: pip install '.[certs]'\n"
    assert list(tmp_path.iterdir()) == []
