"""Settings of the belief."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from gameinfer_ros.games import Game
from gameinfer_ros.games.registry import NonNegative, Positive, PositiveInteger

#: Limits of a belief: the number of particles, and the bytes that their strategies take.
MOST_PARTICLES, MOST_BYTES = 1_000_000, 2**30


class BeliefSettings(BaseModel):
    """Settings of the belief."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    particles: PositiveInteger = Field(
        default=50, le=MOST_PARTICLES, description="number of seeds drawn at the start"
    )
    observation_noise: Positive = Field(
        default=0.1, description="standard deviation of each observed state component"
    )
    duplicate_tolerance: NonNegative = Field(
        default=0.1,
        description="particles are one if no state component differs by more along the horizon",
    )
    max_iterations: PositiveInteger | None = Field(
        default=None,
        description="iterations granted to each light particle in one update, after the first "
        "one; as many as the solver's settings allow if not given",
    )
    patience: PositiveInteger | None = Field(
        default=None,
        description="a light particle that has not converged within so many iterations in a row "
        "is begun anew from the zero seed; as many as the solver's settings allow if not given",
    )
    heavy: NonNegative = Field(
        default=0.01,
        le=1,
        description="probability from which on a particle is heavy: granted as many iterations "
        "as the solver's settings allow",
    )


def check_particles(count: int, game: Game) -> None:
    """Check that the strategies of so many particles are no more than a machine can hold.

    Raises:
        ValueError: they are.
    """
    nx, nu, T = game.players.n_states, game.players.n_inputs, game.horizon
    most = min(MOST_PARTICLES, MOST_BYTES // (8 * T * (nu * nx + nu + nx)))
    if count > most:
        raise ValueError(
            f"particles: {count} is not allowed: with {nx} states, {nu} inputs and a horizon of "
            f"{T} steps it must be at most {most}, whose strategies take {MOST_BYTES} bytes"
        )
