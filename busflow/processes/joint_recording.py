"""JointRecording: the directory in which each process of a run writes its recording, and the outcome of all files."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from busflow.bus.endpoint import PARAMETER_EVENTS, ROSOUT
from busflow.bus.patterns import Selection
from busflow.errors import BagError
from busflow.processes.shares import Shares, unlike
from busflow.recording.bag.bag import Bag
from busflow.recording.bag.rosbag2 import LACKING, REPORT
from busflow.recording.bag.rosbag2_metadata import FileCounts, file_counts, write_metadata
from busflow.recording.recorder.destination import as_directory, named, refusal
from busflow.runner.extension import Extension
from busflow.runner.report import RecordingReport, Report
from busflow.runner.service_events import SUFFIX
from busflow.text import did_you_mean, printable

if TYPE_CHECKING:
    from busflow.launchfile.model.description import OnDrop, RecordSpec
    from busflow.log import Logger
    from busflow.recording.recorder.share import Share

_SUFFIX = ".mcap"
_LARGEST_REPORT = 512 << 10
"""Limit of a report in the metadata, in characters: readers accept no more than a MiB of metadata."""


class JointRecording(Extension):
    """A recording of several files: one for each process, and one more for each restart of a process."""

    def __init__(self, spec: RecordSpec, shares: Shares, log: Logger, *, run: str) -> None:
        """Prepare the recording; `begin` makes its directory.

        Args:
            spec: the topics and the path of the recording.
            shares: the parts of the run that its processes record.
            log: receives warnings about patterns that match nothing.
            run: the run's name.

        Raises:
            RecordingRefused: the path has an unknown placeholder.
        """
        self.path: Path = as_directory(named(spec.to, run=run))
        """The directory, as the user wrote it."""
        self.directory: Path = self.path.absolute()
        self._spec, self._shares, self._log = spec, shares, log
        self._files: dict[str, list[Path]] = {process: [] for process in shares.processes}
        self._begun = False
        self.outcome: RecordingReport | None = None
        """The outcome of the recording; None until it is known."""

    def begin(self) -> None:
        """Make the directory.

        Raises:
            RecordingRefused: the directory exists already, or cannot be made.
        """
        try:
            self.directory.mkdir()
        except OSError as error:
            raise refusal(self.path, error) from None
        self._begun = True

    def end(self) -> None:
        """Remove the directory again if it is empty."""
        if self._begun:
            with suppress(OSError):  # it is not empty
                self.directory.rmdir()
                self._begun = False

    def share(self, process: str) -> Share:
        """Return what a process records from its coming start on, with a new file for each start."""
        files = self._files[process]
        stems = self._shares.stems
        name = stems[process]
        if files:
            name = unlike(f"{name}-{len(files) + 1}", {*stems.values(), *(path.stem for path in self._paths())})
        files.append(self.directory / f"{name}{_SUFFIX}")
        return self._shares.of(process, files[-1])

    @property
    def on_drop(self) -> OnDrop:
        """What the run does if a message is missing."""
        return self._spec.on_drop

    def so_far(self, recordings: Sequence[Mapping[str, Any]]) -> RecordingReport:
        """Return the recording's state, from the reports of all processes, those from before a restart included."""
        if self.outcome is not None:
            return self.outcome
        recorded, missed = (sum(int(each[count]) for each in recordings) for count in ("recorded", "missed"))
        return RecordingReport(str(self.path), recorded, missed, complete=False)

    def finish(self, report: Report, recordings: Sequence[Mapping[str, Any]] = ()) -> None:
        """Examine the files of all processes, and write the metadata.

        Args:
            report: the report of the whole run.
            recordings: the recording reports of all processes, those from before a restart included. They show a file
                that looks complete although some of it did not reach the disk in time, and how many messages a file
                without an end lacks.
        """
        if not self._begun or self.outcome is not None:
            return
        self._log_unmatched(report)
        recorded, missed = 0, sum(int(each["missed"]) for each in recordings)
        lacking: list[str] = []
        why: list[str] = []
        said = {Path(each["path"]).name: str(each["why"]) for each in recordings if each["why"]}
        try:
            with Bag(self.directory) as bag:
                begun = [path.with_stem(f"{path.stem}_0") if self._spec.split else path for path in self._paths()]
                by_name = {each.files[0].path.name: each for each in bag.series}
                lacking += [f"there is nothing in {path.name}" for path in begun if path.name not in by_name]
                counted = file_counts([by_name[path.name] for path in begun if path.name in by_name])
                for each in bag.series:
                    names = [file.path.name for file in each.files]
                    reasons = [said[name] for name in names if name in said] or each.incomplete()
                    why += [f"{names[0]}: {reason}" for reason in reasons]
                recorded, missed = bag.messages, max(missed, bag.ledger.missed if bag.ledger else 0)
            self._write(counted, report, "; ".join(lacking))
        except (BagError, OSError) as error:
            why.append(str(error))
        why = lacking + why
        self.outcome = RecordingReport(str(self.path), recorded, missed, complete=not why, why="; ".join(why))

    def _paths(self) -> list[Path]:
        return [path for files in self._files.values() for path in files]

    def _write(self, counted: Sequence[FileCounts], report: Report, lacking: str) -> None:
        account = json.dumps(report.as_json())
        custom = {REPORT: account} if len(account) <= _LARGEST_REPORT else {}
        custom |= {LACKING: lacking} if lacking else {}
        write_metadata(self.directory, counted, qos=lambda channel: channel.qos or "", custom=custom)

    def _log_unmatched(self, report: Report) -> None:
        """Log the patterns that match no topic of any process."""
        selection = Selection(self._spec.topics, self._spec.exclude)
        names = [topic.name for topic in report.topics] + [service.name for service in report.services]
        for name in (*names, ROSOUT, PARAMETER_EVENTS):
            selection.includes(name)
        for service in report.services:
            selection.includes(service.name, service.name + SUFFIX)
        for pattern in selection.unmatched:
            guess = did_you_mean(pattern, names, none="the run had no topics")
            self._log.warning(f"there was no topic {printable(pattern)}, so nothing of it was recorded; {guess}")
