"""The results folder of a study."""

import json
import os
from collections.abc import Iterable
from contextlib import suppress
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
from gameinfer_ros.runs.folder import FolderError
from gameinfer_ros.scenario import Scenario

#: Files of a study: its description and origin, the scenario, the results, and measured times.
STUDY, SCENARIO, RUNS, TIMES = "study.json", "scenario.yaml", "runs.csv", "times.csv"


class StudyFolder:
    """A folder that stores a study run by run, so that an interrupted study can be resumed.

    Args:
        path: the folder, from `results_folder`.
        study: the study. If the folder already contains a study, it must be the same one.

    Attributes:
        calls: the commands that added runs, each with its date, workers, machine and sources.

    Raises:
        FolderError: the folder contains another study.
        OSError: the folder cannot be read or written.
    """

    def __init__(self, path: Path, study: Study) -> None:
        self._path, self._study = path, study
        self._content = {
            "study": study.name,
            "made_by": study.made_by,
            "scenario": self._described(study.scenario),
        }
        self.calls: list[dict[str, Any]] = []
        self._read_description()

    def complete(
        self, seeds: Iterable[int], workers: Workers, console: Console, command: str
    ) -> Rows:
        """Play the runs that the folder does not contain yet.

        Args:
            seeds: numbers of the requested runs.
            workers: processes that play the runs.
            console: where progress and warnings are printed.
            command: command line of the user, stored with the results.

        Returns:
            The rows of all requested runs.

        Raises:
            JournalError: a file of the folder is damaged.
            FailedRunError: a run failed.
            WorkersError: workers are missing, unsuitable, or died repeatedly.
        """
        study, keys = self._study, self._study.keys(seeds)
        timed = bool(study.time_columns)
        runs = Journal(self._path / RUNS, study.key_columns, study.columns)
        times = Journal(self._path / TIMES, study.key_columns, study.time_columns)
        missing = [k for k in keys if k not in runs.rows or (timed and k not in times.rows)]
        name = f"{study.name} in {self._path}"
        with StudyProgress(console, name, len(keys), len(keys) - len(missing)) as progress:
            results = workers.results(study.play, missing) if missing else ()
            for number, (key, row) in enumerate(results):
                if number == 0:
                    self._add_call(command, workers, console)
                if timed:  # first, because a run counts as played once it is in `runs`
                    times.append(key, row)
                runs.append(key, row)
                progress.advance()
        runs.sort()
        if timed:
            times.sort()
        if len(runs.rows) > len(keys):
            console.print(
                f"{name}: the folder contains {len(runs.rows)} runs; "
                f"the results cover only the {len(keys)} requested ones",
                soft_wrap=True,
            )
        return [{**times.rows.get(key, {}), **runs.rows[key]} for key in keys]

    def _read_description(self) -> None:
        """Check that the folder contains no other study, and read which commands made its runs."""
        path = self._path / STUDY
        if not path.exists():
            write_scenario(self._study.scenario, self._path / SCENARIO)
            return
        try:
            found = json.loads(path.read_text())
            self.calls = found.pop("calls")
        except (ValueError, KeyError, TypeError, AttributeError):
            raise FolderError(f"{path}: is not a valid description of a study") from None
        with suppress(KeyError, ValueError):
            # A field that did not exist when the study was made has its default value.
            found["scenario"] = self._described(Scenario.model_validate(found["scenario"]))
        _check_same(self._path, self._content, found)

    def _described(self, scenario: Scenario) -> dict[str, Any]:
        return scenario.model_dump(mode="json", exclude=self._study.irrelevant)

    def _add_call(self, command: str, workers: Workers, console: Console) -> None:
        """Store a command with its machine and sources."""
        sources = fingerprint()
        if any(call["sources"] != sources for call in self.calls):
            console.print(
                f"{self._path}: contains runs made by other sources of this package",
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


def write_scenario(scenario: Scenario, path: Path) -> None:
    """Write a scenario to a file that `Scenario.load` can read."""
    yaml = YAML(typ="safe", pure=True)
    yaml.representer.sort_base_mapping_type_on_output = False
    yaml.dump(scenario.model_dump(mode="json"), path)


def _check_same(path: Path, wanted: Any, found: Any, field: str = "") -> None:
    """Check that a description is the wanted one, with fields in the same order.

    The order matters because the first player is the robot. The error names the first difference.
    """
    if isinstance(wanted, dict) and isinstance(found, dict) and list(wanted) == list(found):
        for name in wanted:
            _check_same(path, wanted[name], found[name], f"{field}.{name}" if field else name)
    elif wanted != found or isinstance(wanted, dict):
        here, there = (", ".join(v) if isinstance(v, dict) else repr(v) for v in (wanted, found))
        raise FolderError(
            f"{path}: contains another study: {field} is {there} there, but {here} here; choose "
            "another folder with --out, or replace the study by --overwrite"
        )
