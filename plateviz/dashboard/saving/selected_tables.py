"""The selection as tables: of the solution on the screen, or of the run."""

from collections.abc import Callable
from functools import partial

import numpy as np
from astropy.table import Table

from plateviz.dashboard.navigation.navigation import Navigation, View
from plateviz.dashboard.saving.downloads import described, rows_of
from plateviz.runs.run import Run
from plateviz.tables.explore import (
    explorable_exposures,
    explorable_measurements,
    explorable_sources,
)
from solver.data.result import FitResult
from solver.data.schema import CATALOGUE
from solver.data.survey_schema import MOTIONS
from solver.errors import InputError
from solver.io.survey import REFERENCE, read_survey_table

# By which programs find the places of sources, and their names.
_UCDS = {
    "source_id": "meta.id;meta.main",
    "ra": "pos.eq.ra;meta.main",
    "dec": "pos.eq.dec;meta.main",
}


def is_of_orbit(navigation: Navigation) -> bool:
    """Return whether the selection is shown in the solution of an orbit."""
    return navigation.view is View.ORBIT and navigation.session.shown is not None


def selection_name(navigation: Navigation) -> str:
    """Return how the selection is named in files."""
    session = navigation.session
    of = session.shown_part.subject() if is_of_orbit(navigation) else f"run-{navigation.run_name}"
    return f"{of}-selection"


def selected_tables(navigation: Navigation) -> dict[str, Table]:
    """Return what is selected and its measurements, or the motions of sources in the run."""
    shown, run = navigation.session.shown, navigation.run
    selected = navigation.session.selection.selected
    if is_of_orbit(navigation) and shown is not None:
        result = shown.result
        exposures, measurements = explorable_exposures(result), explorable_measurements(result)
        tables = {
            "sources": _of_solution(result, selected.sources),
            "exposures": rows_of(exposures, selected.holds(result.exposures)),
            "measurements": rows_of(measurements, selected.holds(result.residuals)),
        }
        return {name: table for name, table in tables.items() if len(table)}
    return {} if run is None else {"sources": _of_run(run, selected.sources)}


def selected_places(navigation: Navigation) -> Callable[[], Table]:
    """Return the function that makes a table of the selected sources, with their places.

    It takes what is on the screen now, and may be called on a thread.
    """
    shown, run = navigation.session.shown, navigation.run
    selected = navigation.session.selection.sources
    if is_of_orbit(navigation) and shown is not None:
        return lambda: _with_ucds(_of_solution(shown.result, selected))
    if run is None:
        raise InputError("no solution and no run is on the screen")
    return partial(_places_in_run, run, selected)


def _of_solution(result: FitResult, selected: frozenset[int]) -> Table:
    table = explorable_sources(result)
    return rows_of(table, np.isin(table.read("source_id"), list(selected)))


def _of_run(run: Run, selected: frozenset[int]) -> Table:
    rows = run.motions() if run.is_gathered else run.counts()
    return described(rows[rows["source_id"].isin(selected)], MOTIONS)


def _places_in_run(run: Run, selected: frozenset[int]) -> Table:
    """Return the sources of a run with their places in the catalogue, at its epoch."""
    table = _of_run(run, selected)
    catalogue = read_survey_table(run.survey / REFERENCE, CATALOGUE).set_index("source_id")
    rows = catalogue.reindex(np.asarray(table["source_id"])).reset_index()
    places = described(rows, CATALOGUE)
    for number, name in enumerate(("ra", "dec", "ref_epoch"), start=1):
        table.add_column(places[name], index=number)
    return _with_ucds(table)


def _with_ucds(table: Table) -> Table:
    if not len(table):
        raise InputError(
            "none of the selected sources is in the solution on the screen; "
            "if they are left out of its fit, put them back"
        )
    for name, ucd in _UCDS.items():
        table[name].meta["ucd"] = ucd
    return table
