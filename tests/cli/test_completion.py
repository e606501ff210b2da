"""`busflow completion`: scripts that shells take, and names they complete."""

import os
import pty
import select
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from busflow.cli import main
from tests.cli.conftest import Shell

Captured = pytest.CaptureFixture[str]


@pytest.mark.parametrize("name", ["bash", "zsh", "fish"])
def test_the_shell_understands_the_script(shell: Shell, name: str):
    script = shell.text(f"completion {name}")
    assert f"_BUSFLOW_COMPLETE={name}_complete" in script
    if shutil.which(name) is None:
        pytest.skip(f"no {name} here")
    done = subprocess.run([name, "-n"], input=script, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.fixture
def scripts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured) -> dict[str, Path]:
    """The script of each shell, and a folder with a launch file; the command is the one beside this Python."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    (tmp_path / "lab.yaml").write_text("nodes: {arm: {plugin: player}}\n")
    found: dict[str, Path] = {}
    for shell in ("zsh", "fish"):
        main(["completion", shell])
        found[shell] = tmp_path / f"script.{shell}"
        found[shell].write_text(capsys.readouterr().out)
    return found


@pytest.mark.e2e
@pytest.mark.skipif(shutil.which("fish") is None, reason="no fish here")
def test_fish_completes_commands_files_and_overrides(scripts: dict[str, Path]):
    def offered(line: str) -> list[str]:
        command = ["fish", "--no-config", "-c", f"source {scripts['fish']}; complete -C '{line}'"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
        return [each.split("\t")[0] for each in done.stdout.splitlines()]

    assert offered("busflow bag inf") == ["info"]
    assert offered("busflow run la") == ["lab.yaml"]
    assert offered("busflow run lab.yaml --set nodes.arm.pl") == ["nodes.arm.plugin="]


@pytest.mark.e2e
@pytest.mark.skipif(shutil.which("zsh") is None, reason="no zsh here")
def test_zsh_completes_commands_files_and_overrides(scripts: dict[str, Path]):
    pid, terminal = pty.fork()
    if pid == 0:  # pragma: no cover  # another process
        os.execlpe("zsh", "zsh", "-f", "-i", {**os.environ, "TERM": "dumb"})  # noqa: S606  # the shell under test
    try:
        for typed, shown in (
            (f"source {scripts['zsh']}; echo sour''ced\n", "sourced"),
            ("busflow bag inf\t", "bag info "),
            ("\x15busflow run la\t", "run lab.yaml"),
            ("\x15busflow run lab.yaml --set nodes.arm.pl\t", "nodes.arm.plugin="),
        ):
            os.write(terminal, typed.encode())
            read = b""
            while shown.encode() not in read:
                assert select.select([terminal], [], [], 60)[0], f"{shown} did not come after {typed!r}: {read!r}"
                read += os.read(terminal, 65536)
    finally:
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
        os.close(terminal)


def test_the_scripts_have_what_their_shell_needs(shell: Shell):
    first, second, *_ = shell.text("completion zsh").splitlines()
    assert first == "#compdef busflow"  # which zsh reads only there
    assert second == "(( $+functions[compdef] )) || { autoload -Uz compinit && compinit }"
    # fish shows the whole of a description, and bash puts no blank before a value.
    assert 'string split --max 1 "," $completion' in shell.text("completion fish")
    assert "[[ $value == *= ]] && compopt -o nospace" in shell.text("completion bash")
    assert shell("completion tcsh") == 2
