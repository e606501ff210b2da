"""`busflow interface list`, `show`, `proto`, `package`, `packages`: show types, those of a running graph too."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from busflow.actions.names import action_type_of
from busflow.cli.interface import EXAMPLES
from busflow.cli.options.interfaces import takes_interfaces
from busflow.cli.options.run import completer, joined, joins
from busflow.cli.terminal.output import print_answer, print_found
from busflow.definitions.definition import Kind, kind_of
from busflow.definitions.folders import library, name_folders, named_folders
from busflow.errors import BusflowError, NoSuchTarget
from busflow.interfaces.encoding.builtin_types import Comments, builtin_types
from busflow.interfaces.encoding.description import IndividualDescription, TypeDescription, assemble, types_in
from busflow.text import did_you_mean, printable

_WHOLES = {"_SendGoal": "request", "_GetResult": "response", "_FeedbackMessage": ""}
"""The types of a run in which the parts of an action are: goal, result and feedback."""
_KINDS = {"msg": "Messages", "srv": "Services", "action": "Actions"}


@dataclass(frozen=True, slots=True)
class _Known:
    """The known types: all full names, and the descriptions that the running graph gives of its own types."""

    names: tuple[str, ...]
    described: Mapping[str, Mapping[str, Any]]

    def of_kind(self, kind: str) -> list[str]:
        """Return the names of the messages (`msg`), services (`srv`) or actions (`action`)."""
        return [name for name in self.names if f"/{kind}/" in name]


@completer
def complete_interfaces(context: click.Context, _incomplete: str) -> Iterator[tuple[str, None]]:
    """Yield the names of the known types."""
    yield from ((name, None) for name in _known(context.params.get("run")).names)


@click.command("list", epilog=EXAMPLES)
@click.option("-m", "--only-msgs", "messages", is_flag=True, help="Only messages.")
@click.option("-s", "--only-srvs", "services", is_flag=True, help="Only services.")
@click.option("-a", "--only-actions", "actions", is_flag=True, help="Only actions.")
@takes_interfaces
@joins
def list_(run: str | None, messages: bool, services: bool, actions: bool, as_json: bool) -> None:
    """List busflow's own types, those of definition files, and those of the running graph, if there is one."""
    known = _known(run)
    chosen = [kind for kind, wanted in zip(_KINDS, (messages, services, actions), strict=True) if wanted] or list(
        _KINDS
    )
    if as_json:
        print_answer({_KINDS[kind].lower(): known.of_kind(kind) for kind in chosen})
        return
    for kind in chosen:
        click.echo(f"{_KINDS[kind]}:")
        click.echo("".join(f"    {printable(name)}\n" for name in known.of_kind(kind)), nl=False)


@click.command(epilog=EXAMPLES)
@click.argument("name", metavar="TYPE", shell_complete=complete_interfaces)
@click.option("--no-comments", is_flag=True, help="Only the fields.")
@click.option("--all-comments", is_flag=True, help="Also the comments of nested types.")
@takes_interfaces
@joins
def show(run: str | None, name: str, no_comments: bool, all_comments: bool, as_json: bool) -> None:
    """Show TYPE in the form of a .msg, .srv or .action file, with nested types indented."""
    full, known = _found(run, name)
    if as_json:
        parts = dict(_descriptions(full, known))
        print_answer({"name": full, "description": parts if len(parts) > 1 else next(iter(parts.values()))})
        return
    depth = 0 if no_comments else 99 if all_comments else 1
    lines = _comment_lines(full) if depth and "/msg/" not in full and _comments(full).text else []
    for number, (part, description) in enumerate(_descriptions(full, known)):
        lines += ["---"] * (number > 0)
        lines += _lines(part, description, depth)
    click.echo("\n".join(lines))


@click.command(epilog=EXAMPLES)
@click.argument("name", metavar="TYPE", shell_complete=complete_interfaces)
@click.option("--no-quotes", is_flag=True, help="Without the quotes around it, which a shell needs.")
@takes_interfaces
@joins
def proto(run: str | None, name: str, no_quotes: bool, as_json: bool) -> None:
    """Show a message of TYPE, a service's request or an action's goal, with its defaults: YAML for topic pub."""
    full, known = _found(run, name)
    _, description = next(_descriptions(full, known))
    values = _new(description)
    if as_json:
        print_answer({"name": full, "values": values})
        return
    from busflow.cli.terminal.yaml_text import yaml_lines

    quote = "" if no_quotes else '"'
    click.echo(quote + "".join(f"{line}\n" for line in yaml_lines(values)) + quote, nl=not no_quotes)


@click.command(epilog=EXAMPLES)
@click.argument("name", metavar="PACKAGE")
@takes_interfaces
@joins
def package(run: str | None, name: str, as_json: bool) -> None:
    """List the types of PACKAGE."""
    known = _known(run)
    found = [each for each in known.names if each.startswith(f"{name}/")]
    if not found:
        unknown = f"no package {printable(name)} has types; {did_you_mean(name, _packages(known))}"
        raise NoSuchTarget(library().unreadable(name) or unknown)
    print_found({"package": name, "types": found}, found, as_json=as_json)


@click.command(epilog=EXAMPLES)
@takes_interfaces
@joins
def packages(run: str | None, as_json: bool) -> None:
    """List the packages that have types."""
    found = _packages(_known(run))
    print_found({"packages": found}, found, as_json=as_json)


# The known types.


def _present() -> _Known:
    """Return the built-in types and those of definition files."""
    return _Known(tuple(sorted({*builtin_types().names, *library().names})), {})


