"""All tests of one solution, with their chance, in one table."""

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
import pandas as pd

from solver.data.result import FitResult
from solver.results.diagnosis.epoch import EpochOffset, epoch_offset
from solver.results.diagnosis.exposure_tests import exposure_tests, swing_test
from solver.results.diagnosis.exposures import ExposureChi2, exposure_chi2
from solver.results.diagnosis.fitted import source_variances
from solver.results.diagnosis.modelled import is_adjusted
from solver.results.diagnosis.patterns import Family, Patterns
from solver.results.diagnosis.priors import PriorRms, prior_rms
from solver.results.diagnosis.products import products
from solver.results.diagnosis.projection import Projection, covariance_of_products
from solver.results.diagnosis.rate import (
    log_chance,
    sigmas,
)
from solver.results.diagnosis.read_rows import camera_rows
from solver.results.diagnosis.references import (
    CatalogueChi2,
    catalogue_chi2,
)
from solver.results.diagnosis.rows import Camera, Rows
from solver.results.diagnosis.scatter import Scatter, scatter_tests
from solver.results.diagnosis.star_tests import epoch_tests, other_star_tests, reference_tests
from solver.results.diagnosis.swapped import Swapped, swapped
from solver.results.diagnosis.test import Test, discovered
from solver.results.diagnosis.without_exposures import without_exposures
from solver.runtime.threads import one_blas_thread

# If all is well, the probability that any test is a discovery: a solution to be used with care,
# and one that is not to be trusted.
CARE_RATE, BAD_RATE = 0.02, 0.002
# Of the size of a normal value.
_PRIOR_SCATTER = float(np.sqrt(1.0 - 2.0 / np.pi))


class Diagnosis(NamedTuple):
    """The tests of one solution and what they were computed from.

    Attributes
    ----------
    tests : the table
    result : the solution
    camera, patterns, projection : see there
    rows : as if the exposures that swing were left out; their own residuals are zero
    magnitude : of each source, NaN where unknown, and for reference stars, whose chi2 depends on
        the errors of the catalogue
    scale : chi2 per degree of freedom without outliers and exposures that swing, at least 1
    exposures : chi2 of patterns of each exposure; of those that do not swing, from `rows`
    swinging : indices of the exposures whose pointing changed while they were read
    references, others : chi2 of each reference star, and of each other star
    epoch : how much later the stars are measured than the times of the exposures say
    swapped : measurements with each other's identification
    priors : chi2 of the values of each group of parameters against their prior
    """

    tests: tuple[Test, ...]
    result: FitResult
    camera: Camera
    rows: Rows
    patterns: Patterns
    projection: Projection
    magnitude: np.ndarray
    scale: float
    exposures: ExposureChi2
    swinging: np.ndarray
    references: CatalogueChi2
    others: CatalogueChi2
    epoch: EpochOffset
    swapped: Swapped
    priors: list[PriorRms]

    def found(self, rate: float) -> tuple[Test, ...]:
        """Return the tests that are discoveries at a rate of false alarms over all tests."""
        return discovered(self.tests, rate)

    def frame(self) -> pd.DataFrame:
        """Return the tests as a table, a row each."""
        return pd.DataFrame(self.tests, columns=list(Test._fields))


class _Steady(NamedTuple):
    """A solution as if the exposures that swing were left out.

    Attributes
    ----------
    rows, exposures, swinging : as in `Diagnosis`
    test : of the swing
    """

    rows: Rows
    exposures: ExposureChi2
    swinging: np.ndarray
    test: Test


@one_blas_thread()
def diagnose(result: FitResult) -> Diagnosis:
    """Return the tests of a solution."""
    camera, rows = camera_rows(result)
    magnitude = source_magnitudes(result)
    is_reference = result.sources["is_reference"].to_numpy(bool)
    patterns = Patterns(camera, int(result.summary["order"]), magnitude)
    # The covariance takes as long as all else here.
    with ThreadPoolExecutor(1) as thread:
        covariance = thread.submit(covariance_of_products, result, camera, rows, patterns)
        steady = _steady(result, camera, rows)
        of_others = np.where(is_reference, np.nan, magnitude)
        scatter = scatter_tests(steady.rows, of_others, without=steady.swinging)
        pairs = swapped(result, rows)
        references, others = (
            catalogue_chi2(result.sources, chosen=chosen)
            for chosen in (is_reference, ~is_reference)
        )
        epoch = epoch_offset(result.sources)
        along, weight = products(patterns, steady.rows), float(steady.rows.weight.sum())
        projection = Projection(along, *covariance.result(), weight)
    without_tests = Diagnosis(
        tests=(),
        result=result,
        camera=camera,
        rows=steady.rows,
        patterns=patterns,
        projection=projection,
        magnitude=of_others,
        scale=max(scatter[0].value, 1.0),
        exposures=steady.exposures,
        swinging=steady.swinging,
        references=references,
        others=others,
        epoch=epoch,
        swapped=pairs,
        priors=prior_rms(result),
    )
    tests = _tests(without_tests, scatter, steady.test)
    return without_tests._replace(tests=tuple(_without_alarm(one, result) for one in tests))


