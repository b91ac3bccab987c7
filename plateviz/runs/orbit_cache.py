"""OrbitCache: the fitted orbits of runs that were read last, and those expected next."""

import threading
from collections import OrderedDict, deque
from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from weakref import WeakValueDictionary

from plateviz.runs.fitted_orbit import read_fitted_orbit
from solver.data.result import FitResult
from solver.errors import InputError

# Orbits that are kept although no page shows them; a full one takes 50 MB.
_KEPT = 8
# Those of the pages that have asked last are read ahead.
_AHEAD = 4
# Until then the browser draws what it was sent, and needs the cores.
_PAUSE_S = 1.0


class OrbitCache:
    """Fitted orbits by directory; pages that show the same one share it.

    The files of an orbit that is kept are looked at whenever it is asked for, so that one that was
    removed, changed or damaged since is read again. Several threads may ask at once.
    """

    def __init__(
        self, read: Callable[[Path], FitResult] = read_fitted_orbit, pause: float = _PAUSE_S
    ) -> None:
        """Begin without an orbit.

        Parameters
        ----------
        read : reads a fitted orbit from its directory
        pause : seconds before an orbit is read ahead
        """
        self._read_files, self._pause = read, pause
        self._lock = threading.Lock()
        self._is_closed = threading.Event()
        self._shown: WeakValueDictionary[Hashable, FitResult] = WeakValueDictionary()
        self._kept: OrderedDict[Hashable, FitResult] = OrderedDict()
        self._being_read: dict[Hashable, threading.Lock] = {}
        self._expected: deque[Path] = deque(maxlen=_AHEAD)
        self._reader = ThreadPoolExecutor(1, thread_name_prefix="orbit-reader")

    def read(self, directory: Path) -> FitResult:
        """Return a fitted orbit; raises as `read_fitted_orbit`."""
        key = _state(directory)
        if key is None:
            return self._read_files(directory)
        with self._lock:
            being_read = self._being_read.setdefault(key, threading.Lock())
        with being_read:
            try:
                with self._lock:
                    result = self._shown.get(key)
                if result is None:
                    result = self._read_files(directory)
                self._keep(key, result)
            finally:
                with self._lock:
                    self._being_read.pop(key, None)
        return result

    def expect(self, directory: Path) -> None:
        """Read an orbit soon in another thread, because it is likely to be asked for next."""
        with self._lock:
            if self._is_closed.is_set() or directory in self._expected:
                return
            self._expected.append(directory)
            self._reader.submit(self._read_ahead, directory)

    def close(self) -> None:
        """Read no more orbits ahead."""
        with self._lock:
            self._is_closed.set()
        self._reader.shutdown(wait=False, cancel_futures=True)

    def _keep(self, key: Hashable, result: FitResult) -> None:
        with self._lock:
            self._shown[key] = self._kept[key] = result
            self._kept.move_to_end(key)
            while len(self._kept) > _KEPT:
                self._kept.popitem(last=False)

    def _read_ahead(self, directory: Path) -> None:
        with self._lock:
            is_still_expected = directory in self._expected
        if not is_still_expected or self._is_closed.wait(self._pause):
            return
        # What is wrong with it is said when it is asked for.
        with suppress(InputError, OSError):
            # Most figures need this.
            _ = self.read(directory).exposure_index
        with self._lock, suppress(ValueError):
            self._expected.remove(directory)


def _state(directory: Path) -> Hashable | None:
    """Return what tells whether an orbit was changed: its files; None without a directory."""
    try:
        files = [(path.name, path.stat()) for path in sorted(directory.iterdir())]
    except OSError:
        return None
    parts = ((name, one.st_ino, one.st_size, one.st_mtime_ns) for name, one in files)
    return directory, tuple(parts)
