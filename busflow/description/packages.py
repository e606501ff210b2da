"""Files in packages: `package://my_robot/meshes/arm.stl` lies below the folder that a launch file names `my_robot`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from urllib.parse import unquote

from busflow.errors import NoSuchTarget
from busflow.text import did_you_mean, quoted

SCHEME = "package://"


def package_file(address: str, packages: Mapping[str, Path]) -> Path:
    """Return the file that an address means, with all symbolic links followed; it lies below the package's folder.

    Args:
        address: `package://NAME/PATH`.
        packages: The folders by name.

    Raises:
        NoSuchTarget: It is no such address, there is no such package or file, or the file is outside of the folder.
    """
    if not address.startswith(SCHEME):
        raise NoSuchTarget(f"{quoted(address)} is not a file of a package; write package://my_robot/meshes/arm.stl")
    name, _, path = unquote(address.removeprefix(SCHEME)).partition("/")
    if name not in packages:
        named = did_you_mean(name, packages, none="it names none")
        raise NoSuchTarget(f"the launch file names no package {quoted(name)} under packages:; {named}")
    folder = packages[name].resolve()
    try:
        file = (folder / path).resolve()
    except (OSError, RuntimeError, ValueError):  # links in a circle, or a null byte
        file = None
    if file is not None and not file.is_relative_to(folder):
        raise NoSuchTarget(f"{quoted(path)} leads out of the package {name}")
    if file is None or not file.is_file():
        raise NoSuchTarget(f"there is no file {quoted(path)} in the package {name}")
    return file
