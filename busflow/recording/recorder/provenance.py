"""Provenance: the contents of a recording beside messages: set-up of the run, launch file, account."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import busflow
from busflow.launchfile.yaml.block import text_of
from busflow.launchfile.yaml.value import Value
from busflow.recording.bag.facts import FACTS, LACKING, LATER_PUBLISHERS, LAUNCH_FILE, LEDGER, NONE_LATER
from busflow.runner.planning.resolved import resolve

if TYPE_CHECKING:
    from busflow.launchfile.model.description import LaunchDescription

FORMAT = "1"
"""Grows when a recording changes in a way that earlier readers do not expect."""

_PACKAGES = ("lz4", "mcap", "numpy", "pydantic", "zstandard")
"""The libraries on which the bytes of a recording depend, beside busflow and Python."""

MetadataRecord = tuple[str, Mapping[str, str]]
"""A metadata record of a file: its name, and its texts by key."""


def library() -> str:
    """Return the name of the writing program in a file."""
    return f"busflow {busflow.__version__}; mcap {version('mcap')}"


def facts(run: str, seed: int | None, clock: str, started_ns: int, process: str = "") -> MetadataRecord:
    """Return the set-up of a run, without facts about the machine or its folders.

    Of several processes that record themselves, each says which of them it is.
    """
    return FACTS, {
        "format": FORMAT,
        "run": run,
        **({} if seed is None else {"seed": str(seed)}),
        **({"process": process} if process else {}),
        "clock": clock,
        "started": str(started_ns),
        "busflow": busflow.__version__,
        "python": f"{sys.version_info.major}.{sys.version_info.minor}",
        "versions": json.dumps({name: version(name) for name in _PACKAGES}),
    }


def ledger(
    report: Mapping[str, Any],
    recorded: int,
    missed: int,
    later: Mapping[str, Sequence[str]] = NONE_LATER,
    *,
    lacking: str = "",
) -> MetadataRecord:
    """Return the account of a recording.

    Args:
        report: the run's report at its end.
        recorded: the number of recorded messages.
        missed: the number of messages that could not be written.
        later: the publishers that the channels do not name.
        lacking: the losses before the recorder, in words; empty if it knows of none.
    """
    return LEDGER, {
        "report": json.dumps(report),
        "recorded": str(recorded),
        "missed": str(missed),
        "complete": "false" if missed or lacking else "true",
        **({LACKING: lacking} if lacking else {}),
        **({LATER_PUBLISHERS: json.dumps(later)} if later else {}),
    }


def launch_files(descriptions: Sequence[LaunchDescription]) -> Iterator[tuple[str, str]]:
    """Yield each launch file of a run as it was resolved, its folders named as seen from its own."""
    for number, description in enumerate(descriptions, 1):
        name, _, suffix = LAUNCH_FILE.rpartition(".")
        yield LAUNCH_FILE if number == 1 else f"{name}-{number}.{suffix}", text_of(_movable(description))


def _movable(description: LaunchDescription) -> Value:
    resolved = resolve(description)
    folders = resolved.members.get("plugins")
    if folders is None or not description.files:
        return resolved
    here = description.files[0].resolve().parent
    stated = folders.content if isinstance(folders.content, list) else []
    paths = [replace(each, content=Path(os.path.relpath(str(each.content), here)).as_posix()) for each in stated]
    return resolved.with_member(("plugins",), replace(folders, content=paths))
