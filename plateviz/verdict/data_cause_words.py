"""What is said of causes in the data: their noise, wrong measurements, and reference stars."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from plateviz.tables.labels import id_strings
from plateviz.tables.rounded import rounded
from plateviz.verdict.cause_case import Case, Said
from plateviz.verdict.prior_words import narrowed_priors, usual_priors
from solver.units import DAYS_PER_JULIAN_YEAR

_MOST_NAMED = 8
# So many options a person would still give.
_MOST_LEFT_OUT = 20
# Few catalogues state errors that are so many times too small, and none so many: something else is
# wrong with them.
DOUBTFUL_FACTOR, WRONG_FACTOR = 5.0, 30.0
# The same of the noise of the measurements.
_DOUBTFUL_NOISE = 3.0
# Excess kurtosis of the residuals within six sigma from which they are a mixture of small errors
# and many large ones.
_MANY_OUTLIERS = 1.0
# A catalogue and the times of exposures differ by decades.
_MOST_DAYS = 100.0 * DAYS_PER_JULIAN_YEAR
_OTHER_ERRORS = "Wrong proper motions, a wrong epoch, smooth errors or wrong units do this"


def said_of_noise(case: Case) -> Said:
    """Return what is said of noise that is the same in all measurements."""
    factor = float(np.sqrt(case.found.test.statistic))
    is_larger = factor > 1.0
    action = f"let the fit estimate the noise, or multiply sx and sy by {factor:.3f}"
    if not 1.0 / _DOUBTFUL_NOISE < factor < _DOUBTFUL_NOISE:
        action = (
            "check the units of sx and sy, and of the measured positions; if they are right, "
            "let the fit estimate the noise"
        )
    tails = next((one for one in case.diagnosis.tests if one.subject == "kurtosis"), None)
    if factor > _DOUBTFUL_NOISE and tails is not None and tails.statistic > _MANY_OUTLIERS:
        return Said(
            "noise",
            "the noise is larger than stated, or many measurements are outliers",
            f"The residuals are {factor:.3f} times the stated uncertainties, in all exposures and "
            f"sources alike, with tails: their excess kurtosis is {tails.statistic:+.3f}, that of "
            "normal noise 0. Where so many are far off, outliers cannot be told from noise.",
            f"{action} of what is left without outliers",
            ("--robust", "--noise-scale"),
        )
    return Said(
        "noise",
        f"the noise is {'larger' if is_larger else 'smaller'} than stated",
        f"It is {factor:.3f} times the stated uncertainties, in all exposures and sources alike.",
        action,
        ("--noise-scale",),
    )


def said_of_noise_of(name: str, words: str, action: str, *options: str) -> Callable[[Case], Said]:
    """Return the function that says that the noise of groups differs."""

    def said(case: Case) -> Said:
        test = case.found.test
        evidence = (
            f"χ² scatters by more than chance: {rounded(test.statistic, 3)}, expected "
            f"{rounded(test.expected, 3)} ± {rounded(test.scatter)}."
        )
        if test.subject == "magnitudes":
            evidence = (
                f"χ² over its expected value changes by {test.statistic:+.3f} per magnitude; "
                f"chance makes ± {rounded(test.scatter)}."
            )
        return Said(name, words, evidence, action, options)

    return said


def said_of_kurtosis(case: Case) -> Said:
    """Return what is said of noise that is not normal."""
    test = case.found.test
    has_more = test.statistic > 0.0
    words = (
        f"The excess kurtosis of the residuals within six sigma is {test.statistic:+.3f}, that of "
        f"normal ones 0 ± {rounded(test.scatter)}, in all exposures and sources alike."
    )
    options: tuple[str, ...] = ()
    if not has_more:
        action = "check whether large errors were removed from the measurements, or others rounded"
    else:
        action = "look at what the centring does to faint, blended or trailed images"
        if case.result.settings.robust:
            words += (
                " The fit has left outliers out; those that are too small to be told from noise "
                "are still there, and make such tails."
            )
            action = f"nothing, if outliers of every size are expected; otherwise {action}"
        elif test.statistic > _MANY_OUTLIERS:
            words += " Many outliers make such tails."
            action = f"let the fit find and leave out outliers; if tails remain, {action}"
            options = ("--robust",)
    return Said(
        "tails",
        f"the noise has {'more' if has_more else 'fewer'} large errors than a normal distribution",
        words,
        action,
        options,
    )


def said_of_outliers(case: Case) -> Said:
    """Return what is said of outliers."""
    return Said(
        "outliers",
        "some measurements are outliers",
        f"{int(case.found.size):,} measurements are beyond six sigma; chance makes "
        f"{rounded(case.found.test.expected, 1)}.",
        "let the fit find and leave them out",
        ("--robust",),
    )


def said_of_swapped(case: Case) -> Said:
    """Return what is said of measurements with each other's identification."""
    ids = id_strings(pd.Series(case.found.items, dtype=np.int64))
    pairs = int(case.found.test.statistic)
    return Said(
        "swapped",
        "measurements have each other's identification",
        f"In {pairs:,} pair{'s' if pairs > 1 else ''}, each is where the other should be; chance "
        f"makes {rounded(case.found.test.expected, 1)}. The sources: "
        f"{', '.join(ids[:_MOST_NAMED])}{', ...' if len(ids) > _MOST_NAMED else ''}.",
        "let the fit find, list and leave them out",
        ("--robust",),
    )


