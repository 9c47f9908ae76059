"""The base class of studies."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gameinfer_ros.experiments.study.table import Table
from gameinfer_ros.scenario import Scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Identifies a run: one value per key column of its study.
Key = tuple[int | str, ...]

#: The results of a run: one value per column.
Row = Mapping[str, int | float | str]

#: The results of several runs as read from journals, as text.
Rows = Sequence[Mapping[str, str]]


class FailedRunError(RuntimeError):
    """A run failed; the message names the run and the reason."""


@dataclass(frozen=True)
class Study(ABC):
    """Independent runs of one scenario, and what is computed from them.

    Studies are pickled and sent to worker processes, so they must not hold state of this process.

    Attributes:
        scenario: the scenario to play.
    """

    scenario: Scenario

    #: Name of the study.
    name: ClassVar[str]
    #: Description for the readers of a report.
    description: ClassVar[str]
    #: Columns that identify a run; the first is `seed`, which determines its random numbers.
    key_columns: ClassVar[tuple[str, ...]] = ("seed",)
    #: Columns with measured times, which differ between repetitions of the same run.
    time_columns: ClassVar[tuple[str, ...]] = ()

    @property
    def made_by(self) -> str:
        """Program that plays the runs; runs of different programs do not share a folder."""
        return "core"

    @property
    def irrelevant(self) -> dict[str, Any]:
        """Fields of the scenario that do not affect the runs, in pydantic's form for `exclude`."""
        return {"solver": {"threads"}, "players": {"__all__": {"limits"}}, "safety": True}

    # --- Runs ---------------------------------------------------------------------------------

    @property
    @abstractmethod
    def columns(self) -> tuple[str, ...]:
        """Columns with results, which are equal to the last bit in each repetition of a run."""

    def keys(self, seeds: Iterable[int]) -> list[Key]:
        """Return the keys of all runs with these seeds."""
        return [(seed,) for seed in seeds]

    @abstractmethod
    def play(self, key: Key) -> Row:
        """Play the run with this key.

        Returns:
            A value for each of `columns` and `time_columns`.

        Raises:
            FailedRunError: the run failed.
        """

    # --- Results ------------------------------------------------------------------------------

    @abstractmethod
    def figures(self, rows: Rows) -> dict[str, Any]:
        """Compute the figures of all runs together, as a JSON object."""

    def holds(self, figures: Mapping[str, Any]) -> bool:
        """Return whether the figures meet the requirements of the study, if it has any."""
        return True

    @abstractmethod
    def tables(self, figures: Mapping[str, Any]) -> list[Table]:
        """Format the figures as tables."""

    @abstractmethod
    def draw(self, rows: Rows, figures: Mapping[str, Any]) -> "Figure":
        """Draw the results."""

    # --- Columns of players -------------------------------------------------------------------

    @property
    def players(self) -> tuple[str, ...]:
        """Names of the players."""
        return tuple(self.scenario.players)

    @property
    def cost_columns(self) -> tuple[str, ...]:
        """Names of the columns with the cost to each player."""
        return self.columns_of_players("cost")

    def columns_of_players(self, quantity: str) -> tuple[str, ...]:
        """Return the names of the columns with a quantity of each player."""
        return tuple(f"{quantity}_{name}" for name in self.players)


def numbers(rows: Rows, columns: Sequence[str]) -> np.ndarray:
    """Return the numbers (rows, columns) in some columns of a journal."""
    values = [[float(row[column]) for column in columns] for row in rows]
    return np.array(values).reshape(len(rows), len(columns))
