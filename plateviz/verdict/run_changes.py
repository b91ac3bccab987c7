"""Table of what differs between two runs of a survey: settings and figures of merit."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.motion_differences import (
    PARAMETER_NAMES,
    Shared,
    motion_differences,
    shared_motions,
)
from plateviz.tables.run_diagnosis import RunTests
from plateviz.tables.run_health import COMPLETE, FAILED, MISSING
from plateviz.tables.sources import REFERENCE
from plateviz.verdict.changes import COLUMNS, Row, merit, setting_changes
from plateviz.verdict.verdict import Verdict
from solver.data.settings import FitSettings
from solver.data.survey_schema import MOTION_PARAMETERS, MOTION_UNITS

_UNITS: Mapping[str, str] = {
    name: unit.replace(" ", "") for name, unit in zip(MOTION_PARAMETERS, MOTION_UNITS, strict=True)
}
_STATES = {
    "good": "Orbits that can be trusted",
    "warn": "Orbits to be used with care",
    "bad": "Orbits not to be trusted",
}
# The headlines name the causes, for which a cell has no room.
_VERDICTS = {"good": "can be trusted", "warn": "with care", "bad": "not to be trusted"}
_DECIMALS = 4


class ComparedRun(NamedTuple):
    """What of a run is compared with another one.

    Attributes
    ----------
    name : of the run
    settings : of all its fits
    orbits : `survey_schema.RUN_ORBITS`
    motions : `survey_schema.MOTIONS`, no rows until the orbits are gathered
    tests : tables from which the run is tested
    verdict : on the run
    """

    name: str
    settings: FitSettings
    orbits: pd.DataFrame
    motions: pd.DataFrame
    tests: RunTests
    verdict: Verdict


def run_changes(a: ComparedRun, b: ComparedRun) -> pd.DataFrame:
    """Return what differs between two runs of a survey, as text.

    Uncertainties, pulls and differences are of the sources that are no reference sources and have
    a fitted motion in both runs: of all sources of each, they would be of different samples.

    Parameters
    ----------
    a : the run taken as reference
    b : the run compared with it

    Returns
    -------
    A row per setting that differs, and per figure of merit: `what`, `a`, `b`, and `change`, which
    is B minus A for numbers and empty for texts
    """
    verdicts = "Verdict", _VERDICTS[a.verdict.state], _VERDICTS[b.verdict.state], ""
    rows = [("Run", a.name, b.name, ""), *setting_changes(a.settings, b.settings), verdicts]
    rows += [*_orbits(a, b), *_sources(a, b)]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _orbits(a: ComparedRun, b: ComparedRun) -> list[Row]:
    both = a.orbits, b.orbits
    fitted = [one[one["status"] == COMPLETE] for one in both]
    rows = [
        _merit("Orbits fitted", map(len, fitted), 0),
        _merit("Orbits that converged", ((one["converged"] == 1).sum() for one in fitted), 0),
    ]
    for status in (FAILED, MISSING):
        found = ((one["status"] == status).sum() for one in both)
        rows.append(_merit(f"Orbits {status}", found, 0))
    states = [one.tests.orbit_causes.drop_duplicates("orbit_id")["state"] for one in (a, b)]
    for state, label in _STATES.items():
        rows.append(_merit(label, ((one == state).sum() for one in states), 0))
    rows.append(_merit("Measurements", (one["n_measurements"].sum() for one in fitted), 0))
    chi2 = (one["chi2_per_dof"].median() for one in fitted)
    rows.append(_merit("χ² per degree of freedom of an orbit, median", chi2))
    return rows


def _sources(a: ComparedRun, b: ComparedRun) -> list[Row]:
    shared = shared_motions(a.motions, b.motions)
    fitted = (one.motions["fit_pmra"].notna().sum() for one in (a, b))
    rows = [
        _merit("Sources", (len(a.motions), len(b.motions)), 0),
        _merit("Sources with a fitted motion", fitted, 0),
        _merit("Of these in one run only", (shared.only_a, shared.only_b), 0),
    ]
    chosen = _without_references(shared)
    if chosen.b.empty:
        return rows
    rows.append(("Compared below: non-reference sources", "", "", f"{len(chosen.b):,}"))
    for name, words in PARAMETER_NAMES.items():
        sigmas = (one[f"sigma_{name}"].median() for one in (chosen.a, chosen.b))
        rows.append(_merit(f"Median σ of {words} ({_UNITS[name]})", sigmas))
    chi2 = (_chi2_per_dof(one) for one in (chosen.a, chosen.b))
    rows.append(_merit("χ² per degree of freedom of their motions", chi2))
    differences = motion_differences(chosen)
    for name, words in PARAMETER_NAMES.items():
        pulls = [_rms(one[f"pull_{name}"]) for one in (chosen.a, chosen.b)]
        if np.isfinite(pulls).any():
            rows.append(_merit(f"Rms pull against truth, {words}", pulls, 3))
    for name, words in PARAMETER_NAMES.items():
        rms = _rms(differences[f"over_sigma_{name}"])
        rows.append((f"Rms difference of {words} / larger σ", "", "", f"{rms:.3f}"))
    for name, words in PARAMETER_NAMES.items():
        # The rms would be that of the few sources that are measured worst.
        typical = float(differences[f"difference_{name}"].abs().median())
        label = f"Median absolute difference of {words} ({_UNITS[name]})"
        rows.append((label, "", "", f"{typical:.{_DECIMALS}f}"))
    return rows


def _without_references(shared: Shared) -> Shared:
    is_other = (shared.b["source_class"] != REFERENCE).to_numpy()
    return shared._replace(
        a=shared.a[is_other].reset_index(drop=True), b=shared.b[is_other].reset_index(drop=True)
    )


def _merit(label: str, values: Iterable[float], decimals: int = _DECIMALS) -> Row:
    of_a, of_b = map(float, values)
    return merit(label, of_a, of_b, decimals)


def _chi2_per_dof(motions: pd.DataFrame) -> float:
    """Return the sum of chi2 over that of the degrees of freedom; NaN if nothing is left over."""
    left = motions[motions["dof"] > 0]
    return float(left["chi2"].sum() / left["dof"].sum()) if len(left) else float("nan")


def _rms(values: pd.Series) -> float:
    # The mean of pandas leaves out what is missing, and of nothing it is NaN.
    return float(np.sqrt((values.astype(float) ** 2).mean()))
