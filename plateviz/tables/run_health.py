"""Tables of a run: how each orbit's fit came out, and all of them in a few numbers."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd

from plateviz.tables.headings import ORBITS_OF_RUN
from plateviz.tables.labels import dates
from plateviz.tables.summary import State, SummaryItem, verdict

COMPLETE, FAILED, MISSING = "complete", "failed", "missing"
_OF_STATUS: Mapping[str, State] = MappingProxyType(
    {COMPLETE: "good", FAILED: "bad", MISSING: "warn"}
)


def orbit_list(orbits: pd.DataFrame) -> pd.DataFrame:
    """Return the orbits of a run for people, a row each.

    Parameters
    ----------
    orbits : `survey_schema.RUN_ORBITS`

    Returns
    -------
    `orbit_id`, `date` (of the mean epoch, as text), and the figures that say how the fit is
    """
    return orbits.assign(date=dates(orbits["epoch"]))[list(ORBITS_OF_RUN)]


def orbit_states(orbits: pd.DataFrame) -> pd.DataFrame:
    """Return how each figure of `orbit_list` is, row by row, as the summary strip judges it.

    Returns
    -------
    The rows of `orbits` with the columns that can be judged: "good", "warn", "bad", "neutral"
    """
    columns = {
        "status": orbits["status"].map(_OF_STATUS),
        "chi2_per_dof": _verdicts(orbits["chi2_per_dof"], 1.0, 2.0 / _positive(orbits["dof"])),
        "iterations": np.where(orbits["converged"] == 0, "bad", "neutral"),
    }
    for axis in ("ra", "dec"):
        name = f"normalised_deviation_{axis}"
        expected = orbits[f"expected_{name}"]
        variance = expected**2 / (2.0 * _positive(orbits["n_reference"]))
        columns[name] = _verdicts(orbits[name], expected, variance)
    return pd.DataFrame(columns, index=orbits.index)


def _verdicts(values: pd.Series, expected: pd.Series | float, variance: pd.Series) -> list[State]:
    table = pd.DataFrame({"value": values, "expected": expected, "scatter": np.sqrt(variance)})
    return [verdict(*row) for row in table.itertuples(index=False)]


def _positive(numbers: pd.Series) -> pd.Series:
    return numbers.where(numbers > 0)


def run_strip(orbits: pd.DataFrame, motions: pd.DataFrame) -> list[SummaryItem]:
    """Return the numbers to judge a run by.

    Parameters
    ----------
    orbits : `survey_schema.RUN_ORBITS`
    motions : `survey_schema.MOTIONS`, no rows while nothing has been gathered
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
    whole = n[COMPLETE] == len(orbits)
    return [
        SummaryItem(
            "Orbits complete",
            f"{n[COMPLETE]:,} (of {len(orbits):,})",
            "fitted, and kept in the run",
            "good" if whole else "warn",
        ),
        SummaryItem(
            "Orbits failed",
            f"{n[FAILED]:,}",
            "without a solution; the table says why",
            "bad" if n[FAILED] else "good",
        ),
        SummaryItem(
            "Orbits missing",
            f"{n[MISSING]:,}",
            "not fitted yet; `plateviz survey` goes on with them",
            "warn" if n[MISSING] else "good",
        ),
    ]


def _converged(orbits: pd.DataFrame) -> SummaryItem:
    fitted = orbits[orbits["status"] == COMPLETE]
    n = int((fitted["converged"] == 1).sum())
    hint = "orbits whose last step fell below the tolerance, of those fitted"
    return SummaryItem(
        "Converged", f"{n:,} (of {len(fitted):,})", hint, "good" if n == len(fitted) else "bad"
    )


def _chi2(orbits: pd.DataFrame) -> SummaryItem:
    values = orbits["chi2_per_dof"].dropna()
    label = "χ² per degree of freedom"
    hint = "median over the orbits, lowest and highest; expected 1"
    if values.empty:
        return SummaryItem(label, "–", hint, "neutral")
    words = f"{values.median():.3f} ({values.min():.3f} to {values.max():.3f})"
    return SummaryItem(label, words, hint, "neutral")


def _totals(orbits: pd.DataFrame) -> SummaryItem:
    seconds = orbits["seconds"].sum()
    hint = f"in all orbits fitted; the fits took {seconds:,.0f} s, one after the other"
    return SummaryItem("Measurements", f"{orbits['n_measurements'].sum():,.0f}", hint, "neutral")


def _motions(motions: pd.DataFrame) -> SummaryItem:
    if motions.empty:
        hint = "Motions are fitted when all orbits are there; until then there are none."
        return SummaryItem("Motions fitted", "none yet", hint, "neutral")
    fitted = int(motions["fit_pmra"].notna().sum())
    references = int(motions["is_reference"].sum())
    hint = (
        "sources with a position, parallax and proper motion from all their orbits, of those "
        f"measured in any; {references:,} of them are reference sources"
    )
    return SummaryItem("Motions fitted", f"{fitted:,} (of {len(motions):,})", hint, "neutral")
