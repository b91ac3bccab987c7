"""The verdict on a run as text: whether to trust it, and why."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from plateviz.tables.rounded import rounded
from plateviz.tables.run_diagnosis import RunDiagnosis, RunTests, diagnose_run
from plateviz.tables.run_health import COMPLETE, FAILED, orbit_states, run_strip
from plateviz.verdict.causes import Cause
from plateviz.verdict.run_causes import run_causes
from plateviz.verdict.tests_in_words import TestInWords, discoveries_in_words
from plateviz.verdict.verdict import State, Verdict, worst
from solver.results.diagnosis.table import BAD_RATE, CARE_RATE
from solver.results.diagnosis.test import Test

_MOST_ORBITS = 20
_HEADLINES = {
    "good": "This run can be trusted.",
    "warn": "This run can be used with care.",
    "bad": "This run should not be trusted as it is.",
}


def run_verdict(orbits: pd.DataFrame, motions: pd.DataFrame, tables: RunTests) -> Verdict:
    """Return the verdict on a run, by its tests and by the rules of `run_strip`.

    All tests together alarm in `CARE_RATE` of good runs. The run should not be trusted if the
    alarm is also one of `BAD_RATE`, and a cause spoils much; or if orbits failed. A run with one
    orbit is judged as that is.

    Parameters
    ----------
    orbits : `survey_schema.RUN_ORBITS`
    motions : `survey_schema.MOTIONS`, no rows until the orbits are gathered
    tables : of the tests, no rows until then
    """
    diagnosis = diagnose_run(motions, tables)
    found = diagnosis.found(CARE_RATE)
    causes = run_causes(diagnosis, tables, motions) if found else []
    far = _far_off(orbits)
    strip = (item.state for item in run_strip(orbits, motions))
    by_tests, by_numbers = _state_by_tests(diagnosis, causes), _state_by_numbers(diagnosis, far)
    untested = _untested(tables)
    state = worst([by_tests, by_numbers, *strip])  # type: ignore[list-item]
    state = worst([state, "warn"]) if untested else state
    without = _without_solution(orbits)
    titles = [*_titles(diagnosis, causes, tables), *without, *untested]
    headline = f"{_HEADLINES[state][:-1]}: {titles[0]}." if titles else _HEADLINES[state]
    reasons = [cause.sentence() for cause in causes]
    if len(orbits) and (orbits["status"] == FAILED).all():
        # Nothing is there to be tested.
        reasons += _fitted(orbits)
    else:
        reasons += [*_tested(diagnosis, found, tables), *_fitted(orbits), *_motions(motions)]
        reasons += _smooth_errors(tables.zonal, found, causes)
    faults = [f"{cause.heading()}{cause.strength()}." for cause in causes]
    faults += [f"{words[0].upper()}{words[1:]}." for words in without]
    notable = [*_failed(orbits), *_notable(diagnosis, far)]
    tests = _in_words(diagnosis, found)
    return Verdict(state, headline, reasons, notable, faults, causes, tests)


def _state_by_tests(diagnosis: RunDiagnosis, causes: Sequence[Cause]) -> State:
    """Return the state by the tests of the run, and by that of its only orbit if it has one."""
    state: State = "warn" if diagnosis.found(CARE_RATE) else "good"
    if diagnosis.found(BAD_RATE) and any(cause.is_large for cause in causes):
        state = "bad"
    if len(diagnosis.states) == 1:
        # Nothing is compared with other orbits: the run is as good as its only orbit.
        return worst([state, diagnosis.states.iloc[0]])
    return state


def _far_off(orbits: pd.DataFrame) -> pd.Series:
    """Return the ids of the fitted orbits with a number far from its expected value."""
    states = orbit_states(orbits).drop(columns=["status", "verdict"])
    is_far = (states == "bad").any(axis=1) & (orbits["status"] == COMPLETE)
    return orbits.loc[is_far, "orbit_id"]


def _state_by_numbers(diagnosis: RunDiagnosis, far: pd.Series) -> State:
    """Return the state by the orbits with numbers `far` off that came without a verdict.

    Some numbers of many orbits are far off by chance; the tests of the others know how many.
    """
    return "good" if far.isin(diagnosis.states.index).all() else "bad"


def _titles(diagnosis: RunDiagnosis, causes: Sequence[Cause], tables: RunTests) -> list[str]:
    """Return the title of the first cause, or of that of the only orbit; none if there is none."""
    if causes:
        return [causes[0].title]
    title = str(tables.orbit_causes["title"].iloc[0]) if len(diagnosis.states) == 1 else ""
    return [title] if title else []


def _notable(diagnosis: RunDiagnosis, far: pd.Series) -> list[str]:
    """Return sentences that list the orbits to look at: those `far` off or not simply good."""
    careful = diagnosis.states.index[diagnosis.states == "warn"]
    distrusted = diagnosis.states.index[diagnosis.states == "bad"]
    return [
        f"{words}: {_named(pd.Series(orbits))}."
        for words, orbits in (
            ("Numbers far from their expected values", far),
            ("Solutions to be used with care", careful),
            ("Solutions not to be trusted", distrusted),
        )
        if len(orbits)
    ]


def _untested(tables: RunTests) -> list[str]:
    """Return that a run has no tests, as a clause; nothing if it has."""
    return ["it has not been tested as a whole"] if tables.orbit_causes.empty else []


def _tested(diagnosis: RunDiagnosis, found: Sequence[Test], tables: RunTests) -> list[str]:
    if _untested(tables):
        return [
            "The run has not been tested as a whole: it is not gathered yet, or an older version "
            "made it."
        ]
    if not diagnosis.tests:
        return [
            "A run with one solution has the tests of that orbit alone: they are in its verdict."
        ]
    return [
        discoveries_in_words(diagnosis.tests, found, tests="tests of the run", good="good runs")
    ]


def _in_words(diagnosis: RunDiagnosis, found: Sequence[Test]) -> list[TestInWords]:
    names = {test.name for test in found}
    return [
        TestInWords(
            test.name,
            float(test.statistic),
            float(test.expected),
            float(test.scatter),
            float(test.sigma),
            None,
            test.name in names,
        )
        for test in diagnosis.tests
    ]


def _without_solution(orbits: pd.DataFrame) -> list[str]:
    """Return how many orbits have no solution, as a clause; nothing if all have one."""
    count, total = int((orbits["status"] == FAILED).sum()), len(orbits)
    if not count:
        return []
    of_all = f"{count:,} of {total:,} orbits {'has' if count == 1 else 'have'} no solution"
    return ["no orbit has a solution" if count == total else of_all]


def _failed(orbits: pd.DataFrame) -> list[str]:
    """Return why orbits have no solution, a sentence for each reason, the most frequent first."""
    failed = orbits[orbits["status"] == FAILED]
    pairs = zip(failed["orbit_id"], failed["message"], strict=True)
    reasons = [message.removeprefix(f"orbit {number}: ") for number, message in pairs]
    alike = failed["orbit_id"].groupby(reasons, sort=False)
    found = []
    for reason, numbers in sorted(alike, key=lambda pair: -len(pair[1])):
        who, verb = _named(numbers), "has" if len(numbers) == 1 else "have"
        found.append(f"{who[0].upper()}{who[1:]} {verb} no solution: {reason}")
    return found


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
    if len(orbits) == 1:
        state = "converged" if converged else "did not converge"
        return [
            f"The only orbit has a solution, which {state}; its χ² per degree of freedom is "
            f"{chi2.iloc[0]:.3f}, expected 1."
        ]
    return [
        f"{len(fitted):,} of {len(orbits):,} orbits have a solution; {converged:,} of these "
        "converged.",
        f"χ² per degree of freedom has a median of {chi2.median():.3f} and ranges from "
        f"{chi2.min():.3f} to {chi2.max():.3f} over the orbits; expected 1.",
    ]


def _motions(motions: pd.DataFrame) -> list[str]:
    if motions.empty:
        return ["No motions are fitted yet; this is done after the last orbit."]
    fitted = int(motions["fit_pmra"].notna().sum())
    return [
        f"{fitted:,} of {len(motions):,} sources were measured in enough orbits to fit position, "
        "parallax and proper motion."
    ]


def _smooth_errors(
    zonal: pd.DataFrame, found: Sequence[Test], causes: Sequence[Cause]
) -> list[str]:
    """Return how small smooth errors of the catalogue are seen, unless they are a cause."""
    if zonal.empty or not np.isfinite(zonal["typical"].iloc[0]):
        return [
            "Smooth errors of the catalogue were not looked for: that takes eight orbits, fitted "
            "by this version."
        ]
    is_found = any(test.subject == "zonal" for test in found)
    if is_found and all(cause.name != "zonal-errors" for cause in causes):
        return [
            "The catalogue may have smooth errors as well, of about "
            f"{rounded(zonal['rms'].iloc[0])} "
            "mas along each axis: what is named first can look like them. They can be told from "
            "it once it is mended."
        ]
    return [
        f"Smooth errors of the catalogue would be seen in half of such runs if their rms were "
        f"{rounded(zonal['typical'].iloc[0])} mas along each axis; smaller ones spoil the "
        "positions unseen. No orbit shows a shift, a turn or a change of scale of the whole "
        "catalogue, whatever its size, nor most of a shear: pointing, focal length and detectors "
        "follow it."
    ]
