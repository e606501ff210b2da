"""`busflow completion`: scripts that shells take, and names they complete."""

import shutil
import subprocess

import pytest

from busflow.cli import main

Captured = pytest.CaptureFixture[str]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_asks_busflow(capsys: Captured, shell: str):
    assert main(["completion", shell]) == 0
    assert f"_BUSFLOW_COMPLETE={shell}_complete" in capsys.readouterr().out


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_shell_understands_it(capsys: Captured, shell: str):
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")
    main(["completion", shell])
    done = subprocess.run([shell, "-n"], input=capsys.readouterr().out, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_zsh_completes_without_a_startup_file(capsys: Captured):
    main(["completion", "zsh"])
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert first == "#compdef busflow"  # which zsh reads only there
    assert second == "(( $+functions[compdef] )) || { autoload -Uz compinit && compinit }"


def test_fish_shows_the_whole_of_a_description(capsys: Captured):
    main(["completion", "fish"])
    assert 'string split --max 1 "," $completion' in capsys.readouterr().out


def test_bash_puts_no_blank_before_a_value(capsys: Captured):
    main(["completion", "bash"])
    assert "[[ $value == *= ]] && compopt -o nospace" in capsys.readouterr().out


def test_another_shell_is_refused_with_those_there_are(capsys: Captured):
    assert main(["completion", "tcsh"]) == 2
    assert "'bash', 'zsh', 'fish'" in capsys.readouterr().err
