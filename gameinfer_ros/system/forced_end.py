"""Ends a process that hangs by force, and says where it hangs."""

import faulthandler
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path

from gameinfer_ros.names.exit_codes import FAILED
from gameinfer_ros.system.interruption import SIGNALS

#: Time after which the process is ended without its own help, in s: by a thread that does not need
#: Python's lock, and then by the system.
_WITHOUT_LOCK, _BY_SYSTEM = 1.0, 2.0

#: Longest time that `before` may take, in s.
_BEFORE = 20.0

#: File descriptor of stderr.
_STDERR = 2


class ForcedEnd:
    """Ends this process with the exit code `FAILED` unless something ends in time.

    What hangs is written to stderr, and the stacks of all threads to `log`. A thread that hangs in
    a library may hold Python's lock. No Python code runs then: the stacks are written to stderr one
    second later, and after two seconds the system ends the process by SIGALRM.

    A process has one timeout at a time: a new one replaces the last.

    Args:
        who: the process, for the message, such as "the run".
        before: called just before the end, for example to end other processes.

    Attributes:
        log: file for the stacks; None for stderr.
    """

    def __init__(self, who: str, before: Callable[[], None] = lambda: None) -> None:
        self._who, self._before = who, before
        self.log: Path | None = None
        self._over: threading.Event | None = None

    def within(self, seconds: float, what: str) -> None:
        """End the process after `seconds` unless `cancel` is called; `what` it does meanwhile."""
        self.cancel()
        self._over = over = threading.Event()
        words = f"{what} has not ended within {seconds:g} s"
        threading.Thread(target=self._wait, args=(seconds, words, over), daemon=True).start()
        self._without_python(seconds)

    @property
    def pending(self) -> bool:
        """Whether there is a timeout."""
        return self._over is not None

    def cancel(self) -> None:
        """Cancel the timeout."""
        if self._over is not None:
            self._over.set()
            self._over = None
            faulthandler.cancel_dump_traceback_later()
            signal.setitimer(signal.ITIMER_REAL, 0)

    def after_signals(self, seconds: float) -> Callable[[], None]:
        """From now on, end the process `seconds` after one of `SIGNALS`, unless it is cancelled.

        The signals must have handlers in Python. They need not run: the main thread may hang.

        Returns:
            A function that makes signals have no such effect any more.
        """
        received, sent = os.pipe()
        os.set_blocking(sent, False)
        signal.set_wakeup_fd(sent, warn_on_full_buffer=False)
        args = (received, seconds)
        threading.Thread(target=self._await_signal, args=args, daemon=True).start()

        def stop() -> None:
            signal.set_wakeup_fd(-1)
            os.close(sent)

        return stop

    @contextmanager
    def watch(
        self, seconds: float, what: str
    ) -> Iterator[Callable[[], AbstractContextManager[None]]]:
        """Within the block, end the process if a block of what is yielded takes `seconds`.

        Time in which the process is stopped does not count.
        """
        over, inside, entered = threading.Event(), False, 0

        @contextmanager
        def guard() -> Iterator[None]:
            nonlocal inside, entered
            inside, entered = True, entered + 1
            try:
                yield
            finally:
                inside = False

        def wait() -> None:
            last, same = 0, 0
            while not over.wait(1.0):
                same = same + 1 if inside and entered == last else 0
                last = entered
                if same >= seconds:
                    self._force(f"{what} has not ended within {seconds:g} s")

        threading.Thread(target=wait, daemon=True).start()
        try:
            yield guard
        finally:
            over.set()

    def _wait(self, seconds: float, words: str, over: threading.Event) -> None:
        if not over.wait(seconds):
            self._force(words)

    def _await_signal(self, received: int, seconds: float) -> None:
        while number := os.read(received, 1):
            if number[0] in SIGNALS and not self.pending:
                name = signal.Signals(number[0]).name
                self.within(seconds, f"what {name} interrupted")

    def _force(self, words: str) -> None:
        where = "follow" if self.log is None else f"are in {self.log}"
        text = (
            f"{self._who} hangs and is ended by force: {words}. The stacks of all threads {where}"
        )
        # A write to a terminal or a pipe may be what hangs.
        says = threading.Thread(target=self._say, args=(text,), daemon=True)
        says.start()
        says.join(_WITHOUT_LOCK / 4)
        self._dump()
        self._without_python(_BEFORE)
        self._before()
        os._exit(FAILED)

    def _dump(self) -> None:
        if self.log is not None:
            with suppress(OSError), self.log.open("w") as file:
                faulthandler.dump_traceback(file)
                return
        faulthandler.dump_traceback(_STDERR)

    @staticmethod
    def _say(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    @staticmethod
    def _without_python(seconds: float) -> None:
        """Set the timeouts that work while no Python code runs."""
        faulthandler.dump_traceback_later(seconds + _WITHOUT_LOCK, exit=True, file=_STDERR)
        signal.setitimer(signal.ITIMER_REAL, seconds + _BY_SYSTEM)
