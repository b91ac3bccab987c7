"""PutOff: parts of results that a page does without at first."""

from collections import OrderedDict, deque
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from plateviz.runs.scratch_result import write_scratch_result, write_verdict
from plateviz.verdict.verdict import as_plain, orbit_verdict
from solver.data.result import FitResult
from solver.errors import InputError

# What such work needs is large: of a full orbit, some 40 MB for a verdict, 100 MB for eigenmodes.
_MOST_VERDICTS, _MOST_EIGENMODES = 3, 2

Work = Callable[[], object]


class PutOff:
    """Work of the solver process that waits until no request does.

    A page waits for the verdict, which is done next, the latest first: whoever asks for one
    solution after the other looks at the last one. Few pages show eigenmodes: they are done once
    the process is idle. What waits for long is given up, and done if a page asks for it.
    """

    def __init__(self) -> None:
        """Begin without work."""
        # The latest last.
        self._verdicts: OrderedDict[Path, Work] = OrderedDict()
        self._eigenmodes: deque[Work] = deque()

    def write(self, directory: Path, result: FitResult, *, is_partial: bool) -> None:
        """Write a result, and put its verdict off, for whose tests the figures do not wait.

        Parameters
        ----------
        is_partial : as of `write_scratch_result`, whose errors are raised
        """
        write_scratch_result(directory, result, is_partial=is_partial, is_judged=False)
        self.add_verdict(directory, lambda: judge(directory, result))

    def add_verdict(self, directory: Path, work: Work) -> None:
        """Put the verdict on the result of a directory off."""
        self._verdicts[directory] = work

    def add_eigenmodes(self, work: Work) -> None:
        """Put the eigenmodes of a result off."""
        self._eigenmodes.append(work)

    def limit(self) -> None:
        """Let few results wait: give up the oldest."""
        while len(self._verdicts) > _MOST_VERDICTS:
            self._verdicts.popitem(last=False)
        while len(self._eigenmodes) > _MOST_EIGENMODES:
            self._eigenmodes.popleft()

    def finish_verdict(self, directory: Path) -> None:
        """Do the verdict on the result of a directory, if it waits."""
        if directory in self._verdicts:
            _do(self._verdicts[directory])
            # Work that is interrupted is done when there is time again.
            del self._verdicts[directory]

    def finish_verdicts(self) -> None:
        """Do all verdicts that wait."""
        while self._verdicts:
            self.finish_verdict(next(reversed(self._verdicts)))

    def finish(self) -> None:
        """Do all that waits."""
        self.finish_verdicts()
        while self._eigenmodes:
            _do(self._eigenmodes[0])
            self._eigenmodes.popleft()


def judge(directory: Path, result: FitResult) -> None:
    """Write the verdict on a result; errors as of `write_verdict`."""
    write_verdict(directory, as_plain(orbit_verdict(result)))


def _do(work: Work) -> None:
    # A full disk is said where the solution is used, which does without, or by the next fit.
    with suppress(InputError):
        work()
