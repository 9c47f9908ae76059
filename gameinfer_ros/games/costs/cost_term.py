"""The interface of cost terms."""

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
    """A cost term of one player of one game, with the arguments of its kernels.

    Attributes:
        term: the cost term.
        index: the argument `index` of its kernels.
        params: the argument `params` of its kernels.
    """

    term: CostTerm
    index: Sequence[int]
    params: Sequence[float]


class CostTerm(Kind):
    """Base class of cost terms, the summands of a player's cost per step.

    A subclass is one file. It defines a default for `kind`, its fields, two kernels (see
    `gameinfer_ros.games.kernels`) and `bind`. `quadraticise_kernel` adds the first and second
    derivatives of the cost that `cost_kernel` returns.
    """

    family: ClassVar[dict[str, type[Kind]]] = {}
    kind: str
    players: tuple[str, ...] | None = Field(
        default=None,
        min_length=1,
        description="names of the players to whom the term applies; all players if not given",
    )
    cost_kernel: ClassVar[Any]
    quadraticise_kernel: ClassVar[Any]
    #: Like `quadraticise_kernel`, with second derivatives that are positive semidefinite; needed
    #: if those of the term are not.
    gauss_newton_kernel: ClassVar[Any] = None

    @classmethod
    def gauss_newton(cls) -> Any:
        """Return the kernel whose second derivatives are positive semidefinite."""
        return cls.gauss_newton_kernel or cls.quadraticise_kernel

    @abstractmethod
    def bind(self, players: Players, i: int) -> list[BoundTerm]:
        """Bind the term to player i of `players`.

        Raises:
            ValueError: the term does not fit the player. The message starts with the field.
        """

    def players_in(self, players: Players) -> list[int]:
        """Return the indices of the players to whom the term applies.

        Raises:
            ValueError: the term names a player twice, or one that is not among `players`.
        """
        if self.players is None:
            return list(range(len(players)))
        if len(set(self.players)) < len(self.players):
            raise ValueError(
                f"players: {list(self.players)} is not allowed: it names a player twice"
            )
        try:
            return [players.index(name) for name in self.players]
        except ValueError as error:
            raise ValueError(f"players: {error}") from None


def check_length(field: str, values: Sequence[float], names: Sequence[str]) -> None:
    """Check that `values` and `names` have the same length.

    Raises:
        ValueError: they do not; the message starts with `field`.
    """
    if len(values) != len(names):
        raise ValueError(
            f"{field}: {list(values)} is not allowed: it must have {len(names)} numbers, for "
            f"{', '.join(names)}"
        )
