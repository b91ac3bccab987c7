"""OpenSurvey: a survey directory, with its orbits, the runs that fitted them, and its sources."""

from collections.abc import Collection
from copy import copy
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Self

import pandas as pd
from astropy.table import QTable

from plateviz.notebook.card import card, summary_line
from plateviz.notebook.dashboard import Dashboard
from plateviz.notebook.exploring import Explores
from plateviz.notebook.figures import HasFigures, NotebookFigure, figure_collection
from plateviz.notebook.keywords import check_numbers, settings_with, takes_settings
from plateviz.notebook.lazy_collection import LazyCollection, unknown_name
from plateviz.notebook.lazy_solver import HasSolver, LazySolver, run_job
from plateviz.notebook.orbit import OpenOrbit
from plateviz.notebook.report import write_report
from plateviz.notebook.runs import changes_of, figures_of_both, figures_of_run
from plateviz.notebook.source import OpenSource
from plateviz.notebook.table import OpenTable, input_table
from plateviz.runs.column_cache import ColumnCache
from plateviz.runs.explorable import COLUMNS_OF_RUN, explorable_of_run
from plateviz.runs.run import Run, open_run, survey_runs
from plateviz.runs.run_directory import DEFAULT_RUN
from plateviz.runs.run_tables import read_run_verdict
from plateviz.solving.job import Job
from plateviz.solving.origin import SurveyFolder
from plateviz.tables import SummaryItem, run_strip, source_list
from plateviz.tables.counts import orbits_text
from plateviz.tables.explore import ExplorableTable
from plateviz.verdict.verdict import Verdict
from solver.data.schema import CATALOGUE, TRUTH
from solver.data.settings import FitSettings
from solver.data.survey_schema import MOTIONS, RUN_ORBITS
from solver.errors import InputError
from solver.io.survey import REFERENCE, TRUTH_FILE

if TYPE_CHECKING:
    from plateviz.reports.report import Facts, Report


