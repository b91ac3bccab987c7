"""The verdict in words on a solution, a run or a source: whether to trust it, and why."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.special import chdtrc

from plateviz.tables.labels import id_strings
from plateviz.tables.pulls import exposure_chi2
from plateviz.tables.run_health import COMPLETE, FAILED, orbit_states, run_strip
from plateviz.tables.source_profile import source_strip
from plateviz.tables.summary import State, SummaryItem, summary_strip
from solver.data.result import FitResult

# Among good exposures, or good sources, one so far off would be found in one orbit of a hundred.
_BY_CHANCE = 0.01
# Of a single chi2: three and four sigmas of a normal, one side.
_UNLIKELY, _FAR_OFF = 1.35e-3, 3.2e-5
_MOST_NAMED, _MOST_ORBITS = 3, 20
_HEADLINES: dict[State, str] = {
    "good": "This solution can be trusted.",
    "warn": "This solution can be used with care.",
    "bad": "This solution should not be trusted as it is.",
}


class Verdict(NamedTuple):
    """What to think of a solution.

    Attributes
    ----------
    state : "good", "warn" or "bad"
    headline : in one sentence
    reasons : sentences that say why
    notable : sentences on what stands out; none where nothing does
    """

    state: State
    headline: str
    reasons: list[str]
    notable: list[str]


def orbit_verdict(result: FitResult) -> Verdict:
    """Return the verdict on one fitted orbit, by the same rules as `summary_strip`."""
    items = summary_strip(result)
    state = worst(item.state for item in items)
    reasons = [_converged(result), *map(_judged, _verdicts(items)), _common_error(result)]
    return Verdict(state, _HEADLINES[state], reasons, _notable(result))


def _verdicts(items: list[SummaryItem]) -> list[SummaryItem]:
    """Return the numbers that are judged, but for the convergence, of which the words say more."""
    return [item for item in items[1:] if item.state != "neutral"]


def run_verdict(orbits: pd.DataFrame, motions: pd.DataFrame) -> Verdict:
    """Return the verdict on a run, by the same rules as `run_strip` and `orbit_states`.

    Parameters
    ----------
    orbits : `survey_schema.RUN_ORBITS`
    motions : `survey_schema.MOTIONS`, no rows while nothing has been gathered
    """
    items = run_strip(orbits, motions)
    of_orbits = orbit_states(orbits).drop(columns="status")
    bad = orbits[(of_orbits == "bad").any(axis=1) & (orbits["status"] == COMPLETE)]
    state = worst([*(item.state for item in items), "bad" if len(bad) else "good"])
    headline = {
        "good": "The orbits of this run can be trusted.",
        "warn": "The orbits of this run can be used with care.",
        "bad": "Some orbits of this run should not be trusted as they are.",
    }[state]
    reasons = [*_fitted(orbits), *_motions(motions)]
    failed = orbits[orbits["status"] == FAILED]
    notable = [
        f"Orbit {row.orbit_id} has no solution: {row.message}" for row in failed.itertuples()
    ]
    if len(bad):
        notable.append(f"Numbers far from what is expected: {_named(bad['orbit_id'])}.")
    return Verdict(state, headline, reasons, notable)


def _named(orbits: pd.Series) -> str:
    numbers = ", ".join(map(str, orbits.head(_MOST_ORBITS)))
    if len(orbits) > _MOST_ORBITS:
        return f"{len(orbits):,} orbits, among them {numbers}"
    return f"{'orbit' if len(orbits) == 1 else 'orbits'} {numbers}"


def _fitted(orbits: pd.DataFrame) -> list[str]:
    fitted = orbits[orbits["status"] == COMPLETE]
    if fitted.empty:
        return ["No orbit has a solution."]
    chi2, converged = fitted["chi2_per_dof"], int((fitted["converged"] == 1).sum())
    return [
        f"{len(fitted):,} of {len(orbits):,} orbits have a solution; {converged:,} of these "
        "converged.",
        f"χ² per degree of freedom is {chi2.median():.3f} in the median, {chi2.min():.3f} to "
        f"{chi2.max():.3f} over the orbits; expected 1.",
    ]


def _motions(motions: pd.DataFrame) -> list[str]:
    if motions.empty:
        return ["Motions are fitted when all orbits have a solution; there are none."]
    fitted = int(motions["fit_pmra"].notna().sum())
    return [
        f"{fitted:,} of {len(motions):,} sources were measured often enough for a fit of position, "
        "parallax and proper motion."
    ]


def source_verdict(history: pd.DataFrame, motion: pd.Series | None) -> Verdict:
    """Return what to think of the motion of one source.

    Parameters
    ----------
    history : `survey_schema.HISTORY` of the source, at least one row
    motion : its row of `survey_schema.MOTIONS`, or None while nothing has been gathered
    """
    items = source_strip(history, motion)
    reasons = [f"{item.label}: {item.value}. {item.hint}" for item in items[2:]]
    if motion is None or not motion["dof"] > 0:
        return Verdict("warn", "There are too few orbits to judge the motion by.", reasons, [])
    above = float(chdtrc(motion["dof"], motion["chi2"]))
    state: State = "bad" if above < _FAR_OFF else "good"
    if state == "good" and min(above, 1.0 - above) < _UNLIKELY:
        state = "warn"
    headline = {
        "good": "The positions scatter about the fitted motion as their noise says.",
        "warn": "The positions scatter about the fitted motion by another amount than their noise.",
        "bad": "The positions scatter about the fitted motion by more than their noise explains.",
    }[state]
    return Verdict(state, headline, reasons, [])


def worst(states: Iterable[State]) -> State:
    """Return the worst of some states; "good" where none of them is bad or a warning."""
    found = set(states)
    return "bad" if "bad" in found else "warn" if "warn" in found else "good"


def _converged(result: FitResult) -> str:
    summary = result.summary
    if not summary["converged"]:
        return f"The fit has not converged: {summary['reason']}."
    return (
        f"The fit converged after {summary['iterations']} iterations of the {summary['engine']} "
        f"engine: {summary['reason']}."
    )


def _judged(item: SummaryItem) -> str:
    meaning = {
        "good": "as it should be",
        "warn": "farther from what is expected than chance explains, though by little",
        "bad": "far from what is expected",
        "neutral": "not judged",
    }[item.state]
    return f"{item.label}: {item.value}, {meaning}. {item.hint}"


def _common_error(result: FitResult) -> str:
    errors = " and ".join(
        f"{float(result.summary[f'mean_error_{axis}']):.3f} mas in {name}"
        for axis, name in (("ra", "α cos δ"), ("dec", "δ"))
    )
    return (
        f"All sources but the references share an error of {errors} (one sigma), which comes "
        "from the reference catalogue and does not fall with the number of measurements."
    )


def _notable(result: FitResult) -> list[str]:
    return [
        *_far_exposures(result),
        *_far_sources(result),
        *_outliers(result),
        *_unknown_truth(result),
    ]


def _far_exposures(result: FitResult) -> list[str]:
    table = exposure_chi2(result)
    expected = result.exposures.reset_index(drop=True)
    above = chdtrc(expected["dof"], expected["chi2"])
    far = table[2.0 * np.minimum(above, 1.0 - above) < _BY_CHANCE / max(len(table), 1)]
    far = far.sort_values("z", key=np.abs, ascending=False)
    if far.empty:
        return []
    named = "; ".join(
        f"{row.exposure} (χ²/dof {row.chi2_per_dof:.3f} ± {row.expected_sd:.3f})"
        for row in far.head(_MOST_NAMED).itertuples()
    )
    return [f"Exposures that fit worse or better than chance explains: {len(far):,}. {named}."]


def _far_sources(result: FitResult) -> list[str]:
    sources = result.sources[result.sources["dof"] > 0]
    above = chdtrc(sources["dof"], sources["chi2"])
    far = sources.assign(above=above)[above < _BY_CHANCE / max(len(sources), 1)]
    far = far.sort_values("above")
    if far.empty:
        return []
    worst_ids = id_strings(far["source_id"].head(_MOST_NAMED))
    named = "; ".join(
        f"{name} (χ² {row.chi2:.0f}, expected {row.dof:.0f})"
        for name, row in zip(worst_ids, far.head(_MOST_NAMED).itertuples(), strict=True)
    )
    return [f"Sources that scatter by more than their errors say: {len(far):,}. {named}."]


def _outliers(result: FitResult) -> list[str]:
    if result.outliers is None or result.outliers.empty:
        return []
    return [f"Measurements left out as outliers: {len(result.outliers):,}."]


def _unknown_truth(result: FitResult) -> list[str]:
    if result.true_places is not None:
        return []
    return ["There is no truth to compare with, so figures and numbers that need one are absent."]
