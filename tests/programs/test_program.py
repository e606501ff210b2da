"""One program of a run: its start, restarts, failures and end, for real."""

import asyncio
import errno
import os
import signal

import pytest

from busflow.errors import DependencyEnded, ExitCode, NodeFailed, ProgramFailed
from busflow.launchfile.model.supervision import Condition
from busflow.programs import program
from busflow.programs.program import TRANSITIONS, ProgramState
from tests.processes.conftest import PATIENCE_S, ended
from tests.programs.conftest import Launched

FAST = "restart: {policy: on-failure, backoff: [10ms, 10ms], max: 2}"


QUICK = "nodes: {quick: {plugin: 'quick:Quick'}}\n"


def shell(text):
    """The line of a launch file with a command that a shell reads."""
    return f"command: [sh, -c, {text!r}]"


def test_run_ends_with_its_last_program(launched):
    run = launched(f"programs: {{driver: {{{shell('echo hello; echo aside >&2')}}}}}")
    assert run.graph.exit_code is ExitCode.OK
    assert {"hello", "aside"} <= set(run.log.texts("/driver"))
    account = run.account("/driver")
    assert (account.state, account.exit_codes, account.fates, account.lines) == ("ended", (0,), (), 2)


@pytest.mark.parametrize(
    ("command", "value"),
    [
        ("exit 3", "3"),
        ("kill -SEGV $$", "SIGSEGV"),
    ],
)
def test_failure_ends_run_and_is_named(launched, command, value):
    with pytest.raises(ProgramFailed, match=f"/driver .*{value}"):
        launched(f"programs: {{driver: {{{shell(command)}}}, other: {{command: [sleep, 600]}}}}")


def test_program_that_cannot_be_executed_fails(launched, project):
    (project / "driver").write_text("not a program\n")
    (project / "driver").chmod(0o755)
    with pytest.raises(ProgramFailed, match=f"/driver .*{os.strerror(errno.ENOEXEC)}"):
        launched("programs: {driver: {command: [./driver]}}")


def test_keeper_that_cannot_start_fails_program(launched, monkeypatch):
    def fail(*_: object) -> None:
        raise OSError(errno.EAGAIN, "none left")

    monkeypatch.setattr(program, "Child", fail)
    with pytest.raises(ProgramFailed, match="none left"):
        launched("programs: {driver: {command: ['true']}}")


def test_failed_program_is_restarted(launched, golden):
    run = launched(
        f"programs: {{driver: {{{FAST}, {shell('rm ../x.test || { touch ../x.test; exit 3; }')}, cwd: plugins}}}}"
    )
    account = run.account("/driver")
    assert (account.state, account.exit_codes, account.restarts) == ("ended", (3, 0), 1)
    golden("\n".join(account.fates))
    assert ("warning", "restarts") in [(line.level, line.event) for line in run.log.lines]


def test_restarts_have_a_limit(launched):
    with pytest.raises(ProgramFailed, match=r"/driver .*4"):
        launched(f"programs: {{driver: {{{FAST}, {shell('echo again; exit 4')}}}}}")


def test_ended_program_is_restarted_with_always(launched):
    async def act(run):
        await run.log.wait_for("third")

    text = "n=$(cat n 2>/dev/null || echo first); echo $n; case $n in first) echo second > n;; *) echo third > n;; esac"
    run = launched(f"programs: {{driver: {{{FAST.replace('on-failure', 'always')}, {shell(text)}}}}}", act)
    assert run.account("/driver").exit_codes[:2] == (0, 0)


def test_on_exit_shutdown_ends_the_others(launched):
    text = f"programs: {{gui: {{on_exit: shutdown, {shell('echo shut')}}}}}"
    assert launched(QUICK + text).graph.exit_code is ExitCode.OK


def test_environment_folder_and_words_are_given(launched, project):
    run = launched("""
env: {ROBOT: h1, LEVEL: 1}
programs:
  driver:
    cwd: plugins
    env: {LEVEL: 2.5}
    command: [sh, -c, "echo $ROBOT $LEVEL $PWD $1 $PYTHONUNBUFFERED", x, "$HOME"]
""")
    assert f"h1 2.5 {project}/plugins $HOME 1" in run.log.texts("/driver")


def test_node_waits_until_program_is_ready(launched):
    async def act(run):
        await run.log.wait_for("node starts")

    text = f"""
nodes: {{quick: {{plugin: "quick:Quick", depends_on: {{driver: ready}}}}}}
programs: {{driver: {{ready: go on, {shell("echo wait; echo go on now; exec sleep 600")}}}}}
"""
    lines = launched(text, act).log.texts("/driver", "/quick")
    assert lines.index("go on now") < lines.index("node starts") < lines.index("node stops")


def test_program_stops_after_node_that_needs_it(launched, project, monkeypatch):
    async def act(run):
        await run.log.wait_for("ready")

    monkeypatch.chdir(project)
    text = f"""
nodes: {{watcher: {{plugin: "quick:Watcher", depends_on: {{driver: ready}}}}}}
programs: {{driver: {{ready: ready, {shell("echo $$ > driver.pid; echo ready; exec sleep 600")}}}}}
"""
    run = launched(text, act)
    assert run.log.texts("/watcher") == ["the driver is still there"]
    assert run.account("/driver").exit_codes == (-signal.SIGINT,)