def said_of_references(case: Case) -> Said:
    """Return what is said of reference stars whose errors are larger, or smaller, than stated."""
    settings, test = case.result.settings, case.found.test
    factor = case.found.size * settings.width("sources")
    if factor >= WRONG_FACTOR:
        return said_of_wrong_catalogue(
            f"Its errors would have to be {case.found.size:.1f} times those stated."
        )
    action, option = "let the fit estimate how large the catalogue's errors are", "reference-scale"
    if settings.reference_scale:
        # The errors are in units of the prior's sigmas, which the fit may have widened already.
        action = "widen the prior of the reference stars"
        option = f"prior sources={max(factor, 1.1 * settings.width('sources')):.2f}"
    if "sources" in narrowed_priors(settings):
        # The fit was told so.
        action, option = "take the catalogue's errors as it states them", "prior sources=1"
    is_nearer = test.statistic < test.expected
    words = f"Its errors are about {rounded(factor)} times those stated."
    if factor >= DOUBTFUL_FACTOR:
        words += f" {_OTHER_ERRORS}; check these first."
    if is_nearer:
        words = (
            f"Their rms deviation is {rounded(test.statistic)} of its errors, where "
            f"{rounded(test.expected)} is expected."
        )
    return Said(
        "reference-errors",
        f"the reference stars are {'nearer' if is_nearer else 'further from'} the catalogue than "
        "it states",
        words,
        action,
        (f"--{option}",),
    )


def said_of_wrong_catalogue(evidence: str) -> Said:
    """Return what is said of a catalogue that the reference stars are much too far from."""
    return Said(
        "wrong-catalogue",
        "the reference stars are much further from the catalogue than it states",
        f"{evidence} {_OTHER_ERRORS}.",
        "check the proper motions, the epoch and the units of the catalogue",
    )


def said_of_epoch(case: Case) -> Said:
    """Return what is said of stars that are where they are at another time."""
    days, sigma = case.found.size, case.found.test.scatter
    # Later than the times say is as if these were too early.
    how, instead = ("early", "late") if days > 0.0 else ("late", "early")
    than = "later" if days > 0.0 else "earlier"
    offset = f"{rounded(abs(days), 3)} ± {rounded(sigma)} days"
    if abs(days) > _MOST_DAYS:
        return Said(
            "wrong-epoch",
            "the stars have not moved as their proper motions say",
            "They are off the catalogue along their own proper motions, by so much that the times "
            f"would be {offset} too {how}: the motions seem to have another unit.",
            "check the unit of the proper motions, then the times of the exposures and the epoch "
            "of the catalogue",
        )
    return Said(
        "wrong-epoch",
        f"the stars are measured {rounded(abs(days), 3)} days {than} than the exposures say",
        f"They are off the catalogue along their own proper motions: the times of all exposures "
        f"are {offset} too {how}, or the epoch of the catalogue is as much too {instead}.",
        "check the times of the exposures, their scale and unit, and the epoch of the catalogue",
    )


def said_of_others(case: Case) -> Said:
    """Return what is said of other stars whose catalogue errors are larger than stated."""
    settings = case.result.settings
    action, options = (
        "check the units and epochs of the catalogue, or state larger errors there",
        (),
    )
    if "sources" in narrowed_priors(settings):
        action, options = "take the catalogue's errors as it states them", usual_priors(["sources"])
    factor = case.found.size * settings.width("sources")
    return Said(
        "catalogue-errors",
        "the stars that are no reference stars are further from the catalogue than it states",
        f"Its errors are about {rounded(factor, 3)} times those stated.",
        action,
        options,
    )


def said_of_other(case: Case) -> Said:
    """Return what is said of single other stars that are wrong."""
    ids = id_strings(pd.Series(case.found.items, dtype=np.int64))
    some, are_few = len(ids) > 1, len(ids) <= _MOST_LEFT_OUT
    named = f"{', '.join(ids[:_MOST_NAMED])}{', ...' if len(ids) > _MOST_NAMED else ''}"
    leave = f", or leave {'these stars' if some else 'this star'} out"
    return Said(
        "wrong-positions",
        f"{len(ids):,} star{'s are' if some else ' is'} not where the catalogue has "
        f"{'them' if some else 'it'}",
        f"The measurements have {'each' if some else 'it'} far from there, as with a wrong "
        f"identification or a wrong position: {named}.",
        f"correct the catalogue or the identification{leave if are_few else ''}",
        tuple(f"--exclude source={one}" for one in ids) if are_few else (),
    )


def said_of_reference(case: Case) -> Said:
    """Return what is said of single reference stars that are wrong."""
    ids = id_strings(pd.Series(case.found.items, dtype=np.int64))
    some = len(ids) > 1
    named = ", ".join(ids[:_MOST_NAMED])
    return Said(
        "wrong-references",
        f"{len(ids)} reference star{'s are' if some else ' is'} not where the catalogue has "
        f"{'them' if some else 'it'}",
        f"Without its own catalogue position each is far from it, as binaries are: {named}.",
        f"leave {'these stars' if some else 'this star'} out",
        tuple(f"--exclude source={one}" for one in ids),
    )
