"""Tables of a run: the quality of each orbit's fit, and summary numbers of all orbits."""

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd

from plateviz.tables.headings import ORBITS_OF_RUN
from plateviz.tables.labels import dates
from plateviz.tables.summary import State, SummaryItem, deviation_state, rule, state_of

COMPLETE, FAILED, MISSING = "complete", "failed", "missing"
_OF_STATUS: Mapping[str, State] = MappingProxyType(
    {COMPLETE: "good", FAILED: "bad", MISSING: "warn"}
)
# Variance of a median over that of a mean, of normal numbers.
_OF_MEDIAN = math.pi / 2.0
_VERDICTS = {"good": "trusted", "warn": "with care", "bad": "not trusted"}


def orbit_list(orbits: pd.DataFrame) -> pd.DataFrame:
    """Return the orbits of a run for display, a row each.

    Parameters
    ----------
    orbits : `survey_schema.RUN_ORBITS`

    Returns
    -------
    `orbit_id`, `date` (of the mean epoch, as text), `verdict` in words, and the numbers that
    describe the fit
    """
    verdict = orbits["state"].map(_VERDICTS).fillna("")
    return orbits.assign(date=dates(orbits["epoch"]), verdict=verdict)[list(ORBITS_OF_RUN)]


def orbit_states(orbits: pd.DataFrame) -> pd.DataFrame:
    """Return the state of each number of `orbit_list`, by the rules of the summary strip.

    Returns
    -------
    The rows of `orbits` with the columns that can be judged: "good", "warn", "bad", "neutral"
    """
    columns = {
        "status": orbits["status"].map(_OF_STATUS),
        "verdict": orbits["state"].where(orbits["state"] != "", "neutral"),
        "chi2_per_dof": _verdicts(orbits["chi2_per_dof"], 1.0, 2.0 / _positive(orbits["dof"])),
        "iterations": np.where(orbits["converged"] == 0, "bad", "neutral"),
    }
    for axis in ("ra", "dec"):
        name = f"normalised_deviation_{axis}"
        # Results of older versions lack it.
        dof = orbits[f"normalised_deviation_dof_{axis}"].fillna(orbits["n_reference"])
        numbers = zip(orbits[name], orbits[f"expected_{name}"], dof, strict=True)
        columns[name] = [deviation_state(*row) for row in numbers]
    return pd.DataFrame(columns, index=orbits.index)


def _verdicts(values: pd.Series, expected: pd.Series | float, variance: pd.Series) -> list[State]:
    table = pd.DataFrame({"value": values, "expected": expected, "scatter": np.sqrt(variance)})
    return [state_of(*row) for row in table.itertuples(index=False)]


def _positive(numbers: pd.Series) -> pd.Series:
    return numbers.where(numbers > 0)


def run_strip(orbits: pd.DataFrame, motions: pd.DataFrame) -> list[SummaryItem]:
    """Return the numbers by which a run is judged.

    Parameters
    ----------
    orbits : `survey_schema.RUN_ORBITS`
    motions : `survey_schema.MOTIONS`, no rows until the orbits are gathered
    """
    return [
        *_counts(orbits),
        _converged(orbits),
        _chi2(orbits),
        _totals(orbits),
        _motions(motions),
    ]


def _counts(orbits: pd.DataFrame) -> list[SummaryItem]:
    n = {status: int((orbits["status"] == status).sum()) for status in (COMPLETE, FAILED, MISSING)}
    all_complete = n[COMPLETE] == len(orbits)
    return [
        SummaryItem(
            "Orbits complete",
            f"{n[COMPLETE]:,} (of {len(orbits):,})",
            "fitted and stored in the run",
            "good" if all_complete else "warn",
        ),
        SummaryItem(
            "Orbits failed",
            f"{n[FAILED]:,}",
            "without a solution; the table gives the reason",
            "bad" if n[FAILED] else "good",
        ),
        SummaryItem(
            "Orbits missing",
            f"{n[MISSING]:,}",
            "not fitted yet; `plateviz survey` continues with them",
            "warn" if n[MISSING] else "good",
        ),
    ]


def _converged(orbits: pd.DataFrame) -> SummaryItem:
    fitted = orbits[orbits["status"] == COMPLETE]
    n = int((fitted["converged"] == 1).sum())
    hint = "fitted orbits whose last step fell below the tolerance"
    return SummaryItem(
        "Converged", f"{n:,} (of {len(fitted):,})", hint, "good" if n == len(fitted) else "bad"
    )


def _chi2(orbits: pd.DataFrame) -> SummaryItem:
    fitted = orbits[orbits["chi2_per_dof"].notna()]
    values, label = fitted["chi2_per_dof"], "χ² per degree of freedom"
    hint = "median over the orbits, lowest and highest"
    if values.empty:
        return SummaryItem(label, "–", f"{hint}; expected 1", "neutral")
    value = f"{values.median():.3f} ({values.min():.3f} to {values.max():.3f})"
    of_one = math.sqrt((2.0 / _positive(fitted["dof"])).median())
    scatter = of_one * math.sqrt(_OF_MEDIAN / len(values))
    return SummaryItem(
        label,
        value,
        f"{hint}. {rule(1.0, scatter, 'of the median, for normal noise')}",
        state_of(float(values.median()), 1.0, scatter),
    )


def _totals(orbits: pd.DataFrame) -> SummaryItem:
    seconds = orbits["seconds"].sum()
    hint = f"in all fitted orbits; the fits took {seconds:,.0f} s in total"
    return SummaryItem("Measurements", f"{orbits['n_measurements'].sum():,.0f}", hint, "neutral")


def _motions(motions: pd.DataFrame) -> SummaryItem:
    if motions.empty:
        hint = "Motions are fitted after the last orbit."
        return SummaryItem("Motions fitted", "none yet", hint, "neutral")
    fitted = int(motions["fit_pmra"].notna().sum())
    references = int(motions["is_reference"].sum())
    hint = (
        "measured sources with a position, parallax and proper motion fitted to all their orbits; "
        f"{references:,} of the measured sources are reference sources"
    )
    return SummaryItem("Motions fitted", f"{fitted:,} (of {len(motions):,})", hint, "neutral")
