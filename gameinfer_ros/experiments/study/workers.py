"""Who makes the runs."""

from __future__ import annotations

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
    """There are no workers, or not the right ones, or they keep dying."""


class Workers:
    """Processes on this machine, or on a Dask cluster.

    Args:
        jobs: number of processes on this machine; one for each core if not given.
        scheduler: address of a Dask scheduler, whose workers are used instead. They need this
            package, in the same version.
    """

    #: So often in a row, without a result in between, processes may die.
    DEATHS = 3
    #: How long to wait for a scheduler, in s.
    PATIENCE = 10
    #: If none of a cluster's workers ends a call for so long, in s, none ever will: they are gone,
    #: or die each time. Processes of this machine are seen to die.
    LONGEST = 600

    def __init__(self, jobs: int | None = None, scheduler: str | None = None) -> None:
        self._jobs, self._scheduler = jobs or cpu_count(), scheduler

    @property
    def description(self) -> str:
        """Who they are, in words."""
        if self._scheduler is None:
            return f"{self._jobs} process{'' if self._jobs == 1 else 'es'} of this machine"
        return "workers of a Dask cluster"

    def results(
        self, function: Callable[[Argument], Result], arguments: Iterable[Argument]
    ) -> Iterator[tuple[Argument, Result]]:
        """Call a function with each argument; yields arguments and results as they are ready.

        A call whose process dies is made again, and so are those that other processes of this
        machine were busy with. The function must not mind being called twice.

        Raises:
            FailedRunError: the function failed; the message names the argument.
            WorkersError: there is no scheduler, or processes die again and again.
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
                    # Somebody else's turn: one of these will perhaps always kill its process.
                    remaining = remaining[self._jobs :] + remaining[: self._jobs]
                    if deaths == self.DEATHS:
                        raise WorkersError(
                            f"processes died {deaths} times without a result; {len(remaining)} "
                            f"runs are left, the first of them {remaining[0]}: {error}"
                        ) from error
                except TimeoutError as error:  # those of runs are RunErrors
                    raise WorkersError(
                        f"the Dask cluster at {self._scheduler} has no workers"
                    ) from error
                except multiprocessing.TimeoutError as error:
                    raise WorkersError(
                        f"no worker ended one of the {len(remaining)} runs that are left within "
                        f"{self.LONGEST} s, the first of them {remaining[0]}"
                    ) from error

    def _calls(
        self, function: Callable[[Argument], Result], arguments: Iterable[Argument]
    ) -> Iterator[tuple[Argument, Result]]:
        ours = None if self._scheduler is not None else os.getpid()
        calls = (delayed(_labelled)(function, argument, ours) for argument in arguments)
        # One call at a time: all that a process has done is lost until its whole batch is.
        longest = None if self._scheduler is None else self.LONGEST
        parallel = Parallel(return_as="generator_unordered", batch_size=1, timeout=longest)
        return iter(parallel(calls))


def _labelled(
    function: Callable[[Argument], Result], argument: Argument, parent: int | None
) -> tuple[Argument, Result]:
    """Call a function in a process of a cluster, or of the parent process on this machine."""
    if parent not in (None, os.getpid()):
        # A Ctrl-C in the terminal reaches us too, but to end us is up to the parent.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        return argument, function(argument)
    except FailedRunError:
        raise
    except Exception as error:
        told = traceback.format_exc()
        raise FailedRunError(f"run {argument} failed: {error!r}\n{told}") from None


def _backend(client: Any) -> Any:
    from joblib._dask import DaskDistributedBackend

    class Backend(DaskDistributedBackend):
        def effective_n_jobs(self, n_jobs: int = 1) -> int:
            # For one job, joblib would not ask the cluster: this process would do it all. But
            # a cluster that has one worker now may have more of them soon.
            return max(2, super().effective_n_jobs(n_jobs))

    return Backend(client=client)


def _connect(address: str, patience: float) -> Any:
    try:
        from dask.distributed import Client
    except ImportError:
        raise WorkersError(
            "a Dask cluster needs the package distributed: pip install 'gameinfer_ros[dask]'"
        ) from None
    try:
        client = Client(address, timeout=patience, set_as_default=False)
    except (OSError, ValueError) as error:
        raise WorkersError(f"no Dask scheduler answers at {address}: {error}") from error
    for worker, version in client.run(machine.version).items():
        if version != machine.version():
            client.close()
            raise WorkersError(
                f"the worker {worker} has version {version} of this package, and here it is "
                f"{machine.version()}: they must be the same"
            )
    return client
