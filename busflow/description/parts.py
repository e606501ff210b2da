"""Parts of a URDF file, versions 1.0 to 1.2: what stands where, and what an unknown one means.

An unknown part is a mistake where a reader of the file might have moved or shaped something by it. Elsewhere it is a
warning; what a namespace names (`drake:joint`), and what simulators and drivers put into many files, is left alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from busflow.description.reading import Reading
from busflow.description.xml_file import Element
from busflow.text import did_you_mean, nearest, printable, quoted

VERSIONS = {"1.0": 0, "1.1": 1, "1.2": 2}
"""The versions that are known, with what follows the dot."""


class _Part(NamedTuple):
    """The attributes and elements of a part, as words; `exact` where an unknown one changes what is where."""

    attributes: str = ""
    elements: str = ""
    exact: bool = True
    others: str = ""
    """Elements that files have there for simulators and drivers."""


_DRAWN = _Part("name", "origin geometry material", exact=False, others="verbose")
_PARTS: Mapping[str, _Part] = {
    "robot": _Part("name version", "link joint material", exact=False, others="loop_joint RefLink"),
    "link": _Part(
        "name type",
        "inertial visual collision",
        exact=False,
        others="contact gravity kinematic surface collision_checking self_collision_checking self_filter sensor gazebo",
    ),
    "joint": _Part(
        "name type",
        "origin parent child axis calibration dynamics limit safety_controller mimic",
        others="controller_gains joint_properties traits anchor hardwareInterface gazebo sensor",
    ),
    "origin": _Part("xyz rpy quat_xyzw"),
    "axis": _Part("xyz"),
    "parent": _Part("link"),
    "child": _Part("link"),
    "mimic": _Part("joint multiplier offset"),
    "limit": _Part("lower upper effort velocity acceleration deceleration jerk", exact=False),
    "visual": _DRAWN,
    "collision": _DRAWN,
    "inertial": _Part(elements="origin mass inertia", exact=False),
    "geometry": _Part("name", "box capsule cylinder mesh sphere", others="material"),
    "box": _Part("size"),
    "capsule": _Part("radius length"),
    "cylinder": _Part("radius length"),
    "mesh": _Part("filename scale"),
    "sphere": _Part("radius"),
}
_SHAPES: Mapping[str, Mapping[str, str]] = {
    "box": {"size": "1 1 1"},
    "capsule": {"radius": "1", "length": "1"},
    "cylinder": {"radius": "1", "length": "1"},
    "sphere": {"radius": "1"},
    "mesh": {},
}
"""The shapes, each with the numbers that it states."""
_ONCE = frozenset(["origin", "parent", "child", "axis", "limit", "mimic", "geometry"])
_MOTION = ("acceleration", "deceleration", "jerk")
"""The limits that version 1.2 adds."""


def version_of(root: Element, reading: Reading) -> int:
    """Return what follows the dot of the file's version; report a version that is not known."""
    stated = root.attributes.get("version", "1.0")
    if stated not in VERSIONS:
        message, fix = f"there is no version {quoted(stated)} of URDF", f"known: {', '.join(VERSIONS)}"
        reading.report("urdf-version", message, fix, root, "version")
    return VERSIONS.get(stated, max(VERSIONS.values()))


def check_parts(root: Element, version: int, reading: Reading) -> None:
    """Report unknown parts, parts that stand twice, wrong shapes, and those that need a later version."""
    for part in _known(root):
        known = _PARTS[part.tag]
        _check_attributes(part, known, reading)
        _check_elements(part, known, reading)
        if part.tag == "geometry":
            _check_shape(part, version, reading)
        elif part.tag == "limit":
            _check_motion(part, version, reading)
        elif part.tag == "origin":
            _check_rotation(part, version, reading)


def _known(part: Element) -> Iterable[Element]:
    """Yield a part and the known ones in it; what is in others is theirs."""
    yield part
    for each in part.children:
        if each.tag in _PARTS[part.tag].elements.split() and each.tag in _PARTS:
            yield from _known(each)


