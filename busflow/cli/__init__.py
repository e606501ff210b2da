"""The `busflow` command: its groups, the printing of errors, and exit codes. Imports nothing heavy."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Sequence
from itertools import takewhile

import click

import busflow
from busflow.cli.root import Root
from busflow.cli.ros_words import instead_of_option
from busflow.cli.terminal.output import colour, discard_output, messages_lost, print_line, print_message
from busflow.errors import BusflowError, ExitCode, InvalidDefinition, InvalidInput, LaunchError, PluginError
from busflow.text import did_you_mean

_COMMANDS = {
    "run": ("busflow.cli.run:run", "Run a launch file until Ctrl-C."),
    "test": ("busflow.cli.test:test", "Run a launch file on simulated time and check what it expects."),
    "check": ("busflow.cli.check:check", "Find everything wrong with a launch file, without running it."),
    "config": ("busflow.cli.config:config", "Show the resolved launch file, and where each value came from."),
    "graph": ("busflow.cli.graph:graph", "Draw the nodes and topics of a running graph, or of a launch file."),
    "ps": ("busflow.cli.ps:ps", "List what runs on this machine."),
    "topic": ("busflow.cli.topic:topic", "Look at the topics of a running graph, and publish to them."),
    "node": ("busflow.cli.node:node", "Look at the nodes of a running graph."),
    "tf": ("busflow.cli.tf:tf", "Look at the frames of a running graph, or of a recording."),
    "service": ("busflow.cli.service:service", "Look at the services of a running graph, and call them."),
    "action": ("busflow.cli.action:action", "Look at the actions of a running graph, and send them goals."),
    "param": ("busflow.cli.param:param", "Look at the parameters of running nodes, and set them."),
    "bag": ("busflow.cli.bag:bag", "Look at recordings, and work with them."),
    "replay": ("busflow.cli.replay:replay", "Run nodes again on a recording and compare with it."),
    "log": ("busflow.cli.log:log", "Show the log of a running graph."),
    "ui": ("", "Show a running graph in a browser."),
    "foxglove": ("", "Serve a running graph to Foxglove and Lichtblick."),
    "dds": ("busflow.cli.dds:dds", "Connect a running graph with nodes of ROS 2 that speak DDS."),
    "top": ("busflow.cli.top:top", "Watch a running graph, live in the terminal."),
    "doctor": ("busflow.cli.doctor:doctor", "Check the running graphs, and what they need on this machine."),
    "interface": ("busflow.cli.interface:interface", "Look at message and service types."),
    "schema": ("busflow.cli.schema:schema", "Write the JSON Schema with which an editor completes a launch file."),
    "plugins": ("busflow.cli.plugins:plugins", "List the available plugins, or describe one."),
    "completion": ("busflow.cli.completion:completion", "Print the script for completion in a shell."),
    "certs": ("busflow.cli.certs:certs", "Make the certificates that link machines."),
    "new": ("busflow.cli.new:new", "Make a small project that runs and whose tests pass."),
}
_APART = {"foxglove": "busflow-ui", "ui": "busflow-ui"}
"""The commands that another distribution of this project provides, each with its name."""
_HELP = """A robot's node graph that you pip install.

\b
Examples:
  busflow new my_robot
  busflow run configs/lab1.yaml rate_hz:=50
  busflow check configs/lab1.yaml
"""


def _show_version(ctx: click.Context, _option: click.Parameter, given: bool) -> None:
    if given and not ctx.resilient_parsing:
        click.echo(f"busflow {busflow.__version__}")
        ctx.exit()


_OPTIONS = [
    click.Option(
        ["--version"], is_flag=True, is_eager=True, expose_value=False, callback=_show_version, help="Show the version."
    ),
    click.Option(["--traceback"], is_flag=True, help="Show where in busflow an error arose."),
]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the console script, and return its exit code."""
    from busflow.runner.own_process import children, leave

    arguments, before = list(sys.argv[1:] if argv is None else argv), children()
    code: int = ExitCode.OK
    try:
        code = _answer(arguments)
        if sys.stdout:  # None where the shell closed it: `busflow … >&-`
            sys.stdout.flush()
    except KeyboardInterrupt:
        code = ExitCode.INTERRUPTED
    except OSError as error:
        discard_output()
        if isinstance(error, BrokenPipeError):
            return code  # the reader of our output has closed it: `busflow config … | head -1`
        where = f": {error.filename}" if error.filename else ", on writing the output"
        if error.errno == errno.EMFILE:
            where = ": allow more, for instance with ulimit -n 1024"
        print_message(f"error: {error.strerror}{where}")
        return ExitCode.FAILED
    finally:
        if sys.stderr:  # None where the shell closed it: `busflow … 2>&-`
            with messages_lost():
                sys.stderr.flush()
    if argv is None:
        leave(code, before)
    return code


