"""`busflow bag info`: shows what a recording holds, how it was made, and whether it is complete."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.bag import reads
from busflow.cli.terminal.output import print_answer, print_message
from busflow.cli.terminal.table import Column, bare, print_table
from busflow.text import counted, printable

if TYPE_CHECKING:
    from pathlib import Path

    from busflow.recording.bag.bag import Bag
    from busflow.recording.bag.channel import Channel
    from busflow.recording.bag.series import Series

_EXAMPLES = """\b
Examples:
  busflow bag info run.mcap
  busflow bag info run.mcap --digest
  busflow bag info run.mcap --json | jq .topics"""


@click.command(epilog=_EXAMPLES)
@reads()
@click.option("--digest", "with_digest", is_flag=True, help="Show the SHA-256 of all messages, their times and order.")
@click.option("--launch-file", is_flag=True, help="Print the launch file that was recorded with it, and nothing else.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def info(file: Path, with_digest: bool, launch_file: bool, as_json: bool) -> None:
    """Show what the recording FILE holds: an .mcap file, or the directory of a ROS 2 bag.

    The summary is read, which is fast for large files too; busflow bag verify reads all of it.
    """
    from busflow.errors import BagError
    from busflow.recording.bag.bag import Bag

    with Bag(file) as bag:
        if launch_file:
            if bag.facts is None or bag.facts.launch_file is None:
                raise BagError("there is no launch file in it", file=str(file))
            print_message(bag.facts.launch_file, error_stream=False)
            return
        contents = _contents(bag)
        if with_digest:
            contents["digest"] = bag.digest()
        if as_json:
            print_answer(contents)
        else:
            _show(bag, contents)


def _contents(bag: Bag) -> dict[str, Any]:
    """Return what a bag holds, as `--json` prints it."""
    spans: dict[tuple[str, ...], list[int]] = {}
    for each, span in bag.spans().items():
        spans.setdefault(_key(each), []).extend(span)
    topics = [_topic(each, bag, spans.get(_key(each))) for each in _by_name(bag.channels)]
    start, end = bag.start_ns, bag.end_ns
    facts, ledger = bag.facts, bag.ledger
    return {
        "path": str(bag.path),
        "files": [each.path.name for each in bag.files],
        "size": sum(each.size for each in bag.files),
        "complete": bag.complete,
        "incomplete_because": list(bag.incomplete),
        "start_ns": start,
        "end_ns": end,
        "duration_s": None if start is None or end is None else (end - start) / 1e9,
        "messages": bag.messages,
        "recorder": bag.files[0].recorder,
        "run": facts and facts.run,
        "seed": facts and facts.seed,
        "clock": facts and facts.clock,
        "versions": facts and dict(facts.versions),
        "launch_file": facts and facts.launch_file,
        "ledger": ledger
        and {
            "recorded": ledger.recorded,
            "missed": ledger.missed,
            "report": ledger.report,
            "complete": ledger.complete,
        },
        "part": next(map(str, bag.cuts), None),
        "snapshot": next((each.reason for each in bag.series if each.reason), None),
        "processes": [_process(each) for each in bag.series if each.facts is not None and each.facts.process],
        "topics": topics,
    }


def _process(series: Series) -> dict[str, Any]:
    """Return the entry of a file that one process recorded of itself; a restarted process has several files."""
    reasons = list(series.incomplete())
    return {
        "process": series.facts and series.facts.process,
        "file": _files(series),
        "messages": series.overview().messages,
        "complete": not reasons,
        "incomplete_because": reasons,
    }


def _files(series: Series) -> str:
    """Return the name of a file, or of the first and last part."""
    names = list(dict.fromkeys(series.files[place].path.name for place in (0, -1)))
    return " … ".join(names)


def _by_name(channels: Iterable[Channel]) -> Iterator[Channel]:
    """Yield the channels, merging those that differ only in the QoS that several processes' publishers offered."""
    found: dict[tuple[str, ...], Channel] = {}
    for each in channels:
        known = found.get(_key(each))
        if known is None:
            found[_key(each)] = each
        else:
            qos = "\n".join(dict.fromkeys(filter(None, [known.qos, each.qos])))
            found[_key(each)] = replace(known, count=(known.count or 0) + (each.count or 0), qos=qos)
    yield from found.values()


