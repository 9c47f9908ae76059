"""In which order messages of a run may come."""

from __future__ import annotations

from msg_adapters import MessageError

#: How many steps a message may be later than the one before it.
AHEAD = 50

#: So many messages in a row that are out of order, but in order among themselves, are believed.
CONFIRMED = 3


class StepOrder:
    """Admits messages whose steps follow one another, and is not misled by a single one.

    The first message may be of any step. A later one must be of a later step, but by no more than
    `AHEAD`. One that is not is rejected, so that a stray stamp far in the future does not make
    all that follow stale. Only if `CONFIRMED` in a row are out of order, each later than the one
    before it by no more than `AHEAD`, is the last of them admitted: then time really has jumped,
    or the one that was admitted before was the stray one.

    Attributes:
        newest: step of the message that was admitted last; -1 if there is none.
    """

    def __init__(self) -> None:
        self._before = -1
        self.forget()

    def forget(self) -> None:
        """Begin anew: the next message may be of any step."""
        self.newest = self._doubtful = self._before = -1
        self._doubts = 0

    def restart(self) -> None:
        """Step 0 has come: of a new run, or once more, so that the run before may go on, too."""
        before = self.newest if self.newest > 0 else self._before
        self.forget()
        self._before = before

    def admit(self, step: int, reached: int = -1) -> None:
        """Admit the message of a step.

        Args:
            step: the step.
            reached: a step that is known to have come, by other messages. This one may be later
                than that by as much as it may be later than the one before it.

        Raises:
            MessageError: it is out of order.
        """
        latest = max(self.newest, reached) + AHEAD
        goes_on = 0 <= self._before < step <= self._before + AHEAD
        if self.newest >= 0 and not (self.newest < step <= latest or goes_on):
            in_a_row = self._doubts > 0 and 0 < step - self._doubtful <= AHEAD
            self._doubts = self._doubts + 1 if in_a_row else 1
            self._doubtful = step
            if self._doubts < CONFIRMED:
                raise MessageError(self._complaint(step))
        self.newest, self._doubts = step, 0
        if step > 0:
            self._before = -1

    def _complaint(self, step: int) -> str:
        if step <= self.newest:
            return f"stamp: step {step} is stale: step {self.newest} has already been received"
        return (
            f"stamp: step {step} is not allowed: step {self.newest} was the last, and the next "
            f"is at most {AHEAD} later, unless {CONFIRMED} messages in a row say otherwise"
        )
