"""ScratchResults: the results of a server, in its scratch folder.

A result of a full orbit takes 43 MB, and ten people make thousands of them in a day. So what no
page shows is removed once all together take much room, and computed again if a page asks for it.
"""

import shutil
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache, partial
from itertools import islice
from pathlib import Path
from threading import Lock
from weakref import WeakValueDictionary

from plateviz.runs.scratch_result import is_written, read_scratch_result
from solver.data.result import FitResult

MOST_BYTES = 2**31
"""Room of all results but those used last, unless pages show more."""
# Results used last that are never removed: parts of them may still be written, and a page may be
# about to show them. And results that are kept open once they are read.
_LEAST, _MOST_READ = 16, 16


class ScratchResults:
    """Results by directory, in the order in which they were used last."""

    def __init__(self, complete: Callable[[Path, str], bool], most_bytes: int = MOST_BYTES) -> None:
        """Begin without any.

        Parameters
        ----------
        complete : called with a directory and a part of its result that is used and has not been
            written yet; whether it will be
        """
        self._most_bytes = most_bytes
        self._read = lru_cache(_MOST_READ)(
            lambda directory: read_scratch_result(directory, partial(complete, directory))
        )
        self._lock = Lock()
        # Directory -> size in bytes, 0 until it is known.
        self._sizes: OrderedDict[Path, int] = OrderedDict()
        # Those that are used somewhere.
        self._in_use: WeakValueDictionary[Path, FitResult] = WeakValueDictionary()

    def expect(self, directory: Path) -> list[Path]:
        """Take into account that a directory is used, whether or not it is written.

        Returns
        -------
        directories of results that are removed, to make room for it
        """
        with self._lock:
            self._sizes.setdefault(directory, 0)
            self._sizes.move_to_end(directory)
            return self._removed()

    def get(self, directory: Path) -> FitResult | None:
        """Return the result of a directory; None if it is not written, or was removed."""
        with self._lock:
            if not is_written(directory):
                return None
            result = self._read(directory)
            self._in_use[directory] = result
            self._sizes.setdefault(directory, 0)
            self._sizes.move_to_end(directory)
            return result

    def _removed(self) -> list[Path]:
        old = list(islice(self._sizes, max(0, len(self._sizes) - _LEAST)))
        for directory in old:
            if not self._sizes[directory] and is_written(directory):
                self._sizes[directory] = _size(directory)
        total, removed = sum(self._sizes[directory] for directory in old), []
        for directory in old:
            if total <= self._most_bytes:
                break
            if self._sizes[directory] and directory not in self._in_use and _remove(directory):
                total -= self._sizes.pop(directory)
                removed.append(directory)
        return removed


def _size(directory: Path) -> int:
    """Return the bytes of the files of a directory; one may be renamed meanwhile."""
    total = 0
    for file in directory.iterdir():
        with suppress(FileNotFoundError):
            total += file.stat().st_size
    return total


def _remove(directory: Path) -> bool:
    """Remove a directory, of which nobody reads a part; return whether it is gone."""
    gone = directory.with_name(f".{directory.name}-removed")
    with suppress(OSError):
        directory.rename(gone)
        shutil.rmtree(gone, ignore_errors=True)
        return True
    return False
