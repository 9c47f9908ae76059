"""The folder that a study's results are in."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from rich.console import Console
from ruamel.yaml import YAML

from gameinfer_ros.experiments import machine
from gameinfer_ros.experiments.study.journal import Journal
from gameinfer_ros.experiments.study.study import Rows, Study
from gameinfer_ros.experiments.study.study_progress import StudyProgress
from gameinfer_ros.experiments.study.workers import Workers
from gameinfer_ros.lanes.compile_cache import fingerprint
from gameinfer_ros.scenario import Scenario

#: Files of a study: what it is and how it came about; what was played; results; times.
STUDY, SCENARIO, RUNS, TIMES = "study.json", "scenario.yaml", "runs.csv", "times.csv"


class FolderError(ValueError):
    """A folder cannot be used for a study; the message says why."""


class StudyFolder:
    """Keeps what comes of a study, run by run, so that it can be gone on with.

    Args:
        path: the folder; it is made if there is none.
        study: the study. If the folder holds one already, it must be the same one.

    Attributes:
        calls: the commands that added runs: what, when, by which sources, and on what machine.

    Raises:
        FolderError: the folder holds another study.
        OSError: it cannot be used.
    """

    def __init__(self, path: Path, study: Study) -> None:
        self._path, self._study = path, study
        self._content = {
            "study": study.name,
            "made_by": study.made_by,
            "scenario": study.scenario.model_dump(mode="json", exclude=study.irrelevant),
        }
        self.calls: list[dict[str, Any]] = []
        self._described = False
        path.mkdir(parents=True, exist_ok=True)
        self._read_description()

    def complete(
        self, seeds: Iterable[int], workers: Workers, console: Console, command: str
    ) -> Rows:
        """Make those of the runs with these numbers that have not been made yet.

        Args:
            seeds: numbers of the runs.
            workers: who makes them.
            console: where to tell about progress.
            command: what made the user's wish known; it is kept with the results.

        Returns:
            What came of all of them.

        Raises:
            FolderError: another process is making runs in this folder, or has put another study
                into it since.
            JournalError: a file of the folder is broken.
            FailedRunError: a run failed.
            WorkersError: there is nobody to make runs.
        """
        study, keys = self._study, self._study.keys(seeds)
        timed = bool(study.time_columns)
        with self._locked():
            # What is there is read only now: until now, others may have added to it.
            self._read_description()
            runs = Journal(self._path / RUNS, study.key_columns, study.columns)
            times = Journal(self._path / TIMES, study.key_columns, study.time_columns)
            missing = [k for k in keys if k not in runs or (timed and k not in times)]
            name = f"{study.name} in {self._path}"
            with StudyProgress(console, name, len(keys), len(keys) - len(missing)) as progress:
                for key, row in workers.results(study.play, missing) if missing else ():
                    self._describe_once(command, workers, console)
                    if timed:  # first, so that a run that counts has its times
                        times.append(key, row)
                    runs.append(key, row)
                    progress.advance()
            runs.sort()
            if timed:
                times.sort()
        if len(runs.rows) > len(keys):
            console.print(
                f"{name}: holds more runs ({len(runs.rows)}) than were asked for "
                f"({len(keys)}), which all results are of",
                soft_wrap=True,
            )
        return [{**times.rows.get(key, {}), **runs.rows[key]} for key in keys]

    def _read_description(self) -> None:
        """Check that the folder holds this study, if any, and learn what made its runs."""
        path = self._path / STUDY
        if not path.exists():
            write_scenario(self._study.scenario, self._path / SCENARIO)
            return
        try:
            found = json.loads(path.read_text())
            self.calls = found.pop("calls")
        except (ValueError, KeyError, TypeError, AttributeError):
            raise FolderError(f"{path}: is not what a study would write") from None
        _check_same(self._path, self._content, found)

    def _describe_once(self, command: str, workers: Workers, console: Console) -> None:
        """Tell that there are runs by this command, when the first of them has ended."""
        if self._described:
            return
        self._described = True
        sources = fingerprint()
        if any(call["sources"] != sources for call in self.calls):
            console.print(
                f"{self._path}: holds runs that were made by other sources of this package",
                soft_wrap=True,
            )
        self.calls.append(
            {
                "command": command,
                "date": datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
                "workers": workers.description,
                "machine": machine.describe(),
                "sources": sources,
            }
        )
        draft = self._path / f"{STUDY}.draft"
        draft.write_text(json.dumps({**self._content, "calls": self.calls}, indent=2) + "\n")
        os.replace(draft, self._path / STUDY)

    @contextmanager
    def _locked(self) -> Iterator[None]:
        """Keep other processes from making runs in the folder; the system ends it if we die."""
        folder = os.open(self._path, os.O_RDONLY)
        try:
            try:
                fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise FolderError(f"{self._path}: another command is making runs there") from None
            yield
        finally:
            os.close(folder)


def write_scenario(scenario: Scenario, path: Path) -> None:
    """Write a scenario to a file that `Scenario.load` can read."""
    yaml = YAML(typ="safe", pure=True)
    yaml.representer.sort_base_mapping_type_on_output = False
    yaml.dump(scenario.model_dump(mode="json"), path)


def _check_same(path: Path, wanted: Any, found: Any, field: str = "") -> None:
    """Check that a description holds what is wanted, in the same order: the first is the robot.

    Raises:
        FolderError: it does not.
    """
    if isinstance(wanted, dict) and isinstance(found, dict) and list(wanted) == list(found):
        for name in wanted:
            _check_same(path, wanted[name], found[name], f"{field}.{name}" if field else name)
    elif wanted != found or isinstance(wanted, dict):
        here, there = (", ".join(v) if isinstance(v, dict) else repr(v) for v in (wanted, found))
        raise FolderError(
            f"{path}: holds results of another study: {field} is {there} there, and {here} here; "
            "give another folder with --out"
        )
