"""Record: what was found, as data, with the machine that it was found on."""

from __future__ import annotations

import os
import platform
import shlex
import sysconfig
from collections.abc import Sequence
from importlib import metadata
from typing import Any

from benchmarks.rounds import Figure, Outcome

PACKAGES = ("busflow", "numpy", "pydantic", "eclipse-zenoh")
PEERS = (
    "aiopubsub", "anyio", "blinker", "bubus", "cyclonedds", "ezmsg", "faststream", "msgspec", "pyee", "pyzmq",
    "reactivex", "rosbags", "uvloop",
)  # fmt: skip


def version(package: str) -> str:
    """The version that is installed; empty where none is."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""


def machine() -> str:
    """The machine and its load, in one line."""
    load = ", ".join(f"{each:.1f}" for each in os.getloadavg())
    versions = ", ".join(f"{package} {version(package)}" for package in PACKAGES)
    return f"CPython {platform.python_version()}, {processor()}, {os.cpu_count()} cores, load {load}; {versions}"


def build() -> str:
    """The build of Python, with the options it was configured with, and the machine, in one line."""
    words = shlex.split(str(sysconfig.get_config_var("CONFIG_ARGS") or ""))
    options = " ".join(word for word in words if word.startswith(("--enable", "--disable", "--with")))
    python = f"{platform.python_implementation()} {platform.python_version()}, {platform.python_compiler()}"
    return f"{python}, configured with {options or 'no options'}; {processor()}, {os.cpu_count()} cores"


def processor() -> str:
    """The processor's name, as Linux tells it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:  # noqa: PTH123  # a Path would read no better
            return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


def as_json(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Everything that was found."""
    return {
        "python": platform.python_version(),
        "processor": processor(),
        "cores": os.cpu_count(),
        "versions": {package: version(package) for package in (*PACKAGES, *PEERS)},
        "questions": {outcome.question.name: _question(outcome) for outcome in outcomes},
    }


def _question(outcome: Outcome) -> dict[str, Any]:
    return {
        "title": outcome.question.title,
        "load": list(outcome.load),
        "call_s": outcome.call_s,
        "missing": outcome.missing,
        "failed": outcome.failed,
        "figures": [_figure(figure) for figure in outcome.figures.values()],
    }


def _figure(figure: Figure) -> dict[str, Any]:
    return {
        "contender": figure.contender,
        "case": figure.case,
        "figure": figure.name,
        "unit": figure.unit,
        "median": figure.median,
        "spread": figure.spread,
        "calls": figure.ratio,
        "values": figure.values,
    }
