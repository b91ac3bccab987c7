"""The report of one fitted orbit."""

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd

from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.gallery import diagnostics
from plateviz.reports.more_figures import NO_MORE, MoreFigures, more_of_orbit
from plateviz.reports.report import Facts, Report, ReportFigure, plain
from plateviz.tables import (
    calibration_tables,
    exposure_chi2,
    outlier_list,
    summary_strip,
)
from plateviz.tables.headings import CHANGES, in_words
from plateviz.tables.labels import dates
from plateviz.verdict.solution_changes import solution_changes
from plateviz.verdict.verdict import Verdict, orbit_verdict
from solver.data.instrument import Instrument
from solver.data.orbit import OrbitData
from solver.data.plural import plural
from solver.data.result import FitResult
from solver.io.result_instrument import require_comparable
from solver.simulate.settings import SurveySettings

# Number of exposures that a reader can select: those with the chi2 farthest from its expectation.
_FARTHEST = 3


def orbit_report(
    result: FitResult,
    instrument: Instrument,
    facts: Facts,
    other: FitResult | None = None,
    has_choices: bool = True,
    simulation: SurveySettings | None = None,
    more: MoreFigures = NO_MORE,
) -> Report:
    """Return the report of one orbit.

    Parameters
    ----------
    result : the solution
    instrument : that took the orbit
    facts : provenance of the report; settings and inputs are added to it
    other : solution to compare with
    has_choices : whether figures that depend on a selection are also drawn for each detector and
        for single exposures
    simulation : settings with which the orbit was simulated; None where they are not known
    more : figures after those of every report

    Raises
    ------
    InputError
        If one of `more` cannot be drawn, or `other` has another instrument.
    """
    if other is not None:
        require_comparable(result, other)
    date = dates(pd.Series([result.summary["epoch_mjd"]])).iloc[0]
    exposures = _exposures(result.exposures)
    whole = Chosen(result, instrument, exposures, other=other, simulation=simulation)
    tables = calibration_tables(result)
    if other is not None:
        title = "What differs between the other solution (A) and this one (B)"
        tables = {title: in_words(solution_changes(other, result), CHANGES), **tables}
    outliers = outlier_list(result)
    if outliers is not None:
        tables[f"Outliers ({len(outliers):,})"] = outliers
    return Report(
        title=f"Orbit {result.orbit_id}",
        subtitle=f"Plate Analysis of one orbit, mean epoch {date} (TCB)",
        verdict=orbit_verdict(result),
        items=summary_strip(result),
        figures=[
            *(_figure(d, whole, has_choices) for d in diagnostics() if d.has_data(whole)),
            *more_of_orbit(more, whole),
        ],
        tables=tables,
        facts={
            **facts,
            "Settings": plain(result.settings.to_dict()),
            "Instrument": _camera(instrument),
            "Inputs (SHA-256)": dict(result.provenance),
        },
    )


def failed_orbit_report(data: OrbitData, message: str, facts: Facts) -> Report:
    """Return the report of an orbit that has no solution.

    Parameters
    ----------
    data : input data of the orbit
    message : reason of the failure
    """
    rows = data.measurements
    n_rows, n_sources, n_exposures = len(rows), rows["source_id"].nunique(), len(data.exposures)
    counts = rows.groupby(["field_id", "plate_id", "detector_id"]).size().rename("n_obs")
    tables = {"Measurements by exposure and detector": counts.reset_index()}
    contents = [
        f"The orbit has {n_rows:,} {plural(n_rows, 'measurement')} of {n_sources:,} "
        f"{plural(n_sources, 'source')} on {n_exposures:,} {plural(n_exposures, 'exposure')}."
    ]
    headline = "This orbit has no solution."
    return Report(
        title=f"Orbit {data.orbit_id}",
        subtitle="Plate Analysis of one orbit, failed",
        verdict=Verdict("bad", headline, [message], contents),
        items=[],
        figures=[],
        tables=tables,
        facts={**facts, "Inputs (SHA-256)": dict(data.provenance)},
    )


def _camera(instrument: Instrument) -> dict[str, str]:
    """Return what tells an instrument from others."""
    return {
        "name": instrument.name,
        "nominal focal length": f"{instrument.focal_length_um:,.12g} µm",
        "detectors": ", ".join(map(str, instrument.detector_ids)),
    }


def _figure(diagnostic: Diagnostic, whole: Chosen, has_choices: bool) -> ReportFigure:
    has_choices = has_choices and diagnostic.follows_shown
    selections = _selections(whole) if has_choices else {"All": whole}
    return ReportFigure(
        diagnostic.name,
        diagnostic.title,
        diagnostic.caption,
        {label: partial(diagnostic.plot, chosen) for label, chosen in selections.items()},
        diagnostic.is_wide,
    )


def _selections(whole: Chosen) -> dict[str, Chosen]:
    """Return label -> selection of the figures that depend on exposures and detector."""
    chi2 = exposure_chi2(whole.result)
    farthest = chi2.sort_values("z", key=np.abs, ascending=False).head(_FARTHEST)
    detectors = [detector.detector_id for detector in whole.instrument.detectors]
    of_detector = {
        f"All exposures, detector {number}": replace(whole, detector=number) for number in detectors
    }
    of_exposure = {
        f"{row.exposure.capitalize()} (χ²/dof {row.chi2_per_dof:.3f})": replace(
            whole, exposures=((row.field_id, row.plate_id),)
        )
        for row in farthest.itertuples()
    }
    return {"All exposures and detectors": whole, **of_detector, **of_exposure}


def _exposures(table: pd.DataFrame) -> tuple[tuple[int, int], ...]:
    pairs = table[["field_id", "plate_id"]].itertuples(index=False)
    return tuple((int(field), int(plate)) for field, plate in pairs)
