"""The progress of a run in the terminal."""

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
from typing_extensions import Self

from gameinfer_ros.runs.record import RunRecord

#: Message before the solver is warmed up.
LOADING = "Loading compiled code (the first time, compiling takes half a minute) ..."

#: Age in s from which a belief is stale.
_OLD = 1.0


class RunProgress:
    """A live status line, or one line per second if the output is not a terminal."""

    def __init__(self, console: Console, steps: int) -> None:
        self._console = console
        self._bar = Progress(
            TextColumn("step"), MofNCompleteColumn(), BarColumn(20),
            TextColumn("{task.description}"), console=console, transient=True,
            disable=not console.is_terminal,
        )  # fmt: skip
        self._task = self._bar.add_task("", total=steps)
        self._printed = 0
        self._steps = steps

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def begin(self) -> None:
        """Begin a new run."""
        self._printed = 0

    def show(self, record: RunRecord, solve_ms: str | None) -> None:
        """Show the current step, and the belief with its solve time, in ms, if there is one."""
        words = [f"t = {record.steps * record.game.dt:.1f} s"]
        newest = max(record.beliefs, default=0)
        age = (record.steps - newest) * record.game.dt
        if record.beliefs and age > _OLD:
            words.append(f"the newest belief is {age:.1f} s old")
        elif record.beliefs:
            weights, likeliest = record.beliefs[newest], record.maps[newest]
            probability = weights.get(likeliest, 0.0)
            words += [
                f"MAP equilibrium {likeliest} with probability {probability:.3f}"
                if likeliest >= 0
                else "no equilibrium is known: the robot brakes",
                f"{len(weights)} particle{'s' * (len(weights) != 1)}",
            ]
            if solve_ms is not None:
                words.append(f"solved in {solve_ms} ms")
        line = ", ".join(words)
        self._bar.update(self._task, completed=record.steps, description=line)
        second = int(record.steps * record.game.dt)
        if not self._console.is_terminal and second > self._printed:
            self._printed = second
            self._console.print(f"step {record.steps}/{self._steps}: {line}", soft_wrap=True)
