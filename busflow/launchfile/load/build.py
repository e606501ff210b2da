"""Builds a `LaunchDescription` from the merged keys of all files, and checks every name and QoS profile."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

from busflow.bus import names
from busflow.bus.qos import PRESETS, QoS, qos_faults
from busflow.errors import InvalidName
from busflow.launchfile.load.build_network import network_of, ros2_of, unknown_machine
from busflow.launchfile.load.build_programs import programs_of, supervision_of, variables
from busflow.launchfile.load.fixed_frames import frames_nodes
from busflow.launchfile.load.merge import Part
from busflow.launchfile.model.description import (
    ClockSpec,
    EndpointSpec,
    LaunchDescription,
    NodeSpec,
    ProcessSpec,
    ProgramSpec,
    RecordSpec,
    RemapSpec,
    SnapshotSpec,
    Split,
    TopicSpec,
)
from busflow.launchfile.model.keys import ORDER, LaunchKeys, NodeKeys, RecordKeys
from busflow.launchfile.model.placement import MAIN
from busflow.launchfile.model.problems import Problems, key_origin, problem_at, problems
from busflow.launchfile.yaml.value import Value
from busflow.text import did_you_mean

_PACKAGE_NAME = re.compile(r"[A-Za-z0-9][\w.-]*", re.ASCII)
_PROCESS_NAME = re.compile("[A-Za-z][A-Za-z0-9_-]{0,31}")


@dataclass(slots=True)
class Builder:
    """Builds a description without its wrong parts, and collects the problems."""

    part: Part
    keys: LaunchKeys
    problems: Problems
    _profiles: dict[str, QoS] = field(default_factory=dict[str, QoS])
    _packages: dict[str, Path] = field(default_factory=dict[str, Path])

    def build(self, name: str, files: tuple[Path, ...]) -> LaunchDescription:
        """Return the description of everything that is correct."""
        keys = self.keys
        self._packages = _packages_of(self.part.tree.members.get("packages"), self.problems)
        self._profiles = self._named_profiles(self.part.tree.section("qos"))
        nodes = [self._node(key, value) for key, value in self.part.tree.section("nodes").items()]
        clock = keys.clock
        network = network_of(keys, self.part.tree, self.problems)
        return LaunchDescription(
            name=keys.name or name,
            nodes=(*filter(None, nodes), *frames_nodes(self.part.tree.members.get("frames"), self.problems)),
            topics=tuple(self._topics()),
            folders=tuple(self.part.folders),
            interfaces=tuple(self.part.interfaces),
            packages=self._packages,
            processes=tuple(self._processes()),
            programs=tuple(self._programs()),
            network=network,
            ros2=ros2_of(keys, self.part.tree, network, self.problems),
            line=keys.network.line,
            clock=ClockSpec(clock.mode, clock.start, clock.rate),
            seed=clock.seed if keys.seed is None else keys.seed,
            record=None if keys.record is None else record_spec(keys.record),
            expect=self.part.tree.members.get("expect"),
            shutdown_grace_s=keys.shutdown.grace,
            environment=variables(self.part.tree.members.get("env", self.part.tree.without(()))),
            files=files,
            resolved=self._resolved(),
        )

    def _resolved(self) -> Value:
        """Return everything as one launch file, with its keys in the usual order."""
        tree = self.part.tree
        members = dict(tree.members)
        for key, stated in (("plugins", self.part.folders), ("interfaces", self.part.interfaces)):
            if stated:
                folders = [Value(str(folder.path.resolve()), folder.origin) for folder in stated]
                members[key] = Value(list(folders), tree.origin)
        if self._packages:
            stated = members["packages"]
            whole = {name: replace(stated.members[name], content=str(path)) for name, path in self._packages.items()}
            members["packages"] = replace(stated, content=whole)
        ordered = {key: members[key] for key in ORDER if key in members}
        if "nodes" in ordered:  # the keys from a file's defaults stand first in an entry
            nodes = {key: _ordered(node) for key, node in ordered["nodes"].members.items()}
            ordered["nodes"] = replace(ordered["nodes"], content=nodes)
        return replace(tree, content=ordered)

    def _node(self, key: str, value: Value) -> NodeSpec | None:
        stated = self.keys.nodes.get(key)
        if stated is None or stated.plugin is None or not stated.when:
            return None
        space, _, name = key.rpartition("/")
        namespace, origin = f"/{space}", key_origin(value)
        right = self._named(names.node_name_fault, "node name", name, value)
        right = self._named(names.namespace_fault, "namespace", namespace, value) and right
        if not right:
            return None
        members = value.members
        own = self.part.own_folders.get(key, ())
        others = (folder.path for folder in self.part.folders)
        return NodeSpec(
            name=name,
            namespace=namespace,
            origin=origin,
            plugin=stated.plugin,
            plugin_origin=members["plugin"].origin,
            parameters=_mapping(members.get("parameters"), value),
            folders=tuple(dict.fromkeys([*own, *others])),
            remap=tuple(self._remap(stated, value)),
            publishers=tuple(self._endpoints(value.section("publishers"))),
            subscriptions=tuple(self._endpoints(value.section("subscriptions"))),
            supervision=supervision_of(stated),
            depends_origins={f"/{key}": key_origin(each) for key, each in value.section("depends_on").items()},
            process=self._process(stated, value),
            machine=self._machine(stated, value),
        )

    def _process(self, stated: NodeKeys, node: Value) -> str | None:
        """Return the process of a node; None for the main process."""
        name = stated.process
        if name is not None and name != MAIN and name not in self.keys.processes:
            fix = f"{did_you_mean(name, [MAIN, *self.keys.processes])}; or add it: processes: {{{name}: {{}}}}"
            origin = node.members["process"].origin
            self.problems.add(problem_at("unknown-process", f"there is no process {name}", fix, origin), left_out=())
        return None if name == MAIN else name

    def _machine(self, stated: NodeKeys, node: Value) -> str | None:
        """Return the machine of a node, which is that of its process; None for the main machine."""
        process = self.keys.processes.get(stated.process or MAIN)
        if process is None:
            return self._known_machine(stated.machine, node)
        if stated.machine is not None and stated.machine != (process.machine or MAIN):
            text = f"the process {stated.process} is on the machine {process.machine or MAIN}, not on {stated.machine}"
            fix = f"write machine: {stated.machine} below processes: {stated.process}, or leave it out here"
            self.problems.add(problem_at("other-machine", text, fix, node.members["machine"].origin), left_out=())
        return None if process.machine == MAIN else process.machine

    def _known_machine(self, name: str | None, entry: Value) -> str | None:
        """Return the machine that an entry names, and report an unknown one; None for the main machine."""
        if name is not None and name != MAIN and name not in self.keys.machines:
            text, fix = unknown_machine(name, self.keys.machines)
            self.problems.add(problem_at("unknown-machine", text, fix, entry.members["machine"].origin), left_out=())
        return None if name == MAIN else name

    def _processes(self) -> Iterator[ProcessSpec]:
        for name, value in self.part.tree.section("processes").items():
            stated = self.keys.processes[name]
            if name == MAIN:
                message, fix = "main is the process that busflow run itself is", "choose another name"
                self.problems.add(problem_at("invalid-name", message, fix, key_origin(value)), left_out=())
            elif self._named(_process_name_fault, "process name", name, value):
                env = variables(value.members.get("env", value.without(())))
                machine = self._known_machine(stated.machine, value)
                policy = stated.restart.as_policy()
                yield ProcessSpec(name, key_origin(value), machine, stated.nice, env, policy, stated.hang)

    def _programs(self) -> Iterator[ProgramSpec]:
        for program in programs_of(self.keys, self.part.tree, self.problems):
            self._known_machine(program.machine, self.part.tree.section("programs")[program.name.removeprefix("/")])
            yield program

    def _remap(self, stated: NodeKeys, node: Value) -> list[RemapSpec]:
        rules: list[RemapSpec] = []
        entries = node.section("remap")
        for match, replacement in stated.remap.items():
            value = entries[match]
            right = self._topic(match, value)
            right = self._topic(replacement, value, at_key=False) and right
            if right:
                rules.append(RemapSpec(match, replacement, key_origin(value)))
        return rules

    def _topics(self) -> list[TopicSpec]:
        found: list[TopicSpec] = []
        for name, value in self.part.tree.section("topics").items():
            stated = self.keys.topics[name]
            if not stated.when:
                continue
            entry = value.members.get("qos")
            qos = (self._qos(entry) if entry is not None and entry.content is not None else None) or QoS()
            if self._named(names.full_topic_name_fault, "topic name", name, value):
                origin = key_origin(value)
                found.append(
                    TopicSpec(name, qos, entry or value, origin, stated.type, stated.history, external=stated.external)
                )
        return found

    def _endpoints(self, section: Mapping[str, Value]) -> list[EndpointSpec]:
        found: list[EndpointSpec] = []
        for topic, value in section.items():
            qos = self._qos(value) or QoS()
            if self._topic(topic, value):
                found.append(EndpointSpec(topic, qos, value, key_origin(value)))
        return found

    def _named_profiles(self, stated: Mapping[str, Value]) -> dict[str, QoS]:
        found: dict[str, QoS] = {}
        for name, value in stated.items():
            if name in PRESETS:
                message, fix = f"{name} is a built-in profile", "choose another name"
                self.problems.add(problem_at("duplicate-profile", message, fix, key_origin(value)), left_out=[("qos",)])
            qos = self._qos(value)
            if qos is not None:
                found[name] = qos
        return found

    def _qos(self, value: Value) -> QoS | None:
        """Return a QoS profile stated by name or by its fields; None if it is wrong."""
        if isinstance(value.content, str):
            known = {**PRESETS, **self._profiles}
            if value.content in known:
                return known[value.content]
            # A wrong profile is reported where it is stated.
            if value.content not in self.part.tree.section("qos"):
                message = f"there is no QoS profile {value.content}"
                fix = did_you_mean(value.content, known)
                self.problems.add(problem_at("unknown-profile", message, fix, value.origin), left_out=[("qos",)])
            return None
        data = cast("dict[str, Any]", value.data)
        found = qos_faults(data)
        if "qos" in data:
            without = "write the profile's name, or its fields, without `qos:`"
            found = [replace(fault, fix=without) if fault.path == ("qos",) else fault for fault in found]
        self.problems.add(*problems(found, value, noun="key"), left_out=[("qos",)])
        return None if found else QoS.model_validate(data)

    def _topic(self, name: str, value: Value, *, at_key: bool = True) -> bool:
        """Return whether a topic name is valid, as written and expanded; report it if not."""

        def find(name: str) -> names.NameFault | None:
            fault = names.topic_name_fault(name)
            try:
                return fault or names.full_topic_name_fault(names.expand(name, node="node", namespace="/"))
            except InvalidName as error:
                reason = str(error).partition("\n")[0].removeprefix(f"topic name {name!r}: ")
                return names.NameFault("not_expandable", 0, reason)

        return self._named(find, "topic name", name, value, at_key=at_key)

    def _named(
        self,
        find: Callable[[str], names.NameFault | None],
        what: str,
        name: str,
        value: Value,
        *,
        at_key: bool = True,
    ) -> bool:
        """Return whether a name is valid; if not, report it at its key or its value."""
        fault = find(name)
        if fault is not None:
            origin = key_origin(value) if at_key else value.origin
            self.problems.add(problem_at("invalid-name", f"{what} {name!r}: {fault.message}", None, origin))
        return fault is None


def record_spec(keys: RecordKeys) -> RecordSpec:
    """Return the recording that the keys describe."""
    split = None if keys.split is None else Split(keys.split.size, keys.split.duration)
    snapshot = None if keys.snapshot is None else SnapshotSpec(keys.snapshot, keys.bytes, keys.after or 0.0)
    topics, exclude = tuple(keys.topics), tuple(keys.exclude)
    return RecordSpec(keys.to, topics, exclude, keys.on_drop, keys.compression, split, snapshot)


def _packages_of(stated: Value | None, problems: Problems) -> dict[str, Path]:
    """Return the folders by name; report names that no address can have, and folders that are not there."""
    found: dict[str, Path] = {}
    for name, value in stated.members.items() if stated is not None else ():
        folder = Path(str(value.content))
        if not _PACKAGE_NAME.fullmatch(name):
            message, fix = f"{name!r} is no name of a package", "letters, digits, _, - and . make it"
            problems.add(problem_at("invalid-name", message, fix, key_origin(value)), left_out=[("packages",)])
        elif not folder.is_dir():
            message, fix = f"there is no folder {folder}", "name the package's folder, relative to this file"
            problems.add(problem_at("missing-folder", message, fix, value.origin), left_out=[("packages",)])
        else:
            found[name] = folder.resolve()
    return found


def _process_name_fault(name: str) -> names.NameFault | None:
    if _PROCESS_NAME.fullmatch(name):
        return None
    return names.NameFault("not_allowed", 0, "it is made of up to 32 letters, digits, _ and -, a letter first")


def _ordered(node: Value) -> Value:
    """Return a node's entry with `when` and `plugin` first."""
    first = [key for key in ("when", "plugin") if key in node.members]
    return replace(node, content={key: node.members[key] for key in dict.fromkeys([*first, *node.members])})


def _mapping(stated: Value | None, node: Value) -> Value:
    """Return the stated mapping, or an empty one at the node's own key."""
    if stated is not None and isinstance(stated.content, dict):
        return stated
    return replace(node, content={})
