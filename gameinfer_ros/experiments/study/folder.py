"""The folder that a study's results are in."""

from __future__ import annotations

import json
from collections.abc import Iterable
from datetime import datetime, timezone
from importlib import metadata
from pathlib import Path
from typing import Any

import yaml
from rich.console import Console

from gameinfer_ros.experiments import machine
from gameinfer_ros.experiments.study.journal import Journal
from gameinfer_ros.experiments.study.progress import StudyProgress
from gameinfer_ros.experiments.study.study import Rows, Study
from gameinfer_ros.experiments.study.workers import Workers
from gameinfer_ros.scenario import Scenario

#: Files of a study: what it is and how it came about; what was played; results; times.
STUDY, SCENARIO, RUNS, TIMES = "study.json", "scenario.yaml", "runs.csv", "times.csv"


class FolderError(ValueError):
    """A folder holds another study; the message says in what it differs."""


class StudyFolder:
    """Keeps what comes of a study, run by run, so that it can be gone on with.

    Args:
        path: the folder; it is made if there is none.
        study: the study. If the folder holds one already, it must be the same one.

    Raises:
        FolderError: the folder holds another study.
        JournalError: a file in it is broken.
        OSError: it cannot be used.
    """

    def __init__(self, path: Path, study: Study) -> None:
        self._path, self._study = path, study
        content = {
            "study": study.name,
            "version": version(),
            "scenario": study.scenario.model_dump(mode="json", exclude={"solver": {"threads"}}),
        }
        path.mkdir(parents=True, exist_ok=True)
        self._description: dict[str, Any] = {**content, "calls": []}
        if (path / STUDY).exists():
            self._description = json.loads((path / STUDY).read_text())
            _check_same(path, content, self._description)
        else:
            write_scenario(study.scenario, path / SCENARIO)
        self._runs = Journal(path / RUNS, study.key_columns, study.columns)
        self._times = Journal(path / TIMES, study.key_columns, study.time_columns)

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
        """
        study, keys = self._study, self._study.keys(seeds)
        missing = [key for key in keys if key not in self._runs]
        if missing:
            self._describe(command)
            name = f"{study.name} of {len(study.players)} players"
            with StudyProgress(console, name, len(keys), len(keys) - len(missing)) as progress:
                for key, row in workers.results(study.play, missing):
                    if study.time_columns:  # first, so that a run that counts has its times
                        self._times.append(key, row)
                    self._runs.append(key, row)
                    progress.advance()
            self._runs.sort()
            if study.time_columns:
                self._times.sort()
        times = self._times.rows
        return [{**times.get(key, {}), **self._runs.rows[key]} for key in keys]

    @property
    def calls(self) -> list[dict[str, Any]]:
        """The commands that added runs: what, when, and on what machine."""
        return list(self._description["calls"])

    def _describe(self, command: str) -> None:
        moment = datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC")
        call = {"command": command, "date": moment, "machine": machine.describe()}
        self._description["calls"].append(call)
        (self._path / STUDY).write_text(json.dumps(self._description, indent=2) + "\n")


def write_scenario(scenario: Scenario, path: Path) -> None:
    """Write a scenario to a file that `Scenario.load` can read."""
    content = scenario.model_dump(mode="json")
    path.write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None))


def version() -> str:
    """Version of this package."""
    try:
        return metadata.version("gameinfer_ros")
    except metadata.PackageNotFoundError:  # a source tree that was not installed
        return "not installed"


def _check_same(path: Path, wanted: Any, found: Any, field: str = "") -> None:
    """Check that a description holds what is wanted.

    Raises:
        FolderError: it does not.
    """
    if isinstance(wanted, dict) and isinstance(found, dict):
        for name in wanted:
            _check_same(path, wanted[name], found.get(name), f"{field}.{name}" if field else name)
    elif wanted != found:
        raise FolderError(
            f"{path}: holds results of another study: {field} is {found!r} there, and {wanted!r} "
            "here; give another folder with --out"
        )
