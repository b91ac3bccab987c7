"""RunReader: runs with their verdicts, read and judged elsewhere, once for all pages."""

from collections import OrderedDict
from collections.abc import Hashable
from concurrent.futures import Executor, Future

from plateviz.runs.load_tables import compared_run, survey_tables
from plateviz.runs.run import Run
from plateviz.runs.run_tables import RunTables, read_run_tables
from plateviz.tables.survey_tables import SurveyTables
from plateviz.verdict.run_changes import ComparedRun
from plateviz.verdict.run_verdict import run_verdict
from plateviz.verdict.verdict import Verdict

# Runs that are kept; pages keep what they show.
_MOST = 2


class ReadRun:
    """A run as it was read.

    Attributes
    ----------
    run : that was read
    tables : from which it is judged
    verdict : on it
    compared : what of it is compared with another run
    """

    def __init__(self, run: Run) -> None:
        """Read and judge a run; InputError if it cannot be read."""
        self.run = run
        self.tables: RunTables = read_run_tables(run)
        self.verdict: Verdict = run_verdict(*self.tables)
        self.compared: ComparedRun = compared_run(run, self.tables, self.verdict)
        self._whole: Future[SurveyTables] | None = None

    def whole(self, executor: Executor) -> Future[SurveyTables]:
        """Return the tables of the figures, which `executor` reads when they are first used."""
        if self._whole is None:
            self._whole = executor.submit(survey_tables, self.run, self.tables)
        return self._whole


class RunReader:
    """Reads runs for the pages of a server; called from one thread."""

    def __init__(self, executor: Executor) -> None:
        """Begin without a run.

        Parameters
        ----------
        executor : reads and judges
        """
        self._executor = executor
        self._begun: OrderedDict[tuple[str, str], tuple[Hashable, Future[ReadRun]]] = OrderedDict()

    def read(self, run: Run) -> Future[ReadRun]:
        """Return a run as it is now; read again only if anything was written since.

        Raises
        ------
        InputError
            If the run is gone; if it cannot be read otherwise, the answer raises it.
        """
        key, stamp = (str(run.survey), run.name), run.stamp()
        begun = self._begun.pop(key, None)
        if begun is None or begun[0] != stamp or _has_failed(begun[1]):
            begun = stamp, self._executor.submit(ReadRun, run)
        self._begun[key] = begun
        while len(self._begun) > _MOST:
            self._begun.popitem(last=False)
        return begun[1]


def _has_failed(answer: Future[ReadRun]) -> bool:
    return answer.done() and (answer.cancelled() or answer.exception() is not None)
