"""Settings of the iterative LQ solver."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from gameinfer_ros.games.registry import NonNegative, Positive, PositiveInteger, Real


class SolverSettings(BaseModel):
    """How the iterative LQ solver goes about it."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    state_regularisation: NonNegative = Field(
        default=5.0, description="added to the diagonal of each player's state cost Hessian"
    )
    input_regularisation: NonNegative = Field(
        default=5.0, description="added to the diagonal of each player's input cost Hessian"
    )
    first_step_size: Real = Field(
        default=0.5, gt=0, le=1, description="scale of the feed-forward term tried first"
    )
    max_halvings: int = Field(
        default=20,
        strict=True,
        ge=0,
        le=1000,
        description="how often the line search halves that scale at most",
    )
    max_movement: Positive = Field(
        default=1.5, description="how far an iteration may move any state component"
    )
    converged_movement: Positive = Field(
        default=0.05, description="converged when no state component moved by more"
    )
    max_iterations: PositiveInteger = Field(
        default=200, description="iterations after which the solver gives up"
    )
    threads: PositiveInteger = Field(
        default=1,
        le=64,
        description="threads that share the particles; results are the same with any number",
    )
