"""Why a run fails."""

from __future__ import annotations

from gameinfer_ros.names.exit_codes import FAILED


class RunError(RuntimeError):
    """The run cannot go on, or its results cannot be written; the message says why.

    Attributes:
        exit_code: what the orchestrator exits with.
    """

    def __init__(self, message: str, exit_code: int = FAILED) -> None:
        super().__init__(message)
        self.exit_code = exit_code
