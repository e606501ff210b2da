"""Reads a robot from its URDF file; every mistake is a problem at its line.

Links and joints make one tree. Elements for simulators and drivers (`gazebo`, `transmission`, `ros2_control`) are left
alone. A mesh that is not there is a warning: where the links are does not depend on it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from math import hypot
from pathlib import Path

from busflow.description.packages import SCHEME, package_file
from busflow.description.parts import check_parts, version_of
from busflow.description.reading import Reading
from busflow.description.robot import MOVES, Joint, JointKind, Robot
from busflow.description.xml_file import Element, XmlFile
from busflow.errors import LaunchError, NoSuchTarget
from busflow.frames.rigid import Rigid, Rotation, Vector, from_rpy
from busflow.text import did_you_mean, printable, quoted

MOST_PARTS = 1000
"""The most links, and joints; a humanoid with two hands has some hundred."""
MOST_MIMICS = 32
"""The most joints over which one mimics another."""
_LIMITED = {JointKind.REVOLUTE, JointKind.PRISMATIC}
"""The kinds that need limits."""
_XACRO = frozenset({"include", "macro", "property", "arg", "if", "unless", "insert_block", "call", "element"})
"""The statements of xacro."""
_REMOTE = ("http://", "https://")
"""Addresses that are the viewers' to read."""


def read_robot(path: Path, packages: Mapping[str, Path]) -> Robot:
    """Return the robot that a file describes.

    Args:
        path: The URDF file.
        packages: The folders that `package://` addresses in it begin at, by name.

    Raises:
        LaunchError: With every mistake in it.
    """
    reading = Reading(XmlFile(path))
    robot = _Reader(reading, packages).robot()
    if reading.problems:
        raise LaunchError(reading.problems)
    return replace(robot, doubts=reading.doubts)