def _steady(result: FitResult, camera: Camera, rows: Rows) -> _Steady:
    """Return a solution without the exposures that swing, if any do.

    Parameters
    ----------
    rows : with all exposures
    """
    exposures = exposure_chi2(rows)
    test, swinging = swing_test(exposures, camera.field)
    if not len(swinging):
        return _Steady(rows, exposures, swinging, test)
    rows = without_exposures(rows, camera, source_variances(result, camera), swinging)
    exposures = exposures.with_others_of(exposure_chi2(rows), swinging)
    return _Steady(rows, exposures, swinging, test)


def _tests(found: Diagnosis, scatter: list[Scatter], of_swing: Test) -> list[Test]:
    """Return all tests, in the order of the table.

    Parameters
    ----------
    found : what they are computed from; it has no tests yet
    scatter : tests of the size of the residuals, and of outliers
    of_swing : test of the largest swing of an exposure
    """
    families = found.patterns.families
    worst_prior = sorted(found.priors, key=lambda one: one.log_chance)[:1]
    return [
        *(_scatter_test(one) for one in scatter),
        _of_pairs(found.swapped),
        *(pattern_test(found.projection, family, found.scale) for family in families),
        *exposure_tests(found.exposures, found.swinging),
        of_swing,
        *reference_tests(found.result, found.references),
        *other_star_tests(found.others),
        *epoch_tests(found.epoch),
        *(prior_test(one) for one in worst_prior),
    ]


def _without_alarm(test: Test, result: FitResult) -> Test:
    """Return a test that counts, but never alarms, if the fit itself adjusts what it is about."""
    if is_adjusted(result, test.subject):
        return test._replace(log_chance=0.0, sigma=0.0)
    return test


def _scatter_test(found: Scatter) -> Test:
    """Return the test of the size of the residuals."""
    numbers = found.value, found.expected, found.scatter, found.log_chance
    return Test(found.name, found.name, (), *numbers, sigmas(found.log_chance))


def source_magnitudes(result: FitResult) -> np.ndarray:
    """Return the magnitude of each source, NaN where unknown."""
    if "magnitude" not in result.sources:
        return np.full(len(result.sources), np.nan)
    return result.sources["magnitude"].to_numpy(dtype=float)


def pattern_test(projection: Projection, family: Family, scale: float) -> Test:
    """Return the test of a family of patterns.

    Parameters
    ----------
    scale : chi2 per degree of freedom of the residuals, by which that of the patterns is divided
    """
    found = projection.evidence(family)
    chi2, dof = found.chi2 / scale, float(found.dof)
    chance = log_chance(chi2, dof)
    return Test(
        family.name,
        family.subject,
        family.what,
        chi2,
        dof,
        float(np.sqrt(2.0 * dof)),
        chance,
        sigmas(chance),
        found.size,
    )


def prior_test(found: PriorRms) -> Test:
    """Return the test of a group of parameters against their prior, by the rms of the values.

    It is that of the worst of all groups, and counts as one test.
    """
    name = f"values of {found.group} against their prior"
    numbers = found.rms, 1.0, _PRIOR_SCATTER, found.log_chance, sigmas(found.log_chance)
    return Test(name, "prior", (found.place,), *numbers)


def _of_pairs(found: Swapped) -> Test:
    """Return the test of the identifications."""
    count, scatter = float(len(found.rows) // 2), float(np.sqrt(found.expected))
    numbers = count, found.expected, scatter, found.log_chance, sigmas(found.log_chance)
    return Test("measurements in each other's place", "swapped", (), *numbers)
