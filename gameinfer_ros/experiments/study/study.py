"""What a study must provide."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from matplotlib.figure import Figure

from gameinfer_ros.experiments.study.table import Table
from gameinfer_ros.scenario import Scenario

#: Names a run, by a value for each key column of its study.
Key = tuple[int | str, ...]

#: What came of a run: a value for each column.
Row = Mapping[str, int | float | str]

#: What journals say of runs, as text.
Rows = Sequence[Mapping[str, str]]


class FailedRunError(RuntimeError):
    """A run failed; the message says which one, and why."""


@dataclass(frozen=True)
class Study(ABC):
    """Independent runs of one scenario, each known by its number and perhaps by what is compared.

    A study is sent to worker processes as it is, so it must not hold anything of this one.

    Attributes:
        scenario: what is played.
    """

    scenario: Scenario

    #: Name of the study, and what it does, in words for the readers of a report.
    name: ClassVar[str]
    description: ClassVar[str]
    #: What tells runs apart: `seed`, the number that all random numbers of a run come of, first.
    key_columns: ClassVar[tuple[str, ...]] = ("seed",)
    #: What of a run was measured by a clock, and is another number in each repetition.
    time_columns: ClassVar[tuple[str, ...]] = ()

    @property
    def made_by(self) -> str:
        """What makes the runs."""
        return "core"

    @property
    def irrelevant(self) -> dict[str, Any]:
        """Fields of the scenario that play no part in the runs, to be left out of a dump."""
        return {"solver": {"threads"}, "players": {"__all__": {"limits"}}, "safety": True}

    # --- Runs ---------------------------------------------------------------------------------

    @property
    @abstractmethod
    def columns(self) -> tuple[str, ...]:
        """All else that comes of a run; it is the same to the last bit in each repetition."""

    def keys(self, seeds: Iterable[int]) -> list[Key]:
        """The runs with these numbers."""
        return [(seed,) for seed in seeds]

    @abstractmethod
    def play(self, key: Key) -> Row:
        """Make the run with this key; a value for each of `columns` and `time_columns`.

        Raises:
            FailedRunError: it failed.
        """

    # --- Results ------------------------------------------------------------------------------

    @abstractmethod
    def figures(self, rows: Rows) -> dict[str, Any]:
        """What all runs together say, fit for JSON."""

    def holds(self, figures: Mapping[str, Any]) -> bool:
        """Whether the figures are as they must be, if there is anything that they must be."""
        return True

    @abstractmethod
    def tables(self, figures: Mapping[str, Any]) -> list[Table]:
        """The figures, to be read by people."""

    @abstractmethod
    def draw(self, rows: Rows, figures: Mapping[str, Any]) -> Figure:
        """A picture of the results."""

    # --- What several studies need --------------------------------------------------------------

    @property
    def players(self) -> tuple[str, ...]:
        """Names of the players."""
        return tuple(self.scenario.players)

    @property
    def cost_columns(self) -> tuple[str, ...]:
        """Names of columns with the cost to each player."""
        return tuple(f"cost_{name}" for name in self.players)


def numbers(rows: Rows, columns: Sequence[str]) -> np.ndarray:
    """The numbers (rows, columns) in these columns of a journal."""
    values = [[float(row[column]) for column in columns] for row in rows]
    return np.array(values).reshape(len(rows), len(columns))
