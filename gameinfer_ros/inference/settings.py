"""Settings of the belief."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from gameinfer_ros.games import Game
from gameinfer_ros.games.registry import NonNegative, Positive, PositiveInteger
from gameinfer_ros.lanes.array import WIDE

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
    """Check that a belief of `count` particles, and the solver, stay within the limits.

    Raises:
        ValueError: there are more than `MOST_PARTICLES`, or the strategies of the particles, or of
            those that the solver processes side by side, take more than `MOST_BYTES`. The message
            starts with the field, `horizon` or `particles`.
    """
    nx, nu, T = game.players.n_states, game.players.n_inputs, game.horizon
    most = MOST_BYTES // (8 * (nu * nx + nu + nx))  # particles times steps
    size = f"{MOST_BYTES / 2**30:g} GiB"
    if most // WIDE < T:
        raise ValueError(
            f"horizon: {T} is not allowed: with {nx} states and {nu} inputs, it must be at most "
            f"{most // WIDE} (strategies of {WIDE} particles of at most {size})"
        )
    most = min(MOST_PARTICLES, most // T)
    if count > most:
        raise ValueError(
            f"particles: {count} is not allowed: with {nx} states, {nu} inputs and a horizon of "
            f"{T} steps, it must be at most {most} (strategies of at most {size})"
        )