class _Reader:
    """Reads the elements of one file and collects the problems."""

    def __init__(self, reading: Reading, packages: Mapping[str, Path]) -> None:
        self._reading, self._file, self._report = reading, reading.file, reading.report
        self._packages = packages
        self._version = 0
        self._links: dict[str, Element] = {}
        self._joints: dict[str, Element] = {}
        self._joint_of: dict[str, Joint] = {}
        """By link, the joint that it hangs on."""

    def robot(self) -> Robot:
        """Return the robot; it is only whole where there are no problems."""
        root = self._file.root
        if self._needs_xacro(root):
            return Robot("", "", (), "")
        if root.tag != "robot":
            message = f"the file holds a {printable(root.tag, limit=100)}, not a robot"
            self._report("no-robot", message, "a URDF file begins with <robot name=…>", root)
            return Robot("", "", (), "")
        self._version = version_of(root, self._reading)
        self._links = self._named(root, "link")
        if not self._links:
            self._report("no-link", "the robot has no link", 'add <link name="base_link"/>', root)
        self._joints = self._named(root, "joint")
        joints = [self._joint(name, element) for name, element in self._joints.items()]
        joints = self._with_sources([each for each in joints if each is not None])
        check_parts(root, self._version, self._reading)
        if not self._reading.problems:
            self._check_tree()
        self._check_files(root)
        roots = (link for link in self._links if link not in self._joint_of)
        return Robot(root.attributes.get("name", ""), next(roots, ""), tuple(joints), self._file.text)

    def _needs_xacro(self, root: Element) -> bool:
        """Report the first statement of xacro; it would be run, and busflow runs no code of files."""
        found = [each for each in root.within() if each.tag.startswith("xacro:")]
        statement = next((each for each in found if each.tag.removeprefix("xacro:") in _XACRO), None)
        if statement is None:
            for each in found:  # xacro leaves the call of an unknown macro as it is
                message = f"<{printable(each.tag, limit=100)}> is a macro that xacro did not know: it is left out"
                self._reading.doubt("xacro", message, "include the file that defines it", each)
            return False
        path = self._file.path
        plain = f"{path.with_suffix('').name.removesuffix('.urdf')}.urdf"
        if plain == path.name:
            plain = f"expanded_{plain}"
        message = (
            f"<{printable(statement.tag, limit=100)}> is xacro, a program that makes a URDF file; it is not run here"
        )
        fix = f"expand it first: xacro {printable(path.name)} > {printable(plain)}, and name {printable(plain)}"
        self._report("xacro", message, fix, statement)
        return True

    # Elements.

    def _named(self, root: Element, tag: str) -> dict[str, Element]:
        """Return the elements of a tag by name; report those without a name, and those whose name is taken."""
        found: dict[str, Element] = {}
        for each in root.all(tag):
            name = each.attributes.get("name", "")
            if len(found) == MOST_PARTS:
                fix = "let each robot have a file and a robot_state_publisher of its own"
                self._report("too-many", f"there are more than {MOST_PARTS} {tag}s", fix, each)
                break
            if not name:
                self._report("missing-name", f"this {tag} has no name", f'write <{tag} name="…">', each)
            elif name in found:
                first = self._file.place(found[name], "name").line
                message = f"two {tag}s are called {quoted(name)}; the first is in line {first}"
                self._report("duplicate-name", message, "rename one of them", each, "name")
            else:
                found[name] = each
        return found

    def _joint(self, name: str, element: Element) -> Joint | None:
        kind = self._kind(name, element)
        parent, child = (self._end(name, element, tag) for tag in ("parent", "child"))
        origin = self._origin(element)
        axis = self._axis(name, element) if kind in MOVES else (1.0, 0.0, 0.0)
        if kind is None or parent is None or child is None:
            return None
        self._check_limit(name, kind, element)
        joint = Joint(name, kind, parent, child, origin, axis, source=name)
        if child in self._joint_of:
            other = self._joint_of[child]
            message = f"the link {quoted(child)} hangs on two joints, {quoted(other.name)} and {quoted(name)}"
            place = self._file.place(self._joints[other.name]).line
            self._report("two-parents", message, f"leave one out; the first is in line {place}", element, "name")
            return None
        self._joint_of[child] = joint
        return joint

    def _kind(self, name: str, element: Element) -> JointKind | None:
        stated = element.attributes.get("type", "")
        with suppress(ValueError):
            return JointKind(stated)
        what = f"{quoted(stated)} is not a type of joint" if stated else f"the joint {quoted(name)} has no type"
        fix = did_you_mean(stated, JointKind) if stated else f"known: {', '.join(JointKind)}"
        self._report("joint-type", what, fix, element, "type")
        return None

    def _end(self, name: str, element: Element, tag: str) -> str | None:
        """Return the link at one end of a joint; report an unknown one, and return None."""
        end = element.first(tag)
        link = end.attributes.get("link", "") if end is not None else ""
        if end is None or not link:
            message = f"the joint {quoted(name)} has no {tag}"
            self._report("missing-link", message, f'add <{tag} link="…"/>', end or element)
            return None
        if link not in self._links:
            message = f"there is no link {quoted(link)}, the {tag} of the joint {quoted(name)}"
            fix = did_you_mean(link, self._links, none=f"add <link name={quoted(link)}/>")
            self._report("unknown-link", message, fix, end, "link")
            return None
        return link

    def _origin(self, element: Element) -> Rigid:
        origin = element.first("origin")
        if origin is None:
            return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        return (*self._triple(origin, "xyz", "0 0 0"), *self._rotation(origin))

    def _rotation(self, origin: Element) -> Rotation:
        """Return the rotation, which files of version 1.1 or later may state as a quaternion."""
        if "quat_xyzw" not in origin.attributes:
            return from_rpy(*self._triple(origin, "rpy", "0 0 0"))
        numbers = self._reading.numbers(origin, "quat_xyzw", "0 0 0 1")
        if numbers is not None and not any(numbers):
            message, fix = "four zeros are no rotation", 'write quat_xyzw="0 0 0 1"'
            self._report("bad-number", message, fix, origin, "quat_xyzw")
            numbers = None
        x, y, z, w = _unit(numbers or (0.0, 0.0, 0.0, 1.0))
        return (x, y, z, w)

    def _axis(self, name: str, element: Element) -> Vector:
        axis = element.first("axis")
        if axis is None:
            return (1.0, 0.0, 0.0)
        vector = self._triple(axis, "xyz", "1 0 0") if "xyz" in axis.attributes else (0.0, 0.0, 0.0)
        if not any(vector):
            message = f"the axis of the joint {quoted(name)} has no direction"
            self._report("no-axis", message, 'write a direction: xyz="0 0 1"', axis, "xyz")
            return (1.0, 0.0, 0.0)
        x, y, z = _unit(vector)
        return (x, y, z)

    def _triple(self, element: Element, attribute: str, default: str) -> Vector:
        x, y, z = self._reading.numbers(element, attribute, default) or (0.0, 0.0, 1.0)
        return (x, y, z)

    def _check_limit(self, name: str, kind: JointKind, element: Element) -> None:
        limit = element.first("limit")
        if kind not in _LIMITED:
            return
        if limit is None:
            fix = "add <limit lower=… upper=… effort=… velocity=…/>"
            if kind is JointKind.REVOLUTE:
                fix += ', or make it type="continuous"'
            self._report("no-limit", f"the {kind} joint {quoted(name)} has no limits", fix, element, "type")
            return
        if self._version > 1 and (missing := {"lower", "upper"} - limit.attributes.keys()):
            message = f"the {kind} joint {quoted(name)} has no limit {' and '.join(sorted(missing))}"
            self._report("no-limit", message, "version 1.2 needs lower and upper", limit)
        lower, upper = self._reading.number(limit, "lower"), self._reading.number(limit, "upper")
        if lower > upper:
            message = f"the joint {quoted(name)} has the limits {lower:g} to {upper:g}"
            self._report("limits", message, "lower comes first: exchange them", limit, "lower")

    # Joints that mimic others.

    def _with_sources(self, joints: list[Joint]) -> list[Joint]:
        """Return the joints, each with the joint whose position decides its own, however many lie between."""
        by_name = {each.name: each for each in joints}
        stated = {name: mimic for name, each in self._joints.items() if (mimic := each.first("mimic")) is not None}
        return [self._with_source(each, by_name, stated) if each.name in stated else each for each in joints]

    def _with_source(self, joint: Joint, joints: Mapping[str, Joint], stated: Mapping[str, Element]) -> Joint:
        path, multiplier, offset = [joint.name], 1.0, 0.0
        while (mimic := stated.get(path[-1])) is not None:
            offset += multiplier * self._reading.number(mimic, "offset")
            multiplier *= self._reading.number(mimic, "multiplier", 1.0)
            source = mimic.attributes.get("joint", "")
            if source in path:
                if source == joint.name == next(name for name in self._joints if name in path):  # once for each loop
                    names = " → ".join(map(printable, [*path, source]))
                    self._report("mimic-loop", f"joints mimic each other: {names}", "leave one out", mimic, "joint")
                return joint
            if source not in joints or joints[source].kind not in MOVES:
                if len(path) == 1:  # else it is that joint's problem
                    self._report_source(source, joints, mimic)
                return joint
            if len(path) == MOST_MIMICS:
                message = f"the joint {quoted(joint.name)} mimics others over more than {MOST_MIMICS} joints"
                self._report("mimic-loop", message, "name the joint that moves", stated[joint.name], "joint")
                return joint
            path.append(source)
        return replace(joint, source=path[-1], multiplier=multiplier, offset=offset)

    def _report_source(self, source: str, joints: Mapping[str, Joint], mimic: Element) -> None:
        moving = [name for name, each in joints.items() if each.kind in MOVES]
        fix = did_you_mean(source, moving, none="leave it out")
        if source in joints:
            message = f"the {joints[source].kind} joint {quoted(source)} has no position to mimic"
            self._report("unknown-joint", message, fix, mimic, "joint")
        elif source not in self._joints:  # else it has a problem of its own
            self._report("unknown-joint", f"there is no joint {quoted(source)} to mimic", fix, mimic, "joint")

    # The tree.

    def _check_tree(self) -> None:
        """Report loops, and links beside the first that hang on nothing."""
        seen: set[str] = set()
        for link in self._links:
            path, above = list[str](), link
            while above in self._joint_of and above not in seen:
                seen.add(above)
                path.append(above)
                above = self._joint_of[above].parent
            if above in path:
                self._report_loop(path[path.index(above) :])
        first, *others = [link for link in self._links if link not in self._joint_of] or [""]
        for link in others:
            message = f"the links {quoted(first)} and {quoted(link)} both hang on nothing: a robot has one root"
            fix = f"add a joint of which {quoted(link)} is the child, or leave it out"
            self._report("two-roots", message, fix, self._links[link], "name")

    def _report_loop(self, loop: list[str]) -> None:
        names = " → ".join(map(printable, [*reversed(loop), loop[-1]]))
        joint = self._joints[self._joint_of[loop[0]].name]
        fix = "leave one of these joints out: a link has one way up"
        self._report("loop", f"links hang on each other: {names}", fix, joint, "name")

    # Files.

    def _check_files(self, root: Element) -> None:
        """Warn of meshes and textures of links and materials that are not there."""
        for part in (*root.all("link"), *root.all("material")):
            for each in part.within():
                if each.tag in {"mesh", "texture"}:
                    self._check_file(each)

    def _check_file(self, element: Element) -> None:
        address = element.attributes.get("filename", "")
        message, fix = "", None
        if address.startswith(SCHEME):
            try:
                package_file(address, self._packages)
            except NoSuchTarget as error:
                name = printable(address.removeprefix(SCHEME).partition("/")[0], limit=100)
                message = str(error)
                fix = None if name in self._packages else f"name its folder there: packages: {{{name}: ../{name}}}"
        elif address.startswith("file:///"):
            if not Path(address.removeprefix("file://")).is_file():
                message = f"there is no file {quoted(address)}"
        elif not address.startswith(_REMOTE):
            message = f"no viewer finds {quoted(address)}: it does not say in which package"
            fix = "write package://my_robot/PATH, and in the launch file packages: {my_robot: FOLDER}"
        if message:
            self._reading.doubt("missing-file", message, fix, element, "filename")


def _unit(numbers: Sequence[float]) -> Sequence[float]:
    """Return numbers that are not all zero at a length of 1, however large or small they are."""
    largest = max(map(abs, numbers))
    length = hypot(*(each / largest for each in numbers))
    return [each / largest / length for each in numbers]
