"""Locks on files and folders, which the system releases when their holder ends, however it ends."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def locked(path: Path, wait: bool = False) -> Iterator[bool]:
    """Lock a file or a folder against other processes that lock it, while the block runs.

    Where the system or the file system has no such locks, nothing is locked.

    Parameters
    ----------
    path : exists
    wait : whether to wait for another process that holds the lock

    Yields
    ------
    False if another process holds the lock.
    """
    if sys.platform == "win32":
        yield True
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        # A network file system without locks must not keep a person from fitting.
        yield lock(descriptor, wait) is not False
    finally:
        os.close(descriptor)


def lock(descriptor: int, wait: bool = False) -> bool | None:
    """Lock an open file until it is closed.

    Returns
    -------
    False if another process holds the lock, None if the system or the file system has no locks.
    """
    if sys.platform == "win32":
        return None
    import fcntl

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True
