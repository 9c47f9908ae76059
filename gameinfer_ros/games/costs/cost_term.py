"""What a kind of cost term must provide."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from pydantic import Field

from gameinfer_ros.games.players import Players
from gameinfer_ros.games.registry import Kind


@dataclass(frozen=True)
class BoundTerm:
    """A cost term together with the numbers its kernels need for one player of one game.

    Attributes:
        term: the term.
        index: what its kernels get as `index`.
        params: what its kernels get as `params`.
    """

    term: CostTerm
    index: Sequence[int]
    params: Sequence[float]


class CostTerm(Kind):
    """One summand of a player's cost per step.

    A subclass is one file with a default for `kind`, its fields, two kernels (shapes in
    `gameinfer_ros.games.kernels`) and `bind`. `quadraticise_kernel` adds the first and second
    derivatives of what `cost_kernel` adds.
    """

    family: ClassVar[dict[str, type[Kind]]] = {}
    kind: str
    players: tuple[str, ...] | None = Field(
        default=None,
        min_length=1,
        description="names of the players who have this term; all if not given",
    )
    cost_kernel: ClassVar[Any]
    quadraticise_kernel: ClassVar[Any]

    @abstractmethod
    def bind(self, players: Players, i: int) -> list[BoundTerm]:
        """The term as player i of `players` has it.

        Raises:
            ValueError: the term does not fit the player; the message starts with the field.
        """

    def players_in(self, players: Players) -> list[int]:
        """Indices of those among `players` who have this term.

        Raises:
            ValueError: a player is not among `players`, or named twice.
        """
        if self.players is None:
            return list(range(len(players)))
        if len(set(self.players)) < len(self.players):
            raise ValueError(f"players: {list(self.players)} names a player twice")
        return [_index("players", name, players) for name in self.players]


def _index(field: str, name: str, players: Players) -> int:
    try:
        return players.index(name)
    except ValueError as error:
        raise ValueError(f"{field}: {error}") from None


def check_length(field: str, values: Sequence[float], names: Sequence[str]) -> None:
    """Check that there is one of `values` for each of `names`.

    Raises:
        ValueError: there is not.
    """
    if len(values) != len(names):
        raise ValueError(
            f"{field}: {list(values)} has {len(values)} numbers; "
            f"{len(names)} are needed, for {', '.join(names)}"
        )
