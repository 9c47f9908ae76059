"""Processes that play the runs of a study."""

import multiprocessing
import os
import signal
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from typing import Any, TypeVar

from joblib import Parallel, cpu_count, delayed, parallel_config
from joblib.externals.loky.process_executor import TerminatedWorkerError

from gameinfer_ros.experiments import machine
from gameinfer_ros.experiments.study.study import FailedRunError

Argument = TypeVar("Argument")
Result = TypeVar("Result")


class WorkersError(RuntimeError):
    """Workers are missing, have another version of the package, or died repeatedly."""


class Workers:
    """Processes on this machine, or the workers of a Dask cluster.

    Args:
        jobs: number of processes on this machine; None for one per core.
        scheduler: address of a Dask scheduler, whose workers are used instead. They need the same
            version of this package.
    """

    #: Number of deaths of processes in a row, without a result, after which to give up.
    DEATHS = 3
    #: Timeout of the connection to a scheduler, in s.
    PATIENCE = 10
    #: Time without a result from a cluster, in s, after which to give up: its workers are gone or
    #: die again and again. On this machine, deaths are detected at once.
    LONGEST = 600

    def __init__(self, jobs: int | None = None, scheduler: str | None = None) -> None:
        self._jobs, self._scheduler = jobs or cpu_count(), scheduler

    @property
    def description(self) -> str:
        """Description of the workers, stored with the results."""
        if self._scheduler is None:
            return f"{self._jobs} process{'' if self._jobs == 1 else 'es'} of this machine"
        return "workers of a Dask cluster"

    def results(
        self, function: Callable[[Argument], Result], arguments: Iterable[Argument]
    ) -> Iterator[tuple[Argument, Result]]:
        """Call a function with each argument, in parallel.

        If a process dies, its call is repeated, and so are the pending calls of the other processes
        on this machine. Repeated calls must be harmless.

        Yields:
            Arguments with their results, as they become available.

        Raises:
            FailedRunError: the function failed; the message names the argument.
            WorkersError: workers are missing, have another version, or died repeatedly.
        """
        remaining, deaths = list(arguments), 0
        with ExitStack() as resources:
            if self._scheduler is None:
                resources.enter_context(parallel_config("loky", n_jobs=self._jobs))
            else:
                client = resources.enter_context(_connect(self._scheduler, self.PATIENCE))
                resources.enter_context(parallel_config(_backend(client)))
            while remaining:
                try:
                    for argument, result in self._calls(function, list(remaining)):
                        remaining.remove(argument)
                        deaths = 0
                        yield argument, result
                except TerminatedWorkerError as error:
                    deaths += 1
                    # One of the pending calls may kill its process every time: try others first.
                    remaining = remaining[self._jobs :] + remaining[: self._jobs]
                    if deaths == self.DEATHS:
                        raise WorkersError(
                            f"processes died {deaths} times in a row without a result; "
                            f"{len(remaining)} runs remain, the first is {remaining[0]}: {error}"
                        ) from error
                except TimeoutError as error:  # timeouts of runs are FailedRunErrors
                    raise WorkersError(
                        f"the Dask cluster at {self._scheduler} has no workers"
                    ) from error
                except multiprocessing.TimeoutError as error:
                    raise WorkersError(
                        f"no worker finished a run within {self.LONGEST} s; {len(remaining)} runs "
                        f"remain, the first is {remaining[0]}"
                    ) from error

    def _calls(
        self, function: Callable[[Argument], Result], arguments: Iterable[Argument]
    ) -> Iterator[tuple[Argument, Result]]:
        parent = os.getpid() if self._scheduler is None else None
        calls = (delayed(_labelled)(function, argument, parent) for argument in arguments)
        timeout = None if self._scheduler is None else self.LONGEST
        # Batches of one call, because a process that dies loses the results of its whole batch.
        parallel = Parallel(return_as="generator_unordered", batch_size=1, timeout=timeout)
        return iter(parallel(calls))


def _labelled(
    function: Callable[[Argument], Result], argument: Argument, parent: int | None
) -> tuple[Argument, Result]:
    """Call a function in a worker; `parent` is the process that started it, None on a cluster."""
    if parent not in (None, os.getpid()):
        # A Ctrl-C in the terminal reaches the worker too, but only the parent may end it.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        return argument, function(argument)
    except FailedRunError:
        raise
    except Exception as error:
        trace = traceback.format_exc()
        raise FailedRunError(f"run {argument} failed: {error!r}\n{trace}") from None


def _backend(client: Any) -> Any:
    from joblib._dask import DaskDistributedBackend

    class Backend(DaskDistributedBackend):
        def effective_n_jobs(self, n_jobs: int = 1) -> int:
            # With one job, joblib would run everything in this process. A cluster with one worker
            # must still be used, and may get more workers later.
            return max(2, super().effective_n_jobs(n_jobs))

    return Backend(client=client)


def _connect(address: str, patience: float) -> Any:
    try:
        from dask.distributed import Client
    except ImportError:
        raise WorkersError(
            "a Dask cluster requires the package distributed: pip install 'gameinfer_ros[dask]'"
        ) from None
    try:
        client = Client(address, timeout=patience, set_as_default=False)
    except (OSError, ValueError) as error:
        raise WorkersError(f"no Dask scheduler answers at {address}: {error}") from error
    for worker, version in client.run(machine.version).items():
        if version != machine.version():
            client.close()
            raise WorkersError(
                f"the worker {worker} has version {version} of gameinfer_ros, but this machine has "
                f"{machine.version()}: the versions must be the same"
            )
    return client
