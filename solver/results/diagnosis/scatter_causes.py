"""Causes that change the size of the residuals, or their tails, but leave no pattern."""

from collections.abc import Iterator

import numpy as np

from solver.results.diagnosis import gains
from solver.results.diagnosis.found import Found, limit_of
from solver.results.diagnosis.rate import sigmas
from solver.results.diagnosis.scatter import Scatter
from solver.results.diagnosis.table import Diagnosis
from solver.results.diagnosis.test import Test

# Tests of the size of the residuals: of groups of these, and of all as a whole.
OF_GROUPS = ("exposures", "sources", "detectors", "magnitudes")
SCATTER = ("noise", *OF_GROUPS)
# Chi2 per degree of freedom below which groups scatter by their priors, not by their noise.
_OVERSTATED = 0.1


def of_scatter(diagnosis: Diagnosis, scatter: list[Scatter]) -> list[Found]:
    """Return the cause that changes the size of the residuals, after what patterns explain.

    The tails of their distribution are a cause of their own.

    Parameters
    ----------
    scatter : the tests after what patterns explain; the first is that of the noise as a whole
    """
    noise = scatter[0]
    found = [_cause(test, one, noise) for test, one in _significant(diagnosis, scatter)]
    tails = [one for one in found if one.test.subject == "kurtosis"]
    of_size = [one for one in found if one.test.subject != "kurtosis"]
    if tails:
        of_size = _beyond_tails(of_size, tails[0], noise)
    if not of_size:
        return tails
    best = max(of_size, key=lambda one: (_is_overstated(one), one.gain))
    # The noise as a whole changes, too.
    test = _with_chance(best.test, min(best.test.log_chance, noise.log_chance))
    return [best._replace(test=test), *tails]


def _significant(diagnosis: Diagnosis, scatter: list[Scatter]) -> Iterator[tuple[Test, Scatter]]:
    """Yield the tests of size and tails that are not by chance, with those before patterns."""
    limit = limit_of(diagnosis)
    tests = {one.subject: one for one in diagnosis.tests}
    for one in scatter:
        test = tests.get(one.name)
        if test is None or one.name not in (*SCATTER, "kurtosis"):
            continue
        # What the fit adjusts itself has no significance.
        if test.sigma != 0.0 and one.log_chance <= limit:
            yield test, one


def _cause(test: Test, now: Scatter, noise: Scatter) -> Found:
    """Return what a test points to.

    Parameters
    ----------
    test : before what patterns explain
    now : the same test after it
    noise : that of the noise as a whole, after it
    """
    test = _with_chance(test._replace(statistic=now.value), now.log_chance)
    if now.name == "noise":
        # By how much the noise is larger than stated.
        excess = float(np.sqrt(now.value) - 1.0)
        return Found(test, gains.of_scale(now.value, now.freedom), size=excess)
    return Found(test, _gain(now, noise))


def _gain(now: Scatter, noise: Scatter) -> float:
    """Return the gain of tails, or of a noise that differs between groups or magnitudes."""
    if now.name == "kurtosis":
        return gains.of_kurtosis(now)
    if now.name == "magnitudes":
        return gains.of_slope(noise, now)
    return gains.of_groups(noise, now)


def _with_chance(test: Test, log_chance: float) -> Test:
    return test._replace(log_chance=log_chance, sigma=sigmas(log_chance))


def _beyond_tails(of_size: list[Found], tails: Found, noise: Scatter) -> list[Found]:
    """Return the noise as a whole, and the groups that scatter by more than noise with tails.

    Noise with tails makes groups scatter: they count with what they gain beyond its size.
    """
    whole = gains.of_scale(noise.value, noise.freedom)
    return [one for one in of_size if one.test.subject == "noise" or one.gain - whole > tails.gain]


def _is_overstated(one: Found) -> bool:
    """Return whether a cause is a noise so much smaller than stated that priors decide the rest."""
    return one.test.subject == "noise" and one.test.statistic < _OVERSTATED
