"""Causes in what a fit was told: catalogue positions and priors against the measurements."""

import numpy as np
from scipy.special import chdtri

from solver.results.diagnosis import gains
from solver.results.diagnosis.epoch import epoch_offset
from solver.results.diagnosis.found import Found, limit_of
from solver.results.diagnosis.rate import log_chance, sigmas
from solver.results.diagnosis.references import MEDIAN_CHI2, CatalogueChi2, catalogue_chi2
from solver.results.diagnosis.star_tests import epoch_tests, furthest_test
from solver.results.diagnosis.table import Diagnosis, prior_test
from solver.results.diagnosis.test import Test

_STAR_LIMIT = 0.01
# If the errors of the other stars are so much larger than stated, no single ones are named.
_ALL_ARE_OFF = 3.0
# The tests of all stars of a kind, and of the one that is furthest off.
_REFERENCES, _OTHERS = ("references", "reference"), ("others", "other")
STARS = (*_REFERENCES, *_OTHERS)


def of_epoch(diagnosis: Diagnosis, shift: float = 0.0) -> list[Found]:
    """Return whether the stars are where they were, or will be, at another time.

    Parameters
    ----------
    shift : of the positions by an error of the model, rms along each axis, mas
    """
    tests = [one for one in diagnosis.tests if one.subject == "epoch"]
    if shift:
        tests = epoch_tests(epoch_offset(diagnosis.result.sources, shift))
    is_off = any(one.log_chance < limit_of(diagnosis) for one in tests)
    gain = _gain_of_epoch(diagnosis, shift) if is_off else 0.0
    # A star that was left out of the test may move most, and contradict it.
    return [Found(one, gain, size=one.statistic) for one in tests if gain > 0.0]


def _gain_of_epoch(diagnosis: Diagnosis, shift: float) -> float:
    """Return by how much the reference stars agree better with the catalogue at the other time.

    It takes the errors that the catalogue states, because the fit is bent by as much as these
    allow; and the time found without a shift, which is the same but for the weights of the stars.
    """
    rows = diagnosis.result.sources
    chosen = rows["is_reference"].to_numpy(dtype=bool)
    at_each = (
        catalogue_chi2(one, shift, chosen=chosen).chi2.sum()
        for one in (rows, diagnosis.epoch.moved(rows))
    )
    as_stated, moved = (float(one) / diagnosis.scale for one in at_each)
    return as_stated - moved - gains.PER_PARAMETER


def of_references(diagnosis: Diagnosis) -> list[Found]:
    """Return whether some, or all, of the reference stars are wrong."""
    return _of_kind(diagnosis, diagnosis.references, _REFERENCES)


def of_others(diagnosis: Diagnosis) -> list[Found]:
    """Return whether some, or all, of the other stars are wrong."""
    return _of_kind(diagnosis, diagnosis.others, _OTHERS)


def beyond_shift(diagnosis: Diagnosis, found: Found, shift: float) -> list[Found]:
    """Return what is left of a wrong epoch, or wrong stars, if an error of the model shifts all.

    Parameters
    ----------
    found : the cause without the shift; its subject is "epoch" or one of `STARS`
    shift : of the positions, rms along each axis, mas
    """
    if found.test.subject == "epoch":
        return of_epoch(diagnosis, shift)
    return _anew(diagnosis, _REFERENCES if found.test.subject in _REFERENCES else _OTHERS, shift)


def _of_kind(diagnosis: Diagnosis, stars: CatalogueChi2, kind: tuple[str, str]) -> list[Found]:
    if of_epoch(diagnosis):
        return _anew(diagnosis, kind, 0.0)
    tests = [one for one in diagnosis.tests if one.subject in kind]
    return _of_stars(diagnosis, stars, tests, kind)


def _anew(diagnosis: Diagnosis, kind: tuple[str, str], shift: float) -> list[Found]:
    """Return whether stars are wrong beyond a shift, and beyond an epoch that is wrong."""
    names = {one.subject: one.name for one in diagnosis.tests if one.subject in kind}
    if len(names) < len(kind):
        return []
    rows = diagnosis.result.sources
    chosen = rows["is_reference"].to_numpy(dtype=bool) == (kind is _REFERENCES)
    if of_epoch(diagnosis):
        rows = diagnosis.epoch.moved(rows)
    stars = catalogue_chi2(rows, shift, chosen=chosen)
    chi2, dof = float(stars.chi2.sum()), 2.0 * len(stars.chi2)
    chance = log_chance(chi2, dof)
    numbers = chi2, dof, float(np.sqrt(2.0 * dof)), chance, sigmas(chance)
    of_all = Test(names[kind[0]], kind[0], (), *numbers)
    tests = [of_all, furthest_test(names[kind[1]], kind[1], stars)]
    return _of_stars(diagnosis, stars, tests, kind)


def _of_stars(
    diagnosis: Diagnosis, stars: CatalogueChi2, tests: list[Test], kind: tuple[str, str]
) -> list[Found]:
    chi2 = stars.chi2
    if not len(chi2):
        return []
    of_all, of_one = kind
    worst = min(tests, key=lambda one: one.log_chance)
    if worst.log_chance > limit_of(diagnosis):
        return []
    # Wrong stars pull the frame, and so all others; only those that are far beyond are wrong.
    far = stars.rescaled > chdtri(2.0, -np.expm1(np.log1p(-_STAR_LIMIT) / len(chi2)))
    # Catalogue errors of other stars may be mere bounds: a few that are further are no news then.
    if not far.any() or (of_all == "others" and stars.factor > _ALL_ARE_OFF):
        typical = max(float(np.median(chi2)) / MEDIAN_CHI2 / diagnosis.scale, 1.0)
        gain = gains.of_scale(typical, 2.0 * len(chi2))
        return [Found(worst._replace(subject=of_all), gain, size=stars.factor)]
    order = np.argsort(-chi2[far])
    named = tuple(int(one) for one in stars.source_id[far][order])
    # As that of all other causes, by the scatter of the residuals.
    gain = float(np.sum(chi2[far] / diagnosis.scale - 2.0 * gains.PER_PARAMETER))
    return [Found(worst._replace(subject=of_one), gain, named, float(far.sum()))]


def of_priors(diagnosis: Diagnosis) -> list[Found]:
    """Return the prior that contradicts the values of its parameters, as a cause.

    One that was set for this fit is the first suspect: whatever it keeps the calibration from
    following is left in the residuals, and looks like something else.
    """
    limit = limit_of(diagnosis)
    against = [one for one in diagnosis.priors if one.log_chance < limit]
    if not against:
        return []
    worst = min(against, key=lambda one: (not one.is_set, one.log_chance))
    gain = np.inf if worst.is_set else gains.of_scale(worst.rms**2, 1.0)
    return [Found(prior_test(worst), gain, size=worst.rms)]


def is_beyond_noise(prior: Found, scale: float, limit: float) -> bool:
    """Return whether a prior contradicts its values more than noise larger than stated explains.

    Parameters
    ----------
    scale : chi2 per degree of freedom of the residuals
    limit : logarithm of the chance below which it is named
    """
    return log_chance(prior.size**2 / scale, 1.0) < limit
