"""The error of a failed run."""

from gameinfer_ros.names.exit_codes import FAILED


class RunError(RuntimeError):
    """The run failed, or its results cannot be written. The message says why."""

    def __init__(self, message: str, exit_code: int = FAILED) -> None:
        super().__init__(message)
        self.exit_code = exit_code
