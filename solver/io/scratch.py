"""Scratch folders: a process removes its own, and those of processes that were killed.

    PREFIX-0123456789ab.part/
        lock                    locked as long as the process that made the folder runs
        ...                     what the process writes

A folder whose lock is free is abandoned.
"""

import os
import re
import secrets
import shutil
import sys
import tempfile
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Self

from solver.errors import DiskError
from solver.io.lock import lock

_LOCK = "lock"
_NAME = re.compile(r"(.+)-[0-9a-f]{12}\.part", re.DOTALL)
# Another process may take a new folder for an abandoned one, before it is locked.
_TRIES = 10


class ScratchFolder:
    """A new folder for this process, removed when it is closed or the interpreter ends.

    Attributes
    ----------
    path : of the folder
    """

    def __init__(self, parent: Path, prefix: str) -> None:
        """Remove abandoned folders with the same prefix, and make a new one.

        Raises
        ------
        OSError
            If the folder cannot be made.
        """
        remove_abandoned(parent, prefix)
        self.path, descriptor = _make(parent, prefix)
        self._remove = weakref.finalize(self, _remove, self.path, descriptor)

    def close(self) -> None:
        """Remove the folder."""
        self._remove()

    def __enter__(self) -> Self:
        """Return the folder; it is removed at the end of the block."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Remove the folder."""
        self.close()


@contextmanager
def scratch_beside(path: Path) -> Iterator[Path]:
    """Yield a path of the same name on the same file system; it is removed after the block.

    What a killed process left of the same path is removed first.
    """
    with ScratchFolder(path.parent, f".{path.name}") as scratch:
        yield scratch.path / path.name


def remove_abandoned(folder: Path, prefix: str | None = None) -> None:
    """Remove the scratch folders in a folder whose processes have ended.

    Parameters
    ----------
    prefix : of the scratch folders to remove; all by default
    """
    try:
        found = [entry for entry in os.scandir(folder) if is_scratch(entry.name, prefix)]
    except OSError:
        return
    for entry in found:
        if entry.is_dir(follow_symlinks=False) and _is_own(entry):
            _remove_if_abandoned(Path(entry.path))


def is_scratch(name: str, prefix: str | None = None) -> bool:
    """Return whether a name is that of a scratch folder, with a prefix if one is given."""
    match = _NAME.fullmatch(name)
    return match is not None and prefix in (None, match[1])


def temporary_folder() -> Path:
    """Return the system's folder for temporary files.

    Raises
    ------
    DiskError
        If there is none that can be written.
    """
    try:
        return Path(tempfile.gettempdir())
    except FileNotFoundError as error:
        raise DiskError(
            "expected a folder for temporary files, found none that can be written; free some "
            "space, or let the environment variable TMPDIR name another folder"
        ) from error


def _make(parent: Path, prefix: str) -> tuple[Path, int]:
    """Return a new folder, and the descriptor of its lock."""
    for _ in range(_TRIES):
        path = parent / f"{prefix}-{secrets.token_hex(6)}.part"
        path.mkdir(mode=0o700)
        try:
            descriptor = os.open(path / _LOCK, os.O_RDWR | os.O_CREAT, 0o600)
        except FileNotFoundError:
            continue
        except OSError:
            shutil.rmtree(path, ignore_errors=True)
            raise
        lock(descriptor, wait=True)
        if sys.platform == "win32" or os.fstat(descriptor).st_nlink:
            return path, descriptor
        os.close(descriptor)
    raise FileNotFoundError(f"{parent}: the new scratch folder was removed {_TRIES} times")


def _remove(path: Path, descriptor: int) -> None:
    os.close(descriptor)
    shutil.rmtree(path, ignore_errors=True)


def _is_own(entry: os.DirEntry[str]) -> bool:
    # A folder for temporary files has folders of other people.
    try:
        return not hasattr(os, "geteuid") or entry.stat().st_uid == os.geteuid()
    except OSError:
        return False


def _remove_if_abandoned(path: Path) -> None:
    if sys.platform == "win32":
        # Windows removes no file that a process has open.
        try:
            (path / _LOCK).unlink(missing_ok=True)
        except OSError:
            return
        shutil.rmtree(path, ignore_errors=True)
        return
    try:
        descriptor = os.open(path / _LOCK, os.O_RDWR | os.O_CREAT, 0o600)
    except OSError:
        return
    try:
        if lock(descriptor):
            shutil.rmtree(path, ignore_errors=True)
    finally:
        os.close(descriptor)
