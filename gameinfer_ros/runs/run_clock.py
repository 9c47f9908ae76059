"""The clock of a run, which relates steps and stamps."""

import re
from fractions import Fraction

from msg_adapters import MessageError, stamp


class EarlyError(MessageError):
    """A message belongs to an unknown run, possibly one whose start has not been received yet."""


class RunClock:
    """The clock of the current run, which converts between steps and stamps.

    A stamp is the start of the run plus the time of the step. The start identifies the run. Times
    are whole nanoseconds.

    Args:
        dt: length of a time step, in s.

    Attributes:
        start: start of the current run, in ns; None if no run is known.
    """

    def __init__(self, dt: float) -> None:
        self._dt = dt
        # A time step has this many nanoseconds, as a ratio: that of the decimal number that the
        # scenario contains. Floats would be too coarse: after 104 days, they do not count every
        # nanosecond.
        length = Fraction(repr(float(dt))) * stamp.SECOND
        self._numerator, self._denominator = length.numerator, length.denominator
        self.start: int | None = None

    @property
    def run(self) -> str:
        """Name of the run in statuses: its start in s, with nine digits; empty if unknown."""
        return "" if self.start is None else stamp.text(self.start)

    def stamp(self, step: int) -> int:
        """Return the stamp of a step of the current run, in ns."""
        assert self.start is not None
        return self.start + _rounded_ratio(step * self._numerator, self._denominator)

    def step(self, time: int) -> int:
        """Return the step of the current run that a stamp, in ns, belongs to.

        Raises:
            EarlyError: no run is known, or the stamp is between two steps.
            MessageError: the stamp is before the start.
        """
        words = f"stamp: {stamp.text(time)} s"
        if self.start is None:
            raise EarlyError(f"{words} is of an unknown run: no run_start has been received")
        if time < self.start:
            raise MessageError(f"{words} is of an earlier run: the present run began at {self.run}")
        step = _rounded_ratio((time - self.start) * self._denominator, self._numerator)
        # Stamps are rounded to nanoseconds.
        if abs(time - self.stamp(step)) > 1:
            raise EarlyError(
                f"{words} is not allowed: it is between two steps of {self._dt} s of the run that "
                f"began at {self.run}"
            )
        return step

    def is_present(self, run: str) -> bool:
        """Return whether a run, named as by `run`, is the current one and not an earlier one.

        Raises:
            EarlyError: the run is later than the current one, or no run is known.
            MessageError: the name is malformed.
        """
        if not re.fullmatch(r"[0-9]{1,10}\.[0-9]{9}", run):
            raise MessageError(
                f"run: '{run}' is not allowed: it must be the start of a run in s, with nine digits"
            )
        if self.start is None or int(run.replace(".", "")) > self.start:
            raise EarlyError(f"run: {run} is unknown: its run_start has not been received")
        return run == self.run


def _rounded_ratio(numerator: int, denominator: int) -> int:
    """Return the whole number next to a ratio that is not negative."""
    return (2 * numerator + denominator) // (2 * denominator)