def _key(channel: Channel) -> tuple[str, ...]:
    return channel.topic, channel.type_name, channel.encoding, channel.type_hash or "", channel.definition


def _topic(channel: Channel, bag: Bag, times: Sequence[int] | None) -> dict[str, Any]:
    """Return the entry of a topic; its rate is from its first to its last message, or over the bag if not indexed."""
    count = channel.count or 0
    ends = times or [each for each in (bag.start_ns, bag.end_ns) if each is not None]
    span = (max(ends, default=0) - min(ends, default=0)) / 1e9
    return {
        "name": channel.topic,
        "type": channel.type_name,
        "encoding": channel.encoding,
        "type_hash": channel.type_hash,
        "messages": count,
        "rate_hz": (count - 1) / span if count > 1 and span > 0 else None,
        "qos": channel.qos,
    }


def _show(bag: Bag, contents: dict[str, Any]) -> None:
    click.echo(f"{printable(bag.path.name)}")
    rows = [row for row in _rows(bag, contents) if row[1] not in (None, "")]
    print_table(rows, Column(), Column(folds=True), indent="  ")
    if contents["topics"]:
        click.echo()
        rows = [(each["name"], each["type"], each["messages"], _rate(each["rate_hz"])) for each in contents["topics"]]
        print_table(rows, Column("topic"), Column("type", short=bare), Column("messages"), Column("rate"))


def _rows(bag: Bag, contents: dict[str, Any]) -> Iterator[tuple[str, object]]:
    reasons = contents["incomplete_because"]
    yield "state", "INCOMPLETE: " + "; ".join(reasons) if reasons else "complete"
    yield "part", printable(contents["part"] or "")
    if bag.facts is not None:
        yield "run", bag.facts.run
        yield "seed", bag.facts.seed
        yield "clock", f"{bag.facts.clock} time" if bag.facts.clock else None
        yield "heard", bag.facts.recorded_by
        yield "snapshot", printable(contents["snapshot"] or "")
        yield "launch file", "recorded with it; --launch-file prints it" if bag.facts.launch_file else None
        yield "versions", ", ".join(f"{name} {version}" for name, version in bag.facts.versions.items())
    else:
        yield "recorder", contents["recorder"]
    for each in contents["processes"]:
        state = "complete" if each["complete"] else "INCOMPLETE"
        yield "process", f"{each['process']}: {each['file']}, {counted(each['messages'], 'message')}, {state}"
    if not contents["processes"] and len(bag.files) > 1:
        yield "files", f"{len(bag.files)}: {_files(bag.series[0])}"
    yield "start", _date(contents["start_ns"])
    yield "duration", None if contents["duration_s"] is None else f"{contents['duration_s']:.3f} s"
    yield "messages", f"{contents['messages']}"
    yield "size", _size(contents["size"])
    yield "digest", contents.get("digest")


def _date(time_ns: int | None) -> str | None:
    """Return a time as a UTC date with microseconds, or as nanoseconds where there is no such date."""
    if time_ns is None:
        return None
    try:
        date = datetime.fromtimestamp(time_ns // 10**9, UTC)
    except (OverflowError, ValueError, OSError):  # beyond the year 9999
        return f"{time_ns} ns"
    return f"{date:%Y-%m-%d %H:%M:%S}.{time_ns % 10**9 // 1000:06} UTC"


def _rate(rate_hz: float | None) -> str:
    return "" if rate_hz is None else f"{rate_hz:.1f} Hz"


def _size(size: float) -> str:
    for unit in ("bytes", "kB", "MB"):
        if size < 1000:
            return f"{size:.{0 if unit == 'bytes' else 1}f} {unit}"
        size /= 1000
    return f"{size:.1f} GB"
