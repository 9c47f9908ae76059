"""A reference for the speed of the processor: the product of two matrices of doubles."""

import os
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from gameinfer_ros.experiments.benchmark.stopwatch import medians_ms, milliseconds

_ONE_THREAD = {name: "1" for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")}


class Dgemm:
    """A benchmark of NumPy's matrix product, with all `rates` measured so far, in GFLOP/s."""

    #: Rows and columns of the matrices.
    SIDE = 512
    #: Products per thread when numbers of threads are compared.
    PRODUCTS = 10

    def __init__(self) -> None:
        self._left, self._right = np.random.default_rng(0).normal(size=(2, self.SIDE, self.SIDE))
        self._product = np.empty((self.SIDE, self.SIDE))
        self._multiply()
        self.rates: list[float] = []

    def rate(self) -> float:
        """Measure the rate of one product, in GFLOP/s."""
        rate = 2 * self.SIDE**3 / milliseconds(self._multiply) / 1e6
        self.rates.append(rate)
        return rate

    def speed_up_of_two_threads(self, repetitions: int) -> float:
        """Measure how much faster two threads multiply than one: 2 if each has its own core."""
        products = np.empty((2, self.SIDE, self.SIDE))

        def multiply(product: np.ndarray) -> None:
            for _ in range(self.PRODUCTS):
                np.matmul(self._left, self._right, out=product)

        with ThreadPoolExecutor(2) as threads:
            ms = medians_ms(
                {
                    1: lambda: list(map(multiply, products)),
                    2: lambda: list(threads.map(multiply, products)),
                },
                repetitions,
            )
        return ms[1] / ms[2]

    def _multiply(self) -> None:
        np.matmul(self._left, self._right, out=self._product)


def use_one_thread() -> None:
    """Limit NumPy's BLAS to one thread, by restarting the command line of this process.

    BLAS reads its environment when NumPy is imported, which has happened by now. The function
    returns once the environment is right.
    """
    if _ONE_THREAD.items() <= os.environ.items():
        return
    sys.stdout.flush()
    os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], {**os.environ, **_ONE_THREAD})
