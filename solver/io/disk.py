"""A disk that takes no file, in words: full, over a quota or a limit, read-only, failing."""

import errno
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from solver.errors import DiskError, InputError

_REPEAT = "and try again"
# What is found, and what to do about it.
_REASONS = {
    errno.ENOSPC: ("a full disk", f"free some space, {_REPEAT}"),
    errno.EDQUOT: ("your disk quota used up", f"free some space, {_REPEAT}"),
    errno.EFBIG: ("a lower limit on the size of a file", f"raise the limit, {_REPEAT}"),
    errno.EROFS: ("a read-only disk", f"choose another folder, or make it writable {_REPEAT}"),
    errno.EACCES: (
        "no permission to write there",
        f"choose another folder, or change this one {_REPEAT}",
    ),
    errno.EPERM: (
        "no permission to write there",
        f"choose another folder, or change this one {_REPEAT}",
    ),
    errno.EIO: ("a disk that fails", "check the disk, and use another one"),
}
# NumPy does not tell why a file was cut off.
_CUT = re.compile(r"\d+ requested and \d+ written")
_OF_SPACE = (errno.ENOSPC, errno.EDQUOT)
FULL = (*_OF_SPACE, errno.EFBIG)


@contextmanager
def writing(path: Path, what: str = "to write the file") -> Iterator[None]:
    """Convert the system's errors inside the block to errors in words.

    Parameters
    ----------
    path : the file or the folder that is written
    what : what is expected to be done to it

    Raises
    ------
    DiskError
        If the disk takes no more, or no file at all.
    InputError
        If writing fails for another reason.
    """
    try:
        yield
    except OSError as error:
        raise disk_error(error, path, what) or InputError(
            f"{path}: expected {what}, found: {error.strerror or error}"
        ) from error


def disk_error(
    error: BaseException, path: Path, what: str = "to write the file"
) -> DiskError | None:
    """Return an error in words if a disk is the reason of `error`, otherwise None."""
    reason: BaseException | None = error
    while reason is not None:
        number = _number(reason)
        if number in _REASONS:
            found, remedy = _REASONS[number]
            free = _free(path) if number in _OF_SPACE else ""
            return DiskError(f"{path}: expected {what}, found {found}{free}; {remedy}")
        # Libraries raise errors of their own in its place.
        reason = reason.__cause__ or reason.__context__
    return None


def _number(error: BaseException) -> int | None:
    """Return the system's number of an error, None if it has none."""
    if not isinstance(error, OSError):
        return None
    return errno.ENOSPC if error.errno is None and _CUT.search(str(error)) else error.errno


def _free(path: Path) -> str:
    """Return how much of the disk of a path is free, as text."""
    for folder in (path, *path.absolute().parents):
        try:
            usage = shutil.disk_usage(folder)
        except OSError:
            continue
        return f" ({size_text(usage.free)} of {size_text(usage.total)} free in {folder})"
    return ""


def size_text(size: float) -> str:
    """Return a number of bytes as text, such as 2.5 MB."""
    power = 1 if size < 1e6 else 2 if size < 1e9 else 3
    return f"{size / 1000.0**power:.1f} {('kB', 'MB', 'GB')[power - 1]}"
