"""Memory allocation: reuse freed memory for the next large array.

By default glibc maps memory for every array of some megabytes and unmaps it when the array is
freed. Each new array then costs a page fault per 4 KiB, which was measured to take a fifth of
a fit, and more on a virtual machine whose host reclaims freed pages.
"""

import ctypes
import sys

# Parameters of glibc's `mallopt`, from its malloc.h.
_TRIM_THRESHOLD, _MMAP_MAX, _ARENA_MAX = -1, -4, -8
_NEVER = 2**31 - 1


def keep_memory() -> None:
    """Configure glibc to keep freed memory in this process; without glibc, do nothing.

    Call it at the start of a program that fits orbits, before threads are started.
    """
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is None:
        return
    # One arena only: arenas of threads are too small for these arrays and would unmap them.
    for parameter, value in ((_MMAP_MAX, 0), (_TRIM_THRESHOLD, _NEVER), (_ARENA_MAX, 1)):
        mallopt(parameter, value)