def test_program_stops_after_program_that_needs_it(launched):
    async def act(run):
        await run.log.wait_for("viewer on")

    loop = "trap 'echo {0} stopped; exit' INT; echo {0} on; while true; do sleep 0.01; done"
    text = f"""
programs:
  driver: {{ready: driver on, {shell(loop.format("driver"))}}}
  viewer: {{depends_on: {{driver: ready}}, {shell(loop.format("viewer"))}}}
"""
    lines = launched(text, act).log.texts("/driver", "/viewer")
    assert [each for each in lines if "stopped" in each] == ["viewer stopped", "driver stopped"]


def test_programs_wait_for_nodes_and_each_other(launched):
    async def act(run):
        await run.log.wait_for("last")

    text = f"""
nodes: {{quick: {{plugin: "quick:Quick"}}}}
programs:
  last: {{depends_on: {{driver: ready}}, {shell("echo last; exec sleep 600")}}}
  driver: {{depends_on: {{quick: ready}}, ready: first, {shell("echo first; exec sleep 600")}}}
"""
    lines = launched(text, act).log.texts("/driver", "/quick", "/last")
    assert [each for each in lines if not each.startswith("the program")][:3] == ["node starts", "first", "last"]


def test_loop_that_ends_stops_programs(project):
    async def main() -> list[int]:
        run = Launched("programs: {driver: {command: [sleep, 600]}}", project)
        await run.graph.start()
        (extension,) = [each for each in run.graph.course.extensions if each.about()]
        await extension.programs[0].condition_event(Condition.STARTED).wait()
        (about,) = extension.about()["programs"]
        assert (about["program"], about["state"]) == ("/driver", "running")
        return [about["pid"], extension.programs[0]._child.pid]

    assert ended(asyncio.run(main()), PATIENCE_S)


def test_long_wait_for_others_is_logged(launched, project, limits):
    async def act(run):
        await run.log.wait_for("waits for another one")
        (project / "go").touch()
        await run.log.wait_for("last")

    limits(waiting_warning=0.0)
    text = f"""
programs:
  last: {{depends_on: {{driver: ready}}, {shell("echo last; exec sleep 600")}}}
  driver: {{ready: first, {shell("until [ -e go ]; do sleep 0.01; done; echo first; exec sleep 600")}}}
"""
    lines = launched(text, act).log.texts("/driver", "/last")
    (waits,) = (number for number, line in enumerate(lines) if line.startswith("waits "))
    assert waits < lines.index("first") < lines.index("last")


def test_program_of_failed_dependency_never_starts(launched):
    text = f"""
programs:
  last: {{depends_on: {{driver: ready}}, {shell("echo last")}}}
  driver: {{ready: never said, {shell("exit 0")}}}
"""
    with pytest.raises(ProgramFailed, match=r"/last .*/driver"):
        launched(text)


def test_failed_start_of_graph_stops_programs(launched, project):
    text = f"""
nodes: {{quick: {{plugin: "quick:FailsToStart", depends_on: {{driver: ready}}}}}}
programs: {{driver: {{ready: on, {shell("echo $$; echo $$ > pid; echo on; exec sleep 600")}}}}}
"""
    with pytest.raises(NodeFailed, match="no camera"):
        launched(text)
    assert ended([int((project / "pid").read_text())], 0.0)


def test_node_of_program_that_ended_early_fails(launched):
    text = f"""
nodes: {{quick: {{plugin: "quick:Quick", depends_on: {{driver: ready}}}}}}
programs: {{driver: {{ready: never said, {shell("exit 0")}}}}}
"""
    with pytest.raises(NodeFailed, match="/driver") as caught:
        launched(text)
    assert isinstance(caught.value.__cause__, DependencyEnded)


def test_stubborn_program_is_killed_and_named(launched):
    async def act(run):
        await run.log.wait_for("on")

    loop = shell("trap true INT TERM; echo on; while true; do sleep 0.01; done")
    with pytest.raises(ProgramFailed, match=r"/driver .*0\.1 s"):
        launched(f"programs: {{driver: {{grace: 50ms, {loop}}}}}", act)


def test_killed_keeper_is_failure_of_whole_program(launched):
    children = []

    async def act(run):
        await run.log.wait_for("child ")
        children.extend(int(text.split()[1]) for text in run.log.texts("/driver") if text.startswith("child "))
        (extension,) = [each for each in run.graph.course.extensions if hasattr(each, "programs")]
        os.kill(extension.programs[0]._child.pid, signal.SIGKILL)
        await run.graph.wait()

    text = "sh -c 'echo child $$; exec sleep 600' & exec sleep 600"
    with pytest.raises(ProgramFailed, match=r"/driver .*keeper"):
        launched(f"programs: {{driver: {{{shell(text)}}}}}", act)
    assert ended(children, PATIENCE_S)


def test_each_state_leads_to_the_end():
    reached, ways = set(), [ProgramState.WAITING]
    while ways:
        state = ways.pop()
        reached.add(state)
        ways += set(TRANSITIONS[state]) - reached
    assert reached == set(ProgramState) == set(TRANSITIONS)
    final = [state for state, following in TRANSITIONS.items() if not following]
    assert final == [ProgramState.ENDED, ProgramState.FAILED]
