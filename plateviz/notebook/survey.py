"""OpenSurvey: a survey directory, with its orbits, the runs that fitted them, and its sources."""

from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Self

import pandas as pd
from astropy.table import QTable

from plateviz.notebook.card import card, in_words
from plateviz.notebook.choices import settings_with, takes_choices
from plateviz.notebook.dashboard import Dashboard
from plateviz.notebook.drawing import Drawing, FigureRecipe, Illustrated, drawings
from plateviz.notebook.lazy_solver import HasSolver, LazySolver, run_job
from plateviz.notebook.named import Named, no_such
from plateviz.notebook.orbit import OpenOrbit
from plateviz.notebook.report import write_report
from plateviz.notebook.source import OpenSource
from plateviz.notebook.table import OpenTable
from plateviz.runs.queries import SurveyRun, open_run, survey_runs
from plateviz.runs.run import DEFAULT_RUN
from plateviz.solving.job import Job
from plateviz.solving.origin import SurveyFolder
from plateviz.tables import SummaryItem, run_strip, source_list
from plateviz.tables.verdict import Verdict, run_verdict
from solver.data.columns import Table
from solver.data.schema import CATALOGUE, TRUTH
from solver.data.settings import FitSettings
from solver.data.survey_schema import MOTIONS, RUN_ORBITS
from solver.errors import InputError
from solver.io.survey import REFERENCE, TRUTH_FILE, read_survey_table

if TYPE_CHECKING:
    from plateviz.reports.report import Facts, Report


