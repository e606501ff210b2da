"""Definition files of message classes, and what a workspace of ROS 2 needs to build them.

Comments are the docstrings of the source. The classes are imported by the caller; here they are only read.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from busflow.definitions.definition import Kind, kind_of
from busflow.errors import InvalidDeclaration
from busflow.interfaces.encoding.description import written
from busflow.interfaces.encoding.msg_text import type_text

if TYPE_CHECKING:
    from busflow.interfaces.message import Message

_XML = """\
<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>0.1.0</version>
  <description>Messages, services and actions of {name}, written by busflow interface export.</description>
  <maintainer email="maintainer@example.com">maintainer</maintainer>
  <license>{licence}</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
{depends}  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""
_CMAKE = """\
cmake_minimum_required(VERSION 3.8)
project({name})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{finds}rosidl_generate_interfaces(${{PROJECT_NAME}}
{files}{dependencies})
ament_export_dependencies(rosidl_default_runtime)
ament_package()
"""


def exported(package: str, classes: Sequence[type[Any]], licence: str) -> dict[str, str]:
    """Return the files of a package of ROS 2, by their path in it.

    Args:
        package: Its name.
        classes: Its messages, services and actions.
        licence: What its `package.xml` states.

    Raises:
        InvalidDeclaration: ROS 2 has no word for a field of one of them.
    """
    texts, needed = dict[str, str](), set[str]()
    for cls in sorted(classes, key=lambda each: each.__ros_name__):
        kind = kind_of(cls.__ros_name__) or Kind.MESSAGE
        texts[f"{kind}/{cls.__name__}.{kind}"] = _text(cls, kind, package, needed)
        needed |= {"action_msgs"} if kind is Kind.ACTION else set()
    others = sorted(needed - {package})
    depends = "".join(f"  <depend>{each}</depend>\n" for each in others)
    finds = "".join(f"find_package({each} REQUIRED)\n" for each in others)
    files = "\n".join(f'  "{each}"' for each in texts)
    dependencies = f"\n  DEPENDENCIES {' '.join(others)}" if others else ""
    return {
        "package.xml": _XML.format(name=package, licence=licence, depends=depends),
        "CMakeLists.txt": _CMAKE.format(name=package, finds=finds, files=files, dependencies=dependencies),
        **texts,
    }


def _text(cls: type[Any], kind: Kind, package: str, needed: set[str]) -> str:
    comments = _comments(cls)
    if kind is Kind.MESSAGE:
        return "\n".join(_lines(cls, comments, "", package, needed)) + "\n"
    parts = [suffix.removeprefix("_") for suffix in kind.parts]
    above = comments.get("", "")
    texts = ["\n".join(_lines(getattr(cls, part), comments, f"{part}.", package, needed)) for part in parts]
    head = [*_comment(above), ""] if above else []
    return "\n".join([*head, "\n---\n".join(texts).strip("\n")]) + "\n"


def _lines(
    cls: type[Message], comments: Mapping[str, str], inside: str, package: str, needed: set[str]
) -> Iterator[str]:
    from busflow.interfaces.encoding.typesupport import described_fields
    from busflow.interfaces.message import constants_of

    if about := comments.get(inside, ""):
        yield from (*_comment(about), "")
    constants, fields = constants_of(cls), described_fields(cls)
    for each in constants:
        yield from _comment(comments.get(f"{inside}{each.name}", ""))
        yield f"{each.base} {each.name}={_checked(written(each.value), cls)}"
    if constants and fields:
        yield ""
    for field in fields:
        needed |= {field.base.partition("/")[0]} if field.nested else set()
        yield from _comment(comments.get(f"{inside}{field.name}", ""))
        yield f"{type_text(field, package)} {field.name} {_checked(field.default, cls)}".rstrip()


def _comment(text: str) -> list[str]:
    return [f"# {line}".rstrip() for line in text.split("\n")] if text else []


def _checked(text: str, cls: type[Message]) -> str:
    if any(each in text for each in "\n\r\0"):
        raise InvalidDeclaration(f"{cls.__name__}: a definition file has no text of several lines: {text!r:.80}")
    return text


def _comments(cls: type[Any]) -> dict[str, str]:
    """Return docstrings by what they are about: `""` the class, `x` a field, `Goal.` a part, `Goal.x` its field."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(cls)))
    except (OSError, SyntaxError):  # a class without a file: there are no comments
        return {}
    found: dict[str, str] = {}
    for statement in tree.body:
        if isinstance(statement, ast.ClassDef):
            _collect(statement, "", found)
    standard = {f"The {kind.noun} `{cls.__ros_name__}`." for kind in Kind}
    parts = {f"The {part.removeprefix('_').lower()}." for kind in Kind for part in kind.parts}
    return {about: text for about, text in found.items() if text not in (parts if about.endswith(".") else standard)}


def _collect(declared: ast.ClassDef, inside: str, found: dict[str, str]) -> None:
    if text := ast.get_docstring(declared):
        found[inside] = text
    for statement, after in pairwise(declared.body):
        if isinstance(statement, ast.AnnAssign) and isinstance(after, ast.Expr):
            value = after.value
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                found[f"{inside}{ast.unparse(statement.target)}"] = inspect.cleandoc(value.value)
    for part in declared.body:
        if isinstance(part, ast.ClassDef):
            _collect(part, f"{part.name}.", found)
