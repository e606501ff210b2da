"""The directory of a bag of ROS 2: which files it has, by its `metadata.yaml`, and none that lie elsewhere."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from busflow.errors import BagError, LaunchError
from busflow.recording.bag.facts import json_object
from busflow.recording.mcap.bounds import MOST_FILES

METADATA = "metadata.yaml"
STORAGES = {"mcap": ".mcap", "sqlite3": ".db3"}
"""The storage plugins of rosbag2, each with the suffix of its files."""

REPORT, LACKING = "busflow.report", "busflow.lacking"
"""The key of busflow's own JSON in the metadata's `custom_data`: the run's account, and what no file has."""

INFORMATION = "rosbag2_bagfile_information"
_LARGEST = 8 << 20
_DIGITS = re.compile(r"(\d+)")


@dataclass(frozen=True, slots=True)
class Directory:
    """A bag of several files."""

    files: tuple[Path, ...]
    storage: str
    compressed: bool = False
    """True if its files, or the messages in them, are compressed."""
    unfinished: BagError | None = None
    """The reason why the directory is known to be unfinished."""
    report: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """The account of a run whose processes have recorded themselves."""


def directory(path: Path) -> Directory:
    """Return the contents of a directory.

    Raises:
        BagError: It is no bag, or one that busflow does not read, or names files that lie elsewhere.
    """
    try:
        raw = _read(path / METADATA)
        if raw is None:
            return _without_metadata(path)
        information = _information(raw, path)
        storage = _storage(information, path)
        files = tuple(_confined(path, each) for each in _names(information, path))
        compressed = str(information.get("compression_mode") or "none").lower() != "none"
        return Directory(files, storage, compressed, *_of_busflow(information, path))
    except OSError as error:
        raise BagError(f"it cannot be read: {error.strerror}", file=str(path)) from None


def _read(metadata: Path) -> bytes | None:
    if not metadata.is_file():
        return None
    with metadata.open("rb") as stream:
        raw = stream.read(_LARGEST + 1)
    if len(raw) > _LARGEST:
        raise BagError(f"it is larger than {_LARGEST >> 10} KiB", file=str(metadata))
    return raw


def _information(raw: bytes, path: Path) -> Mapping[str, Any]:
    from busflow.launchfile.yaml.document import parse

    name = str(path / METADATA)
    try:
        data = parse(raw, name).data
    except LaunchError as error:
        problem = error.problems[0]
        place = problem.place
        where = f" in line {place.line}" if place else ""
        raise BagError(f"it cannot be read{where}: {problem.message}", file=name) from None
    information = cast("dict[str, Any]", data).get(INFORMATION) if isinstance(data, dict) else None
    if not isinstance(information, dict):
        raise BagError(f"it has no {INFORMATION}, so it is of no bag", file=name)
    return cast("dict[str, Any]", information)


def _of_busflow(information: Mapping[str, Any], path: Path) -> tuple[BagError | None, Mapping[str, Any]]:
    """Return the notes of a run of several processes: its account, and facts that no file can state of itself."""
    stated = information.get("custom_data")
    custom = cast("dict[str, object]", stated) if isinstance(stated, dict) else {}
    lacking = custom.get(LACKING)
    report = json_object(str(custom.get(REPORT, "{}")))
    return BagError(str(lacking), file=str(path)) if lacking else None, report


def _storage(information: Mapping[str, Any], path: Path) -> str:
    storage = information.get("storage_identifier")
    if storage not in STORAGES:
        reason = f"it is stored as {storage!r}; mcap and sqlite3 are read"
        raise BagError(reason, file=str(path / METADATA), fix="ros2 bag convert writes it as mcap")
    return str(storage)


def _names(information: Mapping[str, Any], path: Path) -> list[str]:
    names = information.get("relative_file_paths")
    if not isinstance(names, list) or not names:
        raise BagError("relative_file_paths names no files", file=str(path / METADATA))
    files = cast("list[object]", names)
    if len(files) > MOST_FILES:
        raise BagError(f"it has {len(files)} files, and {MOST_FILES} are read", file=str(path / METADATA))
    return [str(each) for each in files]


def _confined(path: Path, name: str) -> Path:
    """Return a file that the metadata names; it has to lie in the directory itself, wherever a link may lead."""
    inside = path.resolve()
    try:
        file = path / name
        first, _, rest = name.partition("/")
        if rest and first == path.name and not file.exists():  # as rosbag2 wrote it in its first years
            file = path / rest
        elsewhere = Path(name).is_absolute() or inside not in file.resolve().parents
    except (ValueError, RuntimeError):  # a NUL, or a circle of links
        file, elsewhere = path, True
    if elsewhere:
        raise BagError(f"it names {name!r}, which does not lie in the directory of the bag", file=str(path / METADATA))
    return file


def _without_metadata(path: Path) -> Directory:
    """Return the files of a directory without metadata, which a killed recorder of ROS 2 leaves behind."""
    for storage, suffix in STORAGES.items():
        found = [each for each in path.iterdir() if each.suffix == suffix]
        if found:
            reason = f"it has no {METADATA}: its recorder was killed, or still records"
            files = sorted(found, key=_numbered)[:MOST_FILES]
            return Directory(
                tuple(_confined(path, each.name) for each in files),
                storage,
                unfinished=BagError(reason, file=str(path)),
            )
    raise BagError(f"the directory has no {METADATA} and no recording", file=str(path))


def _numbered(path: Path) -> list[str | int]:
    """Return a sort key that puts run_2.mcap before run_10.mcap."""
    return [int(part) if part.isdecimal() else part for part in _DIGITS.split(path.name)]
