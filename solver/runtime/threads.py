"""Threads: one per survey worker, so that results do not depend on the number of cores.

The rounding of a sum over several threads depends on how the work is divided, so the last
digits would depend on the number of cores. With many processes, one thread each also uses
all cores efficiently.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import Lock
from typing import Any

from threadpoolctl import OpenBLASController, ThreadpoolController

_POOLS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")


def use_one_thread() -> None:
    """Limit BLAS and XLA of this process to one thread each; call before JAX is imported.

    XLA starts one thread per core of the process, so the process is limited to one core while
    XLA starts. On systems without CPU affinity (macOS) XLA keeps its threads.
    """
    for variable in _POOLS:
        os.environ[variable] = "1"
    if "jax" in sys.modules:
        return
    cores = _cores()
    if cores:
        os.sched_setaffinity(0, {min(cores)})
    try:
        import jax

        jax.devices()
    finally:
        if cores:
            _free_threads(cores)
    ThreadpoolController().limit(limits=1)


class _Limit:
    """The limit of BLAS to one thread, from the first thread that needs it to the last.

    It is that of the process. If each thread removed it at the end of its own work, the rounding of
    the others would change in the midst of theirs.
    """

    def __init__(self) -> None:
        self._lock, self._inside = Lock(), 0
        self._limited: Any = None

    def enter(self) -> None:
        with self._lock:
            if self._inside == 0:
                self._limited = _thread_pools().limit(limits=1, user_api="blas")
            self._inside += 1

    def leave(self) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                # By threadpoolctl, only the thread that set a limit may change it, or any if none
                # is known.
                OpenBLASController.clear_controlling_thread(force=True)
                self._limited.restore_original_limits()
                OpenBLASController.clear_controlling_thread(force=True)


_LIMIT = _Limit()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Limit BLAS to one thread, in a block or in a decorated function.

    BLAS threads wait for one another in a busy loop. Where another process uses a core, such as a
    browser that draws, and where products are small, that was measured to make work up to a
    hundred times slower. Large work is divided among threads of Python instead.
    """
    _LIMIT.enter()
    try:
        yield
    finally:
        _LIMIT.leave()


@cache
def _thread_pools() -> ThreadpoolController:
    return ThreadpoolController()


def count_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(_cores()) or os.cpu_count() or 1


def _cores() -> set[int]:
    return os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()


def _free_threads(cores: set[int]) -> None:
    """Allow every thread of this process to run on any of `cores`."""
    for thread in os.listdir("/proc/self/task"):
        try:
            os.sched_setaffinity(int(thread), cores)
        except ProcessLookupError:
            # The thread ended after the folder was listed.
            continue
