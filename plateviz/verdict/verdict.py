"""The verdict on a solution, a run or a source as text: whether to trust it, and why."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import pandas as pd
from scipy.special import chdtrc

from plateviz.tables.source_profile import source_strip
from plateviz.tables.summary import State, SummaryItem, summary_strip
from plateviz.verdict.catalogue_offset import CatalogueOffset, catalogue_offset
from plateviz.verdict.causes import Cause, causes_in_words, wrong_catalogue
from plateviz.verdict.estimated_noise import noise_sentences
from plateviz.verdict.left_out_together import moved_detectors
from plateviz.verdict.notable_in_orbit import notable_sentences
from plateviz.verdict.tests_in_words import TestInWords, discoveries_in_words, tests_in_words
from plateviz.verdict.unseen import references_left_out, unseen_sentences
from solver.data.result import FitResult, FitStatus
from solver.data.settings import COUNTED
from solver.results.diagnosis.causes import find_causes
from solver.results.diagnosis.table import BAD_RATE, CARE_RATE, Diagnosis, diagnose

# Of the verdict in the summary of a result.
_NAME = "verdict"
# Tail probabilities of a single chi2: three and four sigmas of a normal, one-sided.
_UNLIKELY, _FAR_OFF = 1.35e-3, 3.2e-5
# Causes that the errors of all reference stars are.
_OF_REFERENCES = ("reference-errors", "wrong-catalogue")
_HEADLINES: dict[State, str] = {
    "good": "This solution can be trusted.",
    "warn": "This solution can be used with care.",
    "bad": "This solution should not be trusted as it is.",
}


class Verdict(NamedTuple):
    """The judgement of a solution, a run or a source.

    Attributes
    ----------
    state : "good", "warn" or "bad"
    headline : the judgement in one sentence
    reasons : sentences that give the reasons
    notable : sentences on what stands out; may be empty
    faults : what speaks against the solution of an orbit, in short sentences
    causes : the likely causes of what is wrong with it, the most likely first
    tests : all tests of it
    """

    state: State
    headline: str
    reasons: list[str]
    notable: list[str]
    faults: Sequence[str] = ()
    causes: Sequence[Cause] = ()
    tests: Sequence[TestInWords] = ()


def with_verdict(result: FitResult) -> FitResult:
    """Return a result whose summary has the verdict on it, for the files and the command line."""
    plain = as_plain(_judge(result))
    return replace(result, summary={**result.summary, _NAME: plain})


def as_plain(verdict: Verdict) -> dict[str, object]:
    """Return a verdict as text, numbers, lists and dicts, for JSON."""
    return {
        **verdict._asdict(),
        "causes": [one._asdict() for one in verdict.causes],
        "tests": [one._asdict() for one in verdict.tests],
    }


def is_judged(result: FitResult) -> bool:
    """Return whether there is a verdict on a result, so that `orbit_verdict` takes no time."""
    return _NAME in result.derived or _stored(result) is not None


def orbit_verdict(result: FitResult) -> Verdict:
    """Return the verdict on one fitted orbit: that of the result itself, or a new one, once.

    A new one of a full orbit takes 0.1 to 0.2 s.
    """
    if _NAME not in result.derived:
        stored = _stored(result)
        result.derived[_NAME] = _judge(result) if stored is None else _from_plain(stored)
    return result.derived[_NAME]


def _stored(result: FitResult) -> Mapping[str, Any] | None:
    """Return the verdict that a result was written with; None without the tests, as of old."""
    stored = result.summary.get(_NAME)
    return stored if stored is not None and set(stored) == set(Verdict._fields) else None


def _from_plain(stored: Mapping[str, Any]) -> Verdict:
    causes = [
        Cause(**{**one, "options": tuple(one["options"]), "items": tuple(one.get("items", ()))})
        for one in stored["causes"]
    ]
    tests = [TestInWords(**one) for one in stored["tests"]]
    return Verdict(**{**stored, "causes": causes, "tests": tests})


def _judge(result: FitResult) -> Verdict:
    """Return the verdict on one fitted orbit, by its tests.

    All tests together alarm in `CARE_RATE` of good solutions. The solution should not be trusted
    if the alarm is also one of `BAD_RATE`, and a cause spoils much.
    """
    diagnosis = diagnose(result)
    alarms, converged = diagnosis.found(CARE_RATE), bool(result.summary["converged"])
    causes = []
    if alarms or not converged:
        causes = causes_in_words(result, diagnosis, find_causes(diagnosis))
    offset = catalogue_offset(result) if converged else None
    hidden = _hidden_causes(result, causes, offset)
    left_out = references_left_out(result)
    state = worst([_state_of_residuals(diagnosis, causes, converged), _state_of_hidden(hidden)])
    if left_out:
        state = worst([state, "warn"])
    causes = [*hidden, *causes]
    titles = [*_first(causes), *([left_out.title] if left_out else [])]
    headline = f"{_HEADLINES[state][:-1]}: {titles[0]}." if titles else _HEADLINES[state]
    in_doubt = [left_out.sentences] if left_out else []
    discoveries = discoveries_in_words(diagnosis.tests, alarms)
    are_noticed = any(cause.name in _OF_REFERENCES for cause in causes)
    reasons = [
        _converged(result),
        *(cause.sentence() for cause in causes),
        *in_doubt,
        discoveries,
        *map(_sentence, _judged(summary_strip(result))),
        *_common_error(result),
        *unseen_sentences(result, diagnosis.epoch, are_noticed),
    ]
    faults = [
        *([] if converged else [_converged(result)]),
        *(f"{cause.heading()}{cause.strength()}." for cause in causes),
        *in_doubt,
        *([discoveries] if alarms and not causes else []),
    ]
    notable = [*noise_sentences(result), *notable_sentences(result)]
    if offset and not offset.is_contradiction:
        notable.append(offset.sentences())
    return Verdict(state, headline, reasons, notable, faults, causes, tests_in_words(diagnosis))


def _hidden_causes(
    result: FitResult, causes: Sequence[Cause], offset: CatalogueOffset | None
) -> list[Cause]:
    """Return causes that no residual of the solution shows, without those that are known.

    Parameters
    ----------
    causes : those that residuals show
    """
    is_epoch = any(cause.name == "wrong-epoch" for cause in causes)
    hidden = [] if is_epoch else wrong_catalogue(result)
    if result.summary["converged"]:
        hidden += moved_detectors(result)
    if offset and offset.is_contradiction:
        hidden.append(offset.cause())
    known = {cause.title for cause in causes}
    return [cause for cause in hidden if cause.title not in known]


def _state_of_residuals(diagnosis: Diagnosis, causes: Sequence[Cause], converged: bool) -> State:
    """Return how good a solution is by its tests, and by the causes that they have."""
    is_large = any(cause.is_large for cause in causes if not cause.instead_of)
    if not converged or (is_large and diagnosis.found(BAD_RATE)):
        return "bad"
    return "warn" if diagnosis.found(CARE_RATE) else "good"


def _state_of_hidden(hidden: Sequence[Cause]) -> State:
    return worst("bad" if cause.is_large else "warn" for cause in hidden)


def _first(causes: Sequence[Cause]) -> list[str]:
    """Return the title of the first cause, and of one that is nearly as likely."""
    nearly = [one.title for one in causes[1:2] if one.instead_of]
    return [", or ".join([causes[0].title, *nearly])] if causes else []


def _judged(items: list[SummaryItem]) -> list[SummaryItem]:
    """Return the judged numbers without the first, convergence, which `_converged` describes."""
    return [item for item in items[1:] if item.state != "neutral"]


def source_verdict(history: pd.DataFrame, motion: pd.Series | None) -> Verdict:
    """Return the verdict on the motion of one source.

    Parameters
    ----------
    history : `survey_schema.HISTORY` of the source, at least one row
    motion : its row of `survey_schema.MOTIONS`, or None until the orbits are gathered
    """
    items = source_strip(history, motion)
    reasons = [f"{item.label}: {item.value}. {item.hint}" for item in items[2:]]
    if motion is None or not motion["dof"] > 0:
        return Verdict("warn", "There are too few orbits to judge the motion.", reasons, [])
    above = float(chdtrc(motion["dof"], motion["chi2"]))
    state: State = "bad" if above < _FAR_OFF else "good"
    if state == "good" and min(above, 1.0 - above) < _UNLIKELY:
        state = "warn"
    headline = {
        "good": "The positions scatter about the fitted motion as their noise predicts.",
        "warn": "The scatter of the positions about the fitted motion differs from their noise.",
        "bad": "The positions scatter about the fitted motion by more than their noise explains.",
    }[state]
    return Verdict(state, headline, reasons, [])


def worst(states: Iterable[State]) -> State:
    """Return the worst of some states; "good" if none of them is "bad" or "warn"."""
    found = set(states)
    return "bad" if "bad" in found else "warn" if "warn" in found else "good"


def _converged(result: FitResult) -> str:
    summary = result.summary
    if not summary["converged"]:
        return f"The fit has not converged: {summary['reason']}."
    if summary["reason"] == FitStatus.WHAT_IF.value:
        return f"The solution is {summary['reason']}."
    engine, count = str(summary["engine"]), int(summary["iterations"])
    steps = f"{count:,} {COUNTED[engine]}{'' if count == 1 else 's'}"
    return f"The fit converged after {steps} of the {engine} engine: {summary['reason']}."


def _sentence(item: SummaryItem) -> str:
    return f"{_judgement(item)} {item.hint}"


def _judgement(item: SummaryItem) -> str:
    meaning = {
        "good": "as expected",
        "warn": "significantly different from the expected value, but by little",
        "bad": "far from the expected value",
        "neutral": "not judged",
    }[item.state]
    return f"{item.label}: {item.value}, {meaning}."


def _common_error(result: FitResult) -> list[str]:
    if result.summary["n_reference"] == result.summary["n_sources"]:
        return []
    errors = " and ".join(
        f"{float(result.summary[f'mean_error_{axis}']):.3f} mas in {name}"
        for axis, name in (("ra", "α cos δ"), ("dec", "δ"))
    )
    return [
        f"All sources except reference sources share an error of {errors} (one sigma), which "
        "comes from the reference catalogue and does not decrease with more measurements."
    ]
