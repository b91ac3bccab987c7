"""Threads: one for each survey worker, so that a result does not depend on their number.

A sum over several threads is rounded by how the work was cut, so that the last digits hang
on the cores at hand. One thread to each of many processes also wastes none of them.
"""

import os
import sys

_POOLS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")


def use_one_thread() -> None:
    """Keep BLAS and XLA of this process to one thread each; call before JAX is imported.

    XLA makes as many threads as the process has cores when it starts: for as long as that takes
    it has one. Where a system does not tell cores apart (macOS) XLA keeps its threads.
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
    from threadpoolctl import threadpool_limits

    threadpool_limits(limits=1)


def count_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(_cores()) or os.cpu_count() or 1


def _cores() -> set[int]:
    return os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()


def _free_threads(cores: set[int]) -> None:
    """Let every thread of this process run on any of the cores again."""
    for thread in os.listdir("/proc/self/task"):
        try:
            os.sched_setaffinity(int(thread), cores)
        except ProcessLookupError:
            # It ended since the folder was listed.
            continue
