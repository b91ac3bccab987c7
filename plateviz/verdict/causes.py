"""The causes of a solution's flaws in words: what, how certain, what it spoils, what to do."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.labels import exposure_labels, id_strings
from plateviz.tables.rounded import rounded
from plateviz.verdict.cause_case import Case
from plateviz.verdict.cause_harm import harm
from plateviz.verdict.cause_words import said_of
from plateviz.verdict.data_cause_words import DOUBTFUL_FACTOR, WRONG_FACTOR, said_of_wrong_catalogue
from plateviz.verdict.estimated_noise import reference_factor
from plateviz.verdict.prior_words import narrowed_priors, usual_priors
from plateviz.verdict.remedy import remedied
from solver.data.result import FitResult
from solver.results.diagnosis.causes import SCATTER, FoundCauses, wrong_identifications
from solver.results.diagnosis.table import Diagnosis

# Share of chi2 from which the measurements that are far off explain why a fit does not converge.
_WILD_SHARE = 0.5
# Share of their chi2 in reference stars, and of the reference stars that have any of them, from
# which the catalogue may be wrong and not the measurements.
_OF_CATALOGUE, _MANY_REFERENCES = 0.95, 0.5


class Cause(NamedTuple):
    """A likely cause of a flaw.

    Attributes
    ----------
    name : short and unique, for programs
    title : the cause as a clause, without a full stop
    words : the evidence, in sentences
    significance : in sigmas; zero where no test shows it
    spoils : which numbers it spoils, and by how much
    action : what to do
    options : options of `plateviz fit` that do it; empty if there are none
    is_large : whether the solution should not be trusted because of it
    items : what it concerns, if that can be listed: sources, exposures, or pairs of measurements
    instead_of : name of the cause in place of which it explains the tests nearly as well; empty
        for a cause of its own
    """

    name: str
    title: str
    words: str
    significance: float
    spoils: str
    action: str
    options: tuple[str, ...]
    is_large: bool
    items: tuple[str, ...] = ()
    instead_of: str = ""

    def heading(self) -> str:
        """Return the title as the beginning of a sentence."""
        if self.instead_of:
            return f"Or, nearly as likely: {self.title}"
        return self.title[0].upper() + self.title[1:]

    def strength(self) -> str:
        """Return the significance as the end of a sentence without its full stop, or nothing."""
        sigmas = f"{self.significance:.0f}"
        return "" if sigmas == "0" else f", {sigmas} sigma"

    def sentence(self) -> str:
        """Return all of it as text."""
        options = f" ({' '.join(self.options)})" if self.options else ""
        return (
            f"{self.heading()}{self.strength()}. {self.words} {self.spoils} "
            f"What to do: {self.action}{options}."
        )


def causes_in_words(result: FitResult, diagnosis: Diagnosis, causes: FoundCauses) -> list[Cause]:
    """Return the causes of a solution's flaws in words, the most likely first.

    Those that explain the tests nearly as well as the first one follow it.
    """
    if not result.summary["converged"]:
        return [_stuck(result, diagnosis, causes)]
    said = [_in_words(Case(one, causes, diagnosis, result)) for one in causes.found]
    rivals = [_in_words(Case(one, causes, diagnosis, result)) for one in causes.rivals]
    return [*said[:1], *(one._replace(instead_of=said[0].name) for one in rivals), *said[1:]]


def wrong_catalogue(result: FitResult) -> list[Cause]:
    """Return as a cause that the fit had to multiply the catalogue's errors by much.

    With these errors, nothing is left for the tests to find.
    """
    found = reference_factor(result)
    if found is None or found[0] < DOUBTFUL_FACTOR:
        return []
    factor, significance = found
    said = said_of_wrong_catalogue(
        f"The fit has multiplied the catalogue's errors by {factor:.1f} to agree with them."
    )
    spoils = "It spoils what all positions have in common, perhaps by more than they state."
    is_large = factor >= WRONG_FACTOR
    return [
        Cause(said.name, said.title, said.words, significance, spoils, said.action, (), is_large)
    ]


def _stuck(result: FitResult, diagnosis: Diagnosis, causes: FoundCauses) -> Cause:
    """Return what keeps a fit from converging: patterns about a wrong point say nothing."""
    spoils = "It spoils everything: these numbers are those of the last iteration."
    swapped = wrong_identifications(diagnosis)
    if swapped and not result.settings.robust:
        cause = _in_words(Case(swapped[0], causes, diagnosis, result))
        return cause._replace(spoils=spoils, is_large=True)
    looks_like = [_in_words(Case(one, causes, diagnosis, result)) for one in causes.found[:1]]
    rows, noise = diagnosis.rows, diagnosis.tests[0]
    far, total = int(rows.is_far.sum()), rows.n
    explains = rows.chi2[rows.is_far].sum() > _WILD_SHARE * rows.chi2.sum()
    is_wild = explains and not result.settings.robust
    narrow = narrowed_priors(result.settings)
    words = counted = (
        f"{far:,} of {total:,} residuals are more than six times as large as is usual in their "
        f"exposures; χ² per degree of freedom without them is {rounded(noise.statistic, 3)}."
    )
    if is_wild:
        title = "measurements that are far off keep the fit from converging"
        words += (
            " Stars with a wrong identification do this, few as they may be: they bend the fit "
            "towards them, and many good ones away."
        )
        action = "let the fit find, list and leave out the measurements that are far off"
        options = ("--robust",)
        if not narrow and _are_references_far(result, diagnosis):
            title = "the reference stars contradict the measurements, and the fit does not converge"
            words = (
                f"{counted} Nearly all of these are of reference stars, and most of those have "
                "some. A wrong epoch, proper motions or units of the catalogue do this, as do many "
                "measurements that are wrong together."
            )
            action = (
                "check the proper motions, the epoch and the units of the catalogue; if they are "
                f"right, {action}"
            )
    else:
        title = "the fit came to no solution"
        action = "check the start values, and allow more iterations"
        options = ()
        if narrow:
            words += f" Priors that are narrower than usual: {', '.join(narrow)}."
            action, options = "give priors their usual widths", usual_priors(narrow)
        elif looks_like and looks_like[0].options:
            words += f" The residuals so far look as if {looks_like[0].title}."
            action, options = looks_like[0].action, looks_like[0].options
    name = "wild-measurements" if is_wild else "not-converged"
    return Cause(name, title, words, float(noise.sigma), spoils, action, options, True)


def _are_references_far(result: FitResult, diagnosis: Diagnosis) -> bool:
    """Return whether the measurements that are far off are those of most reference stars."""
    rows, is_reference = diagnosis.rows, result.sources["is_reference"].to_numpy(dtype=bool)
    is_one = rows.is_far & is_reference[rows.source]
    count = len(np.unique(rows.source[is_one]))
    return bool(
        rows.chi2[is_one].sum() > _OF_CATALOGUE * rows.chi2[rows.is_far].sum()
        and count > _MANY_REFERENCES * is_reference.sum()
    )


def _in_words(case: Case) -> Cause:
    said = said_of(case)
    spoils, is_large = harm(case)
    words, left = said.words, case.causes.left
    if np.isfinite(case.found.test.size_um) and left and abs(left.value - 1.0) < 0.02:
        words += (
            f" It is not noise: with the patterns named here in the model, χ² per degree of "
            f"freedom would be {left.value:.3f}."
        )
    action, options = said.action, said.options
    if options and remedied(case.result.settings, options) is None:
        action, options = _already(case, options), ()
    sigma = float(case.found.test.sigma)
    return Cause(
        said.name,
        said.title,
        words,
        sigma,
        spoils,
        action,
        options,
        bool(is_large),
        _items(case),
    )


def _already(case: Case, options: tuple[str, ...]) -> str:
    """Return what to do where the fit has the options already that a cause suggests."""
    given = " ".join(options)
    if case.found.test.subject in SCATTER and case.result.summary.get("noise") is None:
        return (
            f"the fit has {given}, but could not estimate the noise with it: leave out the "
            "exposures whose residuals are largest, or mend what else is named here first"
        )
    return f"the fit has {given} already; look at what remains in the residuals"


def _items(case: Case) -> tuple[str, ...]:
    """Return what a cause concerns: all of it, where its words name only the first."""
    found, result = case.found, case.result
    if found.test.subject == "swing":
        return tuple(exposure_labels(result.exposures.iloc[list(found.items)]))
    if found.test.subject != "swapped":
        return tuple(id_strings(pd.Series(found.items, dtype=np.int64)))
    rows = result.residuals.iloc[case.diagnosis.swapped.rows]
    ids, places = list(id_strings(rows["source_id"])), list(exposure_labels(rows))
    detectors = rows["detector_id"].to_numpy()
    return tuple(
        f"{ids[i]} and {ids[i + 1]} in {places[i]}, detector {detectors[i]}"
        for i in range(0, len(rows), 2)
    )