def _known(run: str | None) -> _Known:
    """Return these and the types of the run; without a run's name there need not be one."""
    described: dict[str, Mapping[str, Any]] = {}
    try:
        with joined(run) as peer:
            folders = [Path(each) for answer in peer.ask("run") for each in answer.get("interfaces", ())]
            name_folders([*named_folders(), *folders])
            for question in ("types", "services"):
                for answer in peer.ask(question):
                    described |= answer
    except BusflowError:  # there need not be a run, and one that hangs must not hide the built-in types
        if run is not None:
            raise
    services = {each["type"]: each for each in described.values() if "request" in each}
    described = {name: each for name, each in described.items() if "request" not in each} | services
    derived = {name: action_type_of(name) for name in described}
    actions = {each for each in derived.values() if each and all(f"{each}{part}" in described for part in _WHOLES)}
    plain = {name for name, action in derived.items() if action is None}
    return _Known(tuple(sorted({*_present().names, *plain, *actions})), described)


def _found(run: str | None, name: str) -> tuple[str, _Known]:
    """Return a type's full name and the known types; the running graph is asked only where it alone can know it."""
    known = _present() if run is None else _known(run)
    try:
        return _full(name, known), known
    except NoSuchTarget:
        known = _known(run)
        return _full(name, known), known


def _full(name: str, known: _Known) -> str:
    """Return the full name of a type, whose middle part may be left out: sensor_msgs/Imu."""
    package, _, last = name.partition("/")
    for full in (name, *(f"{package}/{kind}/{last}" for kind in _KINDS)):
        if full in known.names:
            return full
    unknown = f"there is no type {printable(name)}; {did_you_mean(name, known.names)}"
    raise NoSuchTarget(library().unreadable(name) or unknown)


def _packages(known: _Known) -> list[str]:
    return sorted({name.partition("/")[0] for name in known.names})


def _descriptions(name: str, known: _Known) -> Iterator[tuple[str, Any]]:
    """Yield the description of a message type; for a service or an action, those of its parts."""
    files, builtin = library(), builtin_types()
    kind = kind_of(name)
    parts = [f"{name}{part}" for part in kind.parts] if kind is not None else []
    if name in files:
        yield from ((part, files.description(part)) for part in parts)
    elif name in builtin.names:
        yield from ((part, builtin.description(part)) for part in parts)
    elif kind is Kind.ACTION:
        for part, (suffix, half) in zip(parts, _WHOLES.items(), strict=True):
            whole = known.described[f"{name}{suffix}"]
            yield part, assemble(part, types_in((whole[half] if half else whole)["description"]))
    elif "request" in known.described[name]:
        halves = known.described[name]
        yield from ((f"{name}_{part}", halves[part.lower()]["description"]) for part in ("Request", "Response"))
    else:
        yield name, known.described[name]["description"]


# Showing a type.


def _new(description: Any) -> Any:
    """Return the values of a new message; a field of a JSON Schema that has to be given is None."""
    if "type_description" not in description:  # a type that ROS cannot describe
        return {field: each.get("default") for field, each in description.get("properties", {}).items()}
    from busflow.cli.terminal.abridged import Abridger
    from busflow.interfaces.encoding.plain_reader import decoder_from_description
    from busflow.interfaces.encoding.plain_writer import encoder_from_description

    return Abridger(None)(decoder_from_description(description)(encoder_from_description(description)({})))


def _lines(name: str, description: TypeDescription, depth: int) -> list[str]:
    """Return the lines of a type's file, nested types indented by tabs; comments are shown down to `depth` levels."""
    if "type_description" not in description:
        import json  # a type that ROS cannot describe has a JSON Schema

        return json.dumps(description, indent=2).split("\n")
    inner = {each["type_name"]: each for each in description["referenced_type_descriptions"]}
    return list(_type_lines(name, description["type_description"], inner, 0, depth))


def _type_lines(
    name: str, described: IndividualDescription, inner: Mapping[str, IndividualDescription], level: int, depth: int
) -> Iterator[str]:
    from busflow.interfaces.encoding.msg_text import ros2msg

    comments = _comments(name) if level < depth else Comments()
    indent = "\t" * level
    if comments.text:
        yield from (indent + line for line in _comment_lines(name))
    own = ros2msg({"type_description": described, "referenced_type_descriptions": []})
    nested = [field["type"]["nested_type_name"] for field in described["fields"]]
    constants = len(described.get("constants", []))
    for number, line in enumerate(own.splitlines()):
        word = line.split(" ")[1].partition("=")[0]
        comment = comments.fields.get(word, "").replace("\n", " ")
        yield f"{indent}{printable(line)}" + (f" # {printable(comment)}" if comment else "")
        type_ = nested[number - constants] if number >= constants else ""
        if type_:
            yield from _type_lines(type_, inner[type_], inner, level + 1, depth)


def _comment_lines(name: str) -> list[str]:
    """Return the comment of a type, and an empty line."""
    return [*(f"# {line}".rstrip() for line in _comments(name).text.split("\n")), ""]


def _comments(name: str) -> Comments:
    files = library()
    if name in files:
        definition = files.definition(files.owner(name) or name)
        part = next((each for each in definition.parts if each.name == name), None)
        if part is None:
            return Comments(definition.comment)
        fields = {each.field.name: each.comment for each in part.fields}
        constants = {each.name: each.comment for each in part.constants}
        text = definition.comment if definition.kind is Kind.MESSAGE else part.comment
        return Comments(text, fields | constants)
    try:
        return builtin_types().comments(name)
    except KeyError:  # a type of the user: a run does not send comments
        return Comments()