class OpenSurvey(HasSolver, HasFigures, Explores):
    """A survey directory, with one of its runs.

    Attributes
    ----------
    directory : the survey directory
    run_name : name of the run whose orbits, motions and sources are given; None if there is none
    other_name : name of the run that it is compared with; None for none
    """

    def __init__(self, directory: Path, run: str | None = None) -> None:
        """Open a survey.

        Parameters
        ----------
        run : name of the run; by default the first complete run, or else the first

        Raises
        ------
        InputError
            If the directory is not a survey, or has no such run.
        """
        super().__init__(LazySolver(SurveyFolder(str(directory))))
        self.directory = directory
        self._columns = ColumnCache()
        self._numbers = self._solver.origin.orbits()
        self.run_name = (
            open_run(directory, run).name if run is not None else self._default_run_name()
        )
        self.other_name: str | None = None

    @property
    def runs(self) -> list[str]:
        """Names of the runs of the survey."""
        return [run.name for run in survey_runs(self.directory)]

    @property
    def orbits(self) -> pd.DataFrame:
        """All orbits, a row each, with the fit of the run if there is one."""
        if self.run_name is not None:
            return self._run().orbits()
        return pd.DataFrame({"orbit_id": self._numbers, "status": "missing"})

    @property
    def sources(self) -> pd.DataFrame:
        """All sources of the run: class, and number of measurements."""
        return source_list(self._run().counts())

    @property
    def motions(self) -> pd.DataFrame:
        """Fitted motions of all sources, a row each; empty until all orbits are fitted."""
        return self._run().motions()

    def table(self, name: str) -> QTable:
        """Return an astropy table with units.

        Parameters
        ----------
        name : "orbits", "motions", "catalogue" or "truth"

        Raises
        ------
        InputError
            If there is no table of that name.
        """
        readers = {
            "orbits": lambda: OpenTable(self._run().orbits(), list(RUN_ORBITS)),
            "motions": lambda: OpenTable(self.motions, list(MOTIONS)),
            "catalogue": lambda: input_table(self.directory / REFERENCE, CATALOGUE),
            "truth": lambda: input_table(self.directory / TRUTH_FILE, TRUTH),
        }
        if name not in readers:
            raise InputError(unknown_name("table", name, readers))
        return readers[name]().to_astropy()

    def orbit(self, number: int) -> OpenOrbit:
        """Return one orbit, with its solution if the run has one.

        Raises
        ------
        InputError
            If the survey has no such orbit.
        """
        if number not in self._numbers:
            raise InputError(
                f"{self.directory}: expected an orbit out of {self._numbers[0]} to "
                f"{self._numbers[-1]}, found {number!r}"
            )
        run = None if self.run_name is None else self._run()
        return OpenOrbit(self._solver, int(number), f"{self._call()}.orbit({number})", run)

    def source(self, source_id: int | str) -> OpenSource:
        """Return one source through the orbits of the run.

        Raises
        ------
        InputError
            If the run has no such source, or there is no run.
        """
        return OpenSource(self._run(), source_id, f"{self._call()}.source({source_id})")

    @takes_settings
    def fit(
        self,
        run: str = DEFAULT_RUN,
        orbits: list[int] | None = None,
        workers: int | None = None,
        **settings: object,
    ) -> Self:
        """Fit every orbit that a run does not have yet, with a line of progress.

        Parameters
        ----------
        run : name of the run; an incomplete run resumes
        orbits : orbit_id of the orbits to fit; all by default
        workers : number of worker processes; one per core by default
        settings : as in `OpenOrbit.fit`

        Returns
        -------
        The survey, with this run.

        Raises
        ------
        InputError
            If an argument is invalid, or the run has other settings.
        """
        chosen = settings_with(FitSettings(), settings)
        check_numbers("orbits", orbits or [], least=0)
        check_numbers("workers", [] if workers is None else [workers], least=1)
        request = {
            "do": "survey",
            "directory": str(self.directory),
            "run": run,
            "settings": chosen.to_dict(),
            "orbits": None if orbits is None else list(orbits),
            "workers": workers,
        }
        run_job(Job(request), f"survey {self.directory.name}, run {run}")
        self.run_name = run
        return self

    def compared_with(self, run: str) -> Self:
        """Return the survey with another run (A) to compare its run (B) with.

        Its figures are those of the run, and `motion-differences`.

        Raises
        ------
        InputError
            If the survey has no such run, or it is the run itself.
        """
        other = open_run(self.directory, run).name
        if other == self.run_name:
            raise InputError(f"run: expected another run than {other!r} to compare with")
        found = copy(self)
        found.other_name = other
        return found

    @property
    def changes(self) -> pd.DataFrame:
        """Settings and figures of merit that differ between the two runs; see `compared_with`."""
        return changes_of(self._other(), self._run())

    def figure(self, name: str, *, both: bool = False, theme: str = "light") -> NotebookFigure:
        """Return a figure that displays itself.

        Parameters
        ----------
        name : one of `figures`
        both : whether to draw it of the run compared with (A) and of the run (B)
        theme : "light" or "dark"

        Raises
        ------
        InputError
            If there is no such figure, or no run to compare with.
        """
        if not both:
            return super().figure(name, theme=theme)
        return figure_collection(figures_of_both(self._other(), self._run()), theme)[name]

    @property
    def verdict(self) -> Verdict:
        """Whether to trust the run."""
        return read_run_verdict(self._run())

    def dashboard(self, *, port: int = 0, height: int = 900) -> Dashboard:
        """Return the dashboard, for display in a frame of a cell or as the page of `panel serve`.

        Parameters
        ----------
        port : TCP port to serve on, reachable from this machine only; 0 selects a free port. If
            the browser runs on another machine, use a port that is forwarded from there
        height : height of the frame, screen pixels
        """
        return Dashboard(self._solver, port, height)

    def report(self, path: str | PathLike[str], overwrite: bool = False) -> Path:
        """Write the run as one self-contained HTML file.

        Raises
        ------
        InputError
            If the run is not complete, or the file cannot be written or overwritten.
        """
        run = self._run()
        return write_report(self._report, path, self._call(), overwrite, run.name)

    def __repr__(self) -> str:
        """Return the title and the verdict."""
        return summary_line(*self._titles(), None if self.run_name is None else self.verdict)

    def _repr_html_(self) -> str:
        if self.run_name is None:
            counts = [SummaryItem("Orbits", f"{len(self._numbers):,}", "", "neutral")]
            return card(*self._titles(), None, counts)
        return card(*self._titles(), self.verdict, run_strip(self.orbits, self.motions))

    def _titles(self) -> tuple[str, str]:
        state = "not fitted as a whole" if self.run_name is None else f"run {self.run_name}"
        return f"Survey {self.directory.name}", f"{orbits_text(len(self._numbers))}, {state}"

    def _call(self) -> str:
        return f"plateviz.open({str(self.directory)!r}, run={self.run_name!r})"

    def _default_run_name(self) -> str | None:
        runs = survey_runs(self.directory)
        complete = [run for run in runs if run.is_complete]
        return (complete or runs)[0].name if runs else None

    def _run(self) -> Run:
        if self.run_name is None:
            raise InputError(f"{self.directory}: expected a run, found none; .fit() makes one")
        return open_run(self.directory, self.run_name)

    def _other(self) -> Run:
        if self.other_name is None:
            raise InputError("expected a run to compare with, found none; .compared_with(RUN)")
        return open_run(self.directory, self.other_name)

    def _figures(self, theme: str) -> LazyCollection[NotebookFigure]:
        other = None if self.other_name is None else self._other()
        return figure_collection(figures_of_run(other, self._run()), theme)

    def _explorable_rows(self) -> Collection[str]:
        return COLUMNS_OF_RUN

    def _explorable(self, rows: str) -> ExplorableTable:
        return explorable_of_run(self._run(), rows, self._columns)

    def _report(self, facts: "Facts") -> "Report":
        from plateviz.reports.survey import survey_report

        other = None if self.other_name is None else self._other()
        return survey_report(self._run(), facts, other)
