"""Settings of the solver."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from gameinfer_ros.games.registry import NonNegative, Positive, PositiveInteger, Real

#: Step size and regularisation to which `converged_movement` applies, those of the paper.
_STEP_SIZE, _REGULARISATION = 0.5, 5.0


class SolverSettings(BaseModel):
    """Settings of the solver.

    Only `tolerance`, `warm_tolerance`, `max_iterations` and `threads` apply to the method `newton`;
    the tolerances do not apply to `iterative_lq`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    method: Literal["iterative_lq", "newton"] = Field(
        default="newton",
        description="`iterative_lq`, the damped iterations of the paper, which stop when they move "
        "little; or `newton`, which stops when all players are stationary, and leaves saddles",
    )
    tolerance: Positive = Field(
        default=1e-4,
        le=0.1,
        description="largest residual of stationarity of a player, relative to the size of its "
        "terms, at which the method `newton` has converged",
    )
    warm_tolerance: Positive = Field(
        default=0.05,
        le=0.1,
        description="residual at which the last solution, moved on by one step, is good enough for "
        "this step",
    )

    state_regularisation: NonNegative = Field(
        default=_REGULARISATION,
        le=1e3,
        description="constant added to the diagonal of the Hessian of each player's cost by state",
    )
    input_regularisation: NonNegative = Field(
        default=_REGULARISATION,
        le=1e3,
        description="constant added to the diagonal of the Hessian of each player's cost by input",
    )
    first_step_size: Real = Field(
        default=_STEP_SIZE,
        ge=1e-3,
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
        le=1,
        description="the solver has converged when an iteration with a step size of 0.5 and "
        "regularisation of 5 changes no state component by more than this, in its unit; smaller "
        "steps and larger regularisation, which slow the iterations down, lower the limit in "
        "proportion",
    )
    max_iterations: PositiveInteger = Field(
        default=200, description="maximum number of iterations of one solve"
    )
    threads: PositiveInteger = Field(
        default=1,
        le=64,
        description="number of threads; it does not change the results",
    )

    @property
    def movement_limit(self) -> float:
        """Largest change of a state component at which an iteration has converged, in its unit.

        Damped iterations move little wherever they start. The limit therefore scales with the
        step size, and inversely with the regularisation above the reference value.
        """
        damping = max(self.state_regularisation, self.input_regularisation) / _REGULARISATION
        return self.converged_movement * self.first_step_size / _STEP_SIZE / max(1.0, damping)

    def converged(self, step_size: Any, movement: Any) -> Any:
        """Return whether iterations have converged.

        Args:
            step_size: scale of the feed-forward terms (...); an iteration that the line search
                shortened has not converged.
            movement: largest change of a state component (...).
        """
        return (step_size == self.first_step_size) & (movement <= self.movement_limit)
