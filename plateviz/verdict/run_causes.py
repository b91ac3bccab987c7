"""The causes of a run's flaws in words: what, how certain, what it spoils, what to do."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from plateviz.tables.labels import id_strings, unit_text
from plateviz.tables.rounded import rounded
from plateviz.tables.run_diagnosis import RunDiagnosis, RunTests
from plateviz.verdict.causes import Cause
from plateviz.verdict.run_case import RunCase
from plateviz.verdict.zonal_cause import zonal_cause
from solver.results.diagnosis.table import CARE_RATE

# A cause after the first one is named if it has this share of its sigmas: it may be a result of it.
_OF_ITS_OWN = 0.5
# A cause that orbits name counts from this share of them; chance makes some, each another.
_LEAST_SHARE, _LEAST_ORBITS = 0.1, 2
_MOST_NAMED = 8
_OF_CATALOGUE = ("wrong-epoch", "wrong-references", "reference-errors", "wrong-catalogue")
# The cause that one source scatters, which is no reference star: those move all others.
_OF_ONE = "source-scatters"
# χ² per degree of freedom of the motions from which their uncertainties are a fifth too small.
_LARGE_SCATTER = 1.5
# Tests of what orbits find, which say less than the causes that orbits name.
_OF_ORBITS = ("together", "care", "bad", "orbit")


def run_causes(diagnosis: RunDiagnosis, tables: RunTests, motions: pd.DataFrame) -> list[Cause]:
    """Return the causes of what the tests of a run find, the most likely first.

    Parameters
    ----------
    motions : `survey_schema.MOTIONS`, no rows until the orbits are gathered
    tables : of the same run
    """
    causes = [*_of_orbits(diagnosis, tables)]
    is_explained = bool(causes)
    found = diagnosis.found(CARE_RATE)
    most_scatter = any(test.subject == "motions" for test in found)
    for test in found:
        # Where most sources scatter, that which scatters most says nothing more.
        if test.subject == "scatter" and most_scatter:
            continue
        words = _WORDS.get(test.subject)
        # What orbits name themselves is also found in all of them together.
        if words is not None and not (test.subject in _OF_ORBITS and is_explained):
            causes.append(words(RunCase(test, diagnosis, tables, motions)))
    are_spoiled = any(cause.is_large for cause in causes)
    causes.sort(key=lambda cause: (are_spoiled and _is_of_one(cause), -cause.significance))
    return _of_their_own(causes)


def _is_of_one(cause: Cause) -> bool:
    """Whether a cause is one star, which brings about nothing else, however far off it is."""
    return cause.name == _OF_ONE


def _of_their_own(causes: list[Cause]) -> list[Cause]:
    """Return one cause of each name, without those that the first one may have brought about."""
    unique = {cause.name: cause for cause in reversed(causes)}
    ordered = [cause for cause in causes if unique[cause.name] is cause]
    first = next((cause for cause in ordered if not _is_of_one(cause)), None)
    least = _OF_ITS_OWN * first.significance if first else 0.0
    return [cause for cause in ordered if cause.significance >= least]


def _of_orbits(diagnosis: RunDiagnosis, tables: RunTests) -> list[Cause]:
    """Return the causes that more of the orbits name than chance would make."""
    found = {test.subject for test in diagnosis.found(CARE_RATE)}
    named = tables.orbit_causes[tables.orbit_causes["name"] != ""]
    if not found & {"care", "bad", "together"} or named.empty:
        return []
    # An orbit may name a cause several times, as for two detectors: the most certain one counts.
    named = named.sort_values(["orbit_id", "significance"], ascending=[True, False])
    named = named.drop_duplicates(["orbit_id", "name"])
    total = len(diagnosis.states)
    least = max(_LEAST_ORBITS, _LEAST_SHARE * total)
    return [
        _repeated(rows, total, diagnosis)
        for _, rows in named.groupby("name", sort=False)
        if len(rows) >= least
    ]


def _repeated(rows: pd.DataFrame, total: int, diagnosis: RunDiagnosis) -> Cause:
    """Return a cause that many orbits name; sigmas add in squares, but all share the catalogue."""
    worst = rows.loc[rows["significance"].idxmax()]
    combined = max if worst["name"] in _OF_CATALOGUE else sum
    orbits = ", ".join(map(str, rows["orbit_id"].head(_MOST_NAMED)))
    more = " and more" if len(rows) > _MOST_NAMED else ""
    n_bad = int((diagnosis.states.loc[rows["orbit_id"]] == "bad").sum())
    evidence = f"{worst['words']} " if worst.get("words") else ""
    words = (
        f"{len(rows):,} of {total:,} orbits name it ({orbits}{more}), with up to "
        f"{worst['significance']:.0f} sigma; {n_bad:,} of these should not be trusted."
    )
    return Cause(
        str(worst["name"]),
        f"in many orbits, {worst['title']}",
        words,
        float(np.sqrt(combined(np.square(rows["significance"])))),
        f"In orbit {worst['orbit_id']}, where it is most certain: {evidence}{worst['spoils']}",
        str(worst["action"]),
        tuple(str(worst["options"]).splitlines()),
        bool(rows["is_large"].mean() > 0.5),
    )


def _against_time(case: RunCase) -> Cause:
    trend = case.diagnosis.trends[case.test.name]
    kind, group = case.test.subject, case.test.name.partition(" of ")[2]
    unit = unit_text(trend.unit)
    change = f"{rounded(abs(trend.change), 3)} {unit}".rstrip()
    how = {
        "trend": f"It changes by {change} from the first orbit to the last",
        "jump": f"It changes by {change} at orbit {trend.orbit}",
        "season": f"It differs by {change} between position angles",
    }[kind]
    title = {
        "trend": "changes steadily from orbit to orbit",
        "jump": "jumps between two orbits",
        "season": "changes with the season",
    }[kind]
    return Cause(
        f"calibration-{kind}",
        f"the calibration {title}: {group}",
        f"Most significant is {trend.label}. {how}, by more than it scatters.",
        float(case.test.sigma),
        "It spoils no position: each orbit has a calibration of its own. One calibration for all "
        "orbits would be wrong by as much, and the test for smooth errors of the catalogue takes "
        "a trend, but no jump and no season, for the instrument's.",
        "keep a calibration for each orbit, and look for the cause in the instrument",
        (),
        False,
    )


def _together(case: RunCase) -> Cause:
    name = case.test.name.partition(": ")[2]
    return Cause(
        "weak-in-each-orbit",
        f"all orbits together show what none shows alone: {name}",
        f"The chances of this test in all orbits multiply to χ² {case.test.statistic:.0f}, "
        f"expected {case.test.expected:.0f} ± {case.test.scatter:.0f}.",
        float(case.test.sigma),
        "It spoils each orbit by less than its noise, and their mean perhaps by more.",
        "look at this test in the verdicts of the orbits, and model its cause",
        (),
        False,
    )


def _share(case: RunCase) -> Cause:
    test = case.test
    what = "should not be trusted" if test.subject == "bad" else "have flaws"
    return Cause(
        "many-flawed-orbits",
        f"more orbits {what} than chance explains",
        f"{test.statistic:.0f} of {len(case.diagnosis.states):,} orbits, expected "
        f"{test.expected:.1f} ± {test.scatter:.1f}, without a cause that they share.",
        float(test.sigma),
        "It spoils these orbits, and by their weight the means over all.",
        "read the verdicts of these orbits",
        (),
        test.subject == "bad",
    )


def _orbit(case: RunCase) -> Cause:
    (orbit,) = case.test.what
    rows = case.tables.orbit_tests
    worst = rows[rows["orbit_id"] == orbit].nlargest(1, "sigma")["name"].iloc[0]
    return Cause(
        "flawed-orbit",
        f"orbit {orbit} has a flaw",
        f"Its test “{worst}” is the furthest off in the whole run, {case.test.statistic:.1f} "
        f"sigma, expected {case.test.expected:.1f}.",
        float(case.test.sigma),
        "It spoils this orbit, and by its weight the means over all.",
        f"read the verdict of orbit {orbit}, and fit it anew or leave it out",
        (),
        False,
    )


def _scatter(case: RunCase) -> Cause:
    is_reference = "reference" in case.test.name
    name = id_strings(pd.Series(case.test.what, dtype=np.int64)).iloc[0]
    kind = "reference star" if is_reference else "source"
    return Cause(
        f"{kind.split()[0]}-scatters",
        f"{kind} {name} does not move as a single star",
        f"Its positions scatter about its motion by χ² {case.test.statistic:.0f}, expected "
        f"{case.test.expected:.0f}; no other source scatters as much.",
        float(case.test.sigma),
        "It spoils this source's motion"
        + (", and pulls the frames of the orbits." if is_reference else "."),
        "look at its time series; it may be double, or wrongly identified",
        (f"--exclude source={name}",) if is_reference else (),
        False,
    )


def _motions(case: RunCase) -> Cause:
    ratio, states = case.test.statistic, case.diagnosis.states
    bad = states.index[states == "bad"]
    named = ", ".join(map(str, bad[:_MOST_NAMED])) + (" and more" if len(bad) > _MOST_NAMED else "")
    orbits = f"orbit{'' if len(bad) == 1 else 's'} {named}"
    words = f"χ² per degree of freedom of their motions is {ratio:.2f}, expected 1 or less. "
    if len(bad):
        words += (
            f"The solutions of {orbits} should not be trusted, and each is part of all motions."
        )
        action = f"read the verdict of {orbits}; correct what is wrong there, or leave it out"
    else:
        words += (
            "No orbit shows it alone: a time that is wrong in a whole orbit moves its positions."
        )
        action = "compare the times of the orbits with another source, and their origins"
    return Cause(
        "scattered-motions",
        f"most sources scatter about their motions by {rounded(np.sqrt(ratio))} times their noise",
        words,
        float(case.test.sigma),
        f"It spoils all motions, by about {rounded(np.sqrt(ratio))} times the uncertainties "
        "of a good run.",
        action,
        (),
        ratio > _LARGE_SCATTER,
    )


_WORDS: dict[str, Callable[[RunCase], Cause]] = {
    "zonal": zonal_cause,
    "trend": _against_time,
    "jump": _against_time,
    "season": _against_time,
    "together": _together,
    "care": _share,
    "bad": _share,
    "orbit": _orbit,
    "scatter": _scatter,
    "motions": _motions,
}
