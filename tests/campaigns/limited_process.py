"""A forked process that does one thing after another, each within limits of time and memory."""

import atexit
import gc
import json
import os
import resource
import select
import signal
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

# So that what one request leaves behind does not pile up.
_MOST_REQUESTS = 250
_STATUS = Path("/proc/self/status")


class Answer(NamedTuple):
    """What became of a request.

    Attributes
    ----------
    value : what the work returned; None if the process ended
    ended : whether it answered or ended in time; if not, it was killed
    seconds : it took
    peak_mb : most memory of the process during the request; zero if it did not answer
    """

    value: Any
    ended: bool
    seconds: float
    peak_mb: float


class LimitedProcess:
    """A child of this process, forked at the first request, and again where it ended.

    Requests and answers are plain values, which are sent as lines of JSON.
    """

    def __init__(
        self, work: Callable[[Mapping[str, Any]], Any], longest_seconds: float, address_space: int
    ) -> None:
        self._work = work
        self._longest = longest_seconds
        self._address_space = address_space
        self._child: int | None = None
        self._requests = self._answers = -1
        self._asked = 0

    def ask(self, request: Mapping[str, Any]) -> Answer:
        if self._child is None:
            self._fork()
        start = time.perf_counter()
        os.write(self._requests, json.dumps(request).encode() + b"\n")
        line = self._line(start + self._longest)
        seconds = time.perf_counter() - start
        self._asked += 1
        if not line or self._asked == _MOST_REQUESTS:
            self._end()
        if not line:
            return Answer(None, line is not None, seconds, 0.0)
        value, peak = json.loads(line)
        return Answer(value, True, seconds, peak)

    def _fork(self) -> None:
        requests, self._requests = os.pipe()
        self._answers, answers = os.pipe()
        self._child = os.fork()
        if self._child == 0:
            os.close(self._requests)
            os.close(self._answers)
            try:
                _limit(self._address_space)
                _serve(self._work, requests, answers)
            finally:
                os._exit(1)
        self._asked = 0
        atexit.register(self._end)
        os.close(requests)
        os.close(answers)

    def _line(self, deadline: float) -> bytes | None:
        """Return the next line of the child, none of it if it ended, or None after the deadline."""
        parts = b""
        while not parts.endswith(b"\n"):
            left = max(deadline - time.perf_counter(), 0.0)
            if not select.select([self._answers], [], [], left)[0]:
                return None
            part = os.read(self._answers, 65536)
            if not part:
                return b""
            parts += part
        return parts

    def _end(self) -> None:
        if self._child is not None:
            os.kill(self._child, signal.SIGKILL)
            os.waitpid(self._child, 0)
            os.close(self._requests)
            os.close(self._answers)
            atexit.unregister(self._end)
        self._child = None


def _limit(address_space: int) -> None:
    silent = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(silent, stream)
    resource.setrlimit(resource.RLIMIT_AS, (address_space, address_space))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _serve(work: Callable[[Mapping[str, Any]], Any], requests: int, answers: int) -> None:
    # Or the garbage collector would copy the memory that is shared with the parent.
    gc.freeze()
    with os.fdopen(requests, encoding="utf-8") as asked:
        for line in asked:
            _forget_peak()
            answer = json.dumps((work(json.loads(line)), _peak_mb())).encode() + b"\n"
            while answer:
                answer = answer[os.write(answers, answer) :]


def _forget_peak() -> None:
    if _STATUS.is_file():
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def _peak_mb() -> float:
    """Return the most memory since `_forget_peak`; of the whole process where Linux is not."""
    if _STATUS.is_file():
        lines = _STATUS.read_text(encoding="utf-8").splitlines()
        return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
