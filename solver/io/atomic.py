"""Atomic file writing: a reader sees the old file or the new one, never a partial file."""

import errno
import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from solver.errors import DiskError, InputError
from solver.io.disk import writing
from solver.io.scratch import scratch_beside


@contextmanager
def write_atomically(path: Path, overwrite: bool = True) -> Iterator[Path]:
    """Write to a temporary file that replaces `path` when it is complete.

    Parameters
    ----------
    path : the file to write
    overwrite : whether an existing file is replaced, even one that appears during the block

    Yields
    ------
    Path of an empty file of the same name in a scratch folder beside `path`. When the block
    ends, the file is flushed to disk and renamed to `path`. If the block raises, the file is
    removed and `path` is unchanged; if the process is killed, the next one that writes `path`
    removes it.

    Raises
    ------
    DiskError
        If the disk is full or takes no file for another reason.
    InputError
        Before the block if `path` cannot be written; after it if writing fails, or another
        process has written `path` and it must not be overwritten.
    """
    target = require_writable(path)
    with writing(path), scratch_beside(target) as temporary:
        temporary.touch(exist_ok=False)
        yield temporary
        flush(temporary)
        if overwrite:
            os.replace(temporary, target)
        else:
            _move_to_new(temporary, target)
        flush(target.parent)


def require_writable(path: Path) -> Path:
    """Return `path` with links resolved, after checking that it can be written.

    Raises
    ------
    DiskError
        If the folder is read-only.
    InputError
        If the folder is missing, or `path` exists and is not a file that can be replaced.
    """
    target = Path(os.path.realpath(path))
    folder = target.parent
    if not folder.is_dir():
        raise InputError(f"{path}: expected to write into a folder, found no folder {folder}")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise DiskError(f"{path}: expected a folder that can be written, found {folder} read-only")
    # A device such as /dev/null exists, but must not be replaced.
    if target.exists() and not target.is_file():
        raise InputError(f"{path}: expected a file to write, found something that is not a file")
    if target.exists() and not os.access(target, os.W_OK):
        raise InputError(f"{path}: expected a file that can be replaced, found it read-only")
    return target


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file as 64 hexadecimal digits.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    # A pipe would be waited for.
    if Path(path).exists() and not Path(path).is_file():
        raise InputError(f"{path}: expected a file, found something that is not a file")
    try:
        with Path(path).open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{path}: expected a readable file, found: {error}") from error


def _move_to_new(temporary: Path, target: Path) -> None:
    """Rename a file to a name that nothing has; FileExistsError if something has it."""
    try:
        os.link(temporary, target)
    except FileExistsError:
        raise
    except OSError:
        # A file system without hard links.
        if target.exists():
            raise FileExistsError(errno.EEXIST, "File exists", str(target)) from None
        os.replace(temporary, target)


def flush(path: Path) -> None:
    """Make the system write a file, or the names in a folder, to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