def _answer(arguments: list[str]) -> int:
    """Run the command; print what goes wrong once, on standard error."""
    root = Root(_COMMANDS, _APART, help=_HELP, context_settings={"help_option_names": ["-h", "--help"]})
    root.params += _OPTIONS
    if "_BUSFLOW_COMPLETE" in os.environ:
        from busflow.cli.completion import complete

        return complete(root)
    try:
        options = takewhile(lambda word: word != "--", [*arguments])  # click empties the list
        with root.make_context("busflow", arguments, color=colour()) as context:
            return _invoke(root, context, as_json="--json" in options)
    except click.exceptions.Exit as end:
        return end.exit_code
    except click.Abort:
        return ExitCode.INTERRUPTED
    except click.ClickException as error:
        print_message(_usage(error))
        return ExitCode.USAGE


def _invoke(root: Root, context: click.Context, *, as_json: bool) -> int:
    try:
        import busflow.timeouts as _  # noqa: F401  # a wrong limit in the environment is an error of each command

        return int(root.invoke(context) or ExitCode.OK)
    except BusflowError as error:
        if context.params["traceback"]:
            _print_traceback(error)
        rendered = isinstance(error, InvalidDefinition | InvalidInput | LaunchError | PluginError)
        print_message(str(error) if rendered else f"error: {error}")
        if as_json:
            print_line({"error": error.as_json()})
        return error.exit_code
    except (click.ClickException, click.Abort, click.exceptions.Exit, OSError):
        raise
    except Exception as error:  # noqa: BLE001  # the last resort: printed in full, but no escape reaches the terminal
        _print_traceback(error)
        print_message(
            f"error: this is a bug in {root.owner(context.invoked_subcommand)}; please report it with the lines above"
        )
        return ExitCode.FAILED


def _print_traceback(error: Exception) -> None:
    import traceback

    print_message("".join(traceback.format_exception(error)))


def _usage(error: click.ClickException) -> str:
    message = error.format_message().replace("\n\t", " ")  # click lists the choices line by line
    message = message.replace(" range.", ".")  # of 'abc' it says "not a valid integer range"
    context = error.ctx if isinstance(error, click.UsageError) else None
    if context and isinstance(error, click.NoSuchOption):
        message = f"there is no option {error.option_name}: {_option_meant(error.option_name, context)}"
    takes_values = context is not None and any(each.name == "values" for each in context.command.params)
    if takes_values and "unexpected extra argument" in message:
        message += "; VALUES is one word for the shell: quote it"
    help_ = [context.get_usage(), f"Try '{context.command_path} --help'."] if context else []
    return "\n".join([f"error: {message}", *help_])


def _option_meant(name: str, context: click.Context) -> str:
    """Return a hint for an unknown option; an option of a group's verbs, such as `--run`, goes after the verb."""
    group = context.command
    if instead := instead_of_option(group.name, name):
        return instead
    verbs = group.list_commands(context) if isinstance(group, click.Group) else []
    for verb in verbs if context.parent else []:
        command = group.get_command(context, verb) if isinstance(group, click.Group) else None
        if command is not None and any(name in each.opts for each in command.params):
            return f"give it after the verb: {context.command_path} {verb} {name}"
    near = did_you_mean(name, [each for option in group.get_params(context) for each in option.opts if each[0] == "-"])
    if any(":=" in (each.metavar or "") for each in group.params):
        near += f"\n  an argument of the launch file is written {name.lstrip('-').replace('-', '_')}:=VALUE"
    return near
