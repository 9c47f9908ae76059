"""Settings of the belief."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from gameinfer_ros.games import Game
from gameinfer_ros.games.registry import NonNegative, Positive, PositiveInteger

#: Limits of a belief: the number of particles, and the size of their strategies in bytes.
MOST_PARTICLES, MOST_BYTES = 1_000_000, 2**30


class BeliefSettings(BaseModel):
    """Settings of the belief."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    particles: PositiveInteger = Field(
        default=50, le=MOST_PARTICLES, description="number of particles at the start"
    )
    observation_noise: Positive = Field(
        default=0.1,
        description="standard deviation of each observed state component, in its unit",
    )
    duplicate_tolerance: NonNegative = Field(
        default=0.1,
        description="particles are merged if no state component of their trajectories differs by "
        "more than this, in its unit",
    )
    max_iterations: PositiveInteger | None = Field(
        default=None,
        description="maximum number of iterations for each light particle in one update, except "
        "the first; `max_iterations` of the solver if not given",
    )
    patience: PositiveInteger | None = Field(
        default=None,
        description="number of consecutive iterations, over several updates, after which a light "
        "particle that has not converged restarts from the zero seed; `max_iterations` of the "
        "solver if not given",
    )
    heavy: NonNegative = Field(
        default=0.01,
        le=1,
        description="probability from which a particle is heavy; only the solver's "
        "`max_iterations` limits its iterations",
    )


def check_particles(count: int, game: Game) -> None:
    """Check that a belief of `count` particles stays within the limits.

    Raises:
        ValueError: there are more than `MOST_PARTICLES`, or their strategies take more than
            `MOST_BYTES`.
    """
    nx, nu, T = game.players.n_states, game.players.n_inputs, game.horizon
    most = min(MOST_PARTICLES, MOST_BYTES // (8 * T * (nu * nx + nu + nx)))
    if count > most:
        raise ValueError(
            f"particles: {count} is not allowed: with {nx} states, {nu} inputs and a horizon of "
            f"{T} steps, it must be at most {most} (strategies of at most "
            f"{MOST_BYTES / 2**30:g} GiB)"
        )