def _check_attributes(part: Element, known: _Part, reading: Reading) -> None:
    words = known.attributes.split()
    for name, value in part.attributes.items():
        if name in words or ":" in name or name == "xmlns":
            continue
        message = f"{part.tag} has no attribute {quoted(name)}"
        if known.exact and not known.elements and not _is_zero(value):
            reading.report("unknown-part", message, did_you_mean(name, words, none="leave it out"), part, name)
        elif known.exact or part.tag == "limit":
            reading.doubt("unknown-part", message, "leave it out", part, name)


def _check_elements(part: Element, known: _Part, reading: Reading) -> None:
    words, first = known.elements.split(), dict[str, Element]()
    for each in part.children:
        if each.tag in words:
            if each.tag in _ONCE and first.setdefault(each.tag, each).attributes != each.attributes:
                line = reading.file.place(first[each.tag]).line
                message = f"{part.tag} has two {each.tag}s; the first is in line {line}"
                reading.report("duplicate-part", message, "leave one out", each)
        elif ":" not in each.tag and each.tag not in known.others.split():
            message = f"{part.tag} has no element {printable(each.tag, limit=100)}"
            is_wrong = known.exact or nearest(each.tag, words) is not None or each.tag in _PARTS
            if is_wrong and not (part.tag == "robot" and each.tag in _PARTS) and not _states_zero(each):
                reading.report("unknown-part", message, did_you_mean(each.tag, words, none="leave it out"), each)
            elif part.tag != "robot":
                reading.doubt("unknown-part", message, None, each)


def _check_shape(geometry: Element, version: int, reading: Reading) -> None:
    shapes = [each for each in geometry.children if each.tag in _SHAPES]
    if len(shapes) != 1 and all(each.tag in _SHAPES for each in geometry.children):  # else that is the mistake
        message = f"a geometry is one shape, and here are {len(shapes)}"
        reading.report("no-shape", message, f"known: {', '.join(_SHAPES)}", geometry)
    for shape in shapes:
        if shape.tag == "capsule" and not version:
            _report_version("a capsule", "1.1", shape, None, reading)
        for name, form in _SHAPES[shape.tag].items():
            if name not in shape.attributes:
                reading.report("bad-number", f"this {shape.tag} has no {name}", f'write {name}="{form}"', shape)
            elif (
                min(reading.numbers(shape, name, form) or (1,)) <= 0 and version > 1
            ):  # older files have 0, e.g. planes
                reading.report("bad-number", f"{name} is not above 0", f'write {name}="{form}"', shape, name)
        reading.numbers(shape, "scale", "1 1 1")


def _check_motion(limit: Element, version: int, reading: Reading) -> None:
    """Check the limits of motion: before 1.2 the later ones are left alone, as by others."""
    for name in _MOTION if version < 2 else (*_MOTION, "effort", "velocity"):
        if name not in limit.attributes:
            continue
        if version < 2:
            reading.doubt("urdf-version", f"{name} needs version 1.2", 'write <robot version="1.2" …>', limit, name)
        elif reading.number(limit, name) < 0:
            reading.report("limits", f"{name} is below 0", "a limit of motion is 0 or above", limit, name)


def _check_rotation(origin: Element, version: int, reading: Reading) -> None:
    if "quat_xyzw" in origin.attributes and not version:
        _report_version("quat_xyzw", "1.1", origin, "quat_xyzw", reading)
    elif "quat_xyzw" in origin.attributes and "rpy" in origin.attributes:
        message = "this origin has two rotations, rpy and quat_xyzw"
        reading.report("two-rotations", message, "leave one out", origin, "quat_xyzw")


def _report_version(what: str, version: str, part: Element, attribute: str | None, reading: Reading) -> None:
    message = f"{what} needs version {version} of URDF, which this file does not state"
    reading.report("urdf-version", message, f'write <robot version="{version}" …>', part, attribute)


def _is_zero(text: str) -> bool:
    """Return whether a text is zeros alone, which move nothing."""
    return bool(text) and not text.strip("0. -")


def _states_zero(part: Element) -> bool:
    return bool(part.attributes) and all(map(_is_zero, part.attributes.values()))