class OpenSurvey(HasSolver, Illustrated):
    """A survey directory, as one of its runs has it.

    Attributes
    ----------
    directory : the survey's
    run_name : of the run whose orbits, motions and sources are told; None while there is none
    """

    def __init__(self, directory: Path, run: str | None = None) -> None:
        """Open a survey.

        Parameters
        ----------
        run : the first whole run by default, else the first

        Raises
        ------
        InputError
            If the directory is no survey, or it has no such run.
        """
        super().__init__(LazySolver(SurveyFolder(str(directory))))
        self.directory = directory
        self._numbers = self._solver.origin.orbits()
        self.run_name = open_run(directory, run).name if run is not None else self._first()

    @property
    def runs(self) -> list[str]:
        """Names of the runs that there are."""
        return [run.name for run in survey_runs(self.directory)]

    @property
    def orbits(self) -> pd.DataFrame:
        """All orbits, a row each, with how the run fits them where there is one."""
        if self.run_name is not None:
            return self._run().orbits()
        return pd.DataFrame({"orbit_id": self._numbers, "status": "missing"})

    @property
    def sources(self) -> pd.DataFrame:
        """All sources of the run: class, and how often each was measured."""
        return source_list(self._run().counts())

    @property
    def motions(self) -> pd.DataFrame:
        """Fitted motions of all sources, a row each; none until all orbits are fitted."""
        return self._run().motions()

    def table(self, name: str) -> QTable:
        """Return a table with units, as astropy has it.

        Parameters
        ----------
        name : "orbits", "motions", "catalogue" or "truth"

        Raises
        ------
        InputError
            If there is none of that name.
        """
        readers = {
            "orbits": lambda: OpenTable(self._run().orbits(), list(RUN_ORBITS)),
            "motions": lambda: OpenTable(self.motions, list(MOTIONS)),
            "catalogue": lambda: self._read(REFERENCE, CATALOGUE),
            "truth": lambda: self._read(TRUTH_FILE, TRUTH),
        }
        if name not in readers:
            raise InputError(no_such("table", name, readers))
        return readers[name]().to_astropy()

    def orbit(self, number: int) -> OpenOrbit:
        """Return one orbit, with its solution where the run has it.

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

    @takes_choices
    def fit(
        self,
        run: str = DEFAULT_RUN,
        orbits: list[int] | None = None,
        workers: int | None = None,
        **choices: object,
    ) -> Self:
        """Fit every orbit that a run does not hold yet, with a line of progress.

        Parameters
        ----------
        run : name of the run; one that was begun is gone on with
        orbits : those to fit; all by default
        workers : processes; one for each core by default
        choices : as of `OpenOrbit.fit`

        Returns
        -------
        The survey, as the run has it.

        Raises
        ------
        InputError
            If a choice cannot be used, or the run was begun with others.
        """
        settings = settings_with(FitSettings(), choices)
        _check_numbers("orbits", orbits or [], least=0)
        _check_numbers("workers", [] if workers is None else [workers], least=1)
        request = {
            "do": "survey",
            "directory": str(self.directory),
            "run": run,
            "settings": settings.to_dict(),
            "orbits": None if orbits is None else list(orbits),
            "workers": workers,
        }
        run_job(Job(request), f"survey {self.directory.name}, run {run}")
        self.run_name = run
        return self

    @property
    def verdict(self) -> Verdict:
        """Whether to trust the run."""
        return run_verdict(self.orbits, self.motions)

    def dashboard(self, *, port: int = 0, height: int = 900) -> Dashboard:
        """Return the dashboard, which a cell shows in a frame; under `panel serve` it is the page.

        Parameters
        ----------
        port : to serve it on, on this machine alone; 0 takes a free one. Where the browser is on
            another machine, one that is forwarded from there
        height : of the frame, screen pixels
        """
        return Dashboard(self._solver, port, height)

    def report(self, path: str | PathLike[str]) -> Path:
        """Write the run as one HTML file that opens anywhere.

        Raises
        ------
        InputError
            If orbits of the run are missing, or the file cannot be written.
        """
        run = self._run()
        return write_report(self._report, path, self._call(), run.name)

    def __repr__(self) -> str:
        """Return what it is and the verdict."""
        return in_words(*self._titles(), None if self.run_name is None else self.verdict)

    def _repr_html_(self) -> str:
        if self.run_name is None:
            counts = [SummaryItem("Orbits", f"{len(self._numbers):,}", "", "neutral")]
            return card(*self._titles(), None, counts)
        return card(*self._titles(), self.verdict, run_strip(self.orbits, self.motions))

    def _titles(self) -> tuple[str, str]:
        state = "not fitted as a whole" if self.run_name is None else f"run {self.run_name}"
        return f"Survey {self.directory.name}", f"{len(self._numbers):,} orbits, {state}"

    def _call(self) -> str:
        return f"plateviz.open({str(self.directory)!r}, run={self.run_name!r})"

    def _first(self) -> str | None:
        runs = survey_runs(self.directory)
        whole = [run for run in runs if run.is_complete]
        return (whole or runs)[0].name if runs else None

    def _run(self) -> SurveyRun:
        if self.run_name is None:
            raise InputError(f"{self.directory}: expected a run, found none; .fit() makes one")
        return open_run(self.directory, self.run_name)

    def _read(self, name: str, schema: Table) -> OpenTable:
        path = self.directory / name
        if not path.is_file():
            raise InputError(f"{path}: expected a table of the survey, found none")
        frame = read_survey_table(path, schema)
        return OpenTable(frame, [column for column in schema if column.name in frame])

    def _drawings(self, theme: str) -> Named[Drawing]:
        # What draws takes seconds to import.
        from plateviz.plots.gallery import survey_figures
        from plateviz.runs.survey_tables import survey_tables

        tables = survey_tables(self._run())
        figures = [
            FigureRecipe(one.name, one.title, one.caption, partial(one.draw, tables))
            for one in survey_figures()
        ]
        return drawings(figures, theme)

    def _report(self, facts: "Facts") -> "Report":
        from plateviz.reports.survey import survey_report

        return survey_report(self._run(), facts)


def _check_numbers(choice: str, numbers: object, least: int) -> None:
    """Refuse what are no whole numbers, or too small."""
    is_list = isinstance(numbers, list | tuple | range)
    if not is_list or not all(isinstance(n, int) and n >= least for n in numbers):  # type: ignore[union-attr]
        raise InputError(f"{choice}: expected whole numbers from {least}, found {numbers!r}")
