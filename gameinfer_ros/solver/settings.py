"""Settings of the iterative LQ solver."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from gameinfer_ros.games.registry import NonNegative, Positive, PositiveInteger, Real


class SolverSettings(BaseModel):
    """Settings of the iterative LQ solver."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    state_regularisation: NonNegative = Field(
        default=5.0,
        description="constant added to the diagonal of the Hessian of each player's cost by state",
    )
    input_regularisation: NonNegative = Field(
        default=5.0,
        description="constant added to the diagonal of the Hessian of each player's cost by input",
    )
    first_step_size: Real = Field(
        default=0.5,
        gt=0,
        le=1,
        description="scale of the feed-forward terms with which the line search starts",
    )
    max_halvings: int = Field(
        default=20,
        strict=True,
        ge=0,
        le=1000,
        description="maximum number of times that the line search halves this scale",
    )
    max_movement: Positive = Field(
        default=1.5,
        description="largest change of a state component in one iteration, in its unit; the line "
        "search enforces it",
    )
    converged_movement: Positive = Field(
        default=0.05,
        description="the solver has converged when an iteration changes no state component by "
        "more than this, in its unit",
    )
    max_iterations: PositiveInteger = Field(
        default=200, description="maximum number of iterations of one solve"
    )
    threads: PositiveInteger = Field(
        default=1,
        le=64,
        description="number of threads; it does not change the results",
    )
