"""Memory: what a fit has freed is kept for its next large array.

The C library gives every array of some megabytes memory of its own, and gives it back when the
array goes; the next one then costs a page fault for each 4 KiB, which was measured to take a
fifth of a fit, and more on a machine whose host takes returned pages away.
"""

import ctypes
import sys

# Parameters of glibc's `mallopt`, from its malloc.h.
_TRIM_THRESHOLD, _MMAP_MAX, _ARENA_MAX = -1, -4, -8
_NEVER = 2**31 - 1


def keep_memory() -> None:
    """Let this process keep the memory that it frees; where there is no glibc, do nothing.

    Call it at the start of a program that fits orbits, before it starts threads.
    """
    if sys.platform != "linux":
        return
    choose = getattr(ctypes.CDLL(None), "mallopt", None)
    if choose is None:
        return
    # A thread's own arena is too small for these arrays, and would return them all the same.
    for parameter, value in ((_MMAP_MAX, 0), (_TRIM_THRESHOLD, _NEVER), (_ARENA_MAX, 1)):
        choose(parameter, value)
