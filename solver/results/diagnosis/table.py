"""All tests of one solution, with their chance, in one table."""

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.special import chdtri

from solver.data.result import FitResult
from solver.results.diagnosis.epoch import EpochOffset, epoch_offset
from solver.results.diagnosis.exposures import WAVES, ExposureChi2, exposure_chi2
from solver.results.diagnosis.fitted import source_variances
from solver.results.diagnosis.modelled import is_adjusted
from solver.results.diagnosis.patterns import Family, Patterns
from solver.results.diagnosis.priors import PriorRms, prior_rms
from solver.results.diagnosis.products import products
from solver.results.diagnosis.projection import Projection, covariance_of_products
from solver.results.diagnosis.rate import (
    log_chance,
    of_many,
    sigmas,
)
from solver.results.diagnosis.references import (
    CatalogueChi2,
    catalogue_chi2,
)
from solver.results.diagnosis.rows import Camera, Rows, camera_rows
from solver.results.diagnosis.scatter import scatter_tests
from solver.results.diagnosis.star_tests import epoch_tests, other_star_tests, reference_tests
from solver.results.diagnosis.swapped import Swapped, swapped
from solver.results.diagnosis.test import Test, discovered
from solver.results.diagnosis.without_exposures import without_exposures
from solver.runtime.threads import one_blas_thread

# If all is well, the probability that any test is a discovery: a solution to be used with care,
# and one that is not to be trusted.
CARE_RATE, BAD_RATE = 0.02, 0.002
# An exposure stands out if chance makes one like it in so many orbits.
_OF_EXPOSURES = np.log(1e-3)
# If more of the exposures swing than this share, it is not the pointing of some.
_MOST_SWINGING = 0.3
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


@one_blas_thread()
def diagnose(result: FitResult) -> Diagnosis:
    """Return the tests of a solution."""
    camera, rows = camera_rows(result)
    magnitude = source_magnitudes(result)
    patterns = Patterns(camera, int(result.summary["order"]), magnitude)
    # The covariance takes as long as all else here.
    with ThreadPoolExecutor(1) as thread:
        covariance = thread.submit(covariance_of_products, result, camera, rows, patterns)
        exposures = exposure_chi2(rows)
        swings, swinging = _swings(exposures, camera.field)
        is_reference = result.sources["is_reference"].to_numpy(bool)
        magnitude_of_others = np.where(
            result.sources["is_reference"].to_numpy(bool), np.nan, magnitude
        )
        if len(swinging):
            rows = without_exposures(rows, camera, source_variances(result, camera), swinging)
            exposures = exposures.with_others_of(exposure_chi2(rows), swinging)
        scatter = scatter_tests(rows, magnitude_of_others, without=swinging)
        scale = max(scatter[0].value, 1.0)
        pairs = swapped(result)
        references, others = (
            catalogue_chi2(result.sources[chosen]) for chosen in (is_reference, ~is_reference)
        )
        epoch = epoch_offset(result.sources)
        along, weight = products(patterns, rows), float(rows.weight.sum())
        projection = Projection(along, *covariance.result(), weight)
    priors = prior_rms(result)
    tests = [
        *(Test(one.name, one.name, (), *one[1:5], sigmas(one.log_chance)) for one in scatter),
        _of_pairs(pairs),
        *(pattern_test(projection, family, scale) for family in patterns.families),
        *_of_exposures(exposures, swinging),
        swings,
        *reference_tests(result, references),
        *other_star_tests(others),
        *epoch_tests(epoch),
        *(prior_test(one) for one in sorted(priors, key=lambda one: one.log_chance)[:1]),
    ]
    # A test that the fit itself adjusts counts, but never alarms.
    tests = [
        one._replace(log_chance=0.0, sigma=0.0) if is_adjusted(result, one.subject) else one
        for one in tests
    ]
    return Diagnosis(
        tuple(tests),
        result,
        camera,
        rows,
        patterns,
        projection,
        magnitude_of_others,
        scale,
        exposures,
        swinging,
        references,
        others,
        epoch,
        pairs,
        priors,
    )


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


def _of_exposures(found: ExposureChi2, swinging: np.ndarray) -> list[Test]:
    """Return the tests of patterns that all exposures may have, each its own."""
    tests = []
    for subject, chi2, each in (
        ("stretch", found.stretch, 1),
        ("shear", found.shear, 1),
        ("quadratic", found.quadratic, 6),
    ):
        others = np.delete(chi2, swinging)
        total, dof = float(others.sum()), float(each * len(others))
        chance = log_chance(total, dof)
        name = f"{subject} of each exposure"
        scatter = float(np.sqrt(2.0 * dof))
        tests.append(Test(name, subject, (), total, dof, scatter, chance, sigmas(chance)))
    return tests


def _of_pairs(found: Swapped) -> Test:
    """Return the test of the identifications."""
    count, scatter = float(len(found.rows) // 2), float(np.sqrt(found.expected))
    numbers = count, found.expected, scatter, found.log_chance, sigmas(found.log_chance)
    return Test("measurements in each other's place", "swapped", (), *numbers)


def _swings(found: ExposureChi2, field: np.ndarray) -> tuple[Test, np.ndarray]:
    """Return the test of the largest swing of an exposure, and which exposures swing."""
    dof, n = 4.0 * WAVES, len(found.swing)
    chances = np.array([of_many(log_chance(one, dof), n) for one in found.swing])
    is_own = found.swing * found.scale > _induced(found.swing * found.scale, field)
    swinging = np.flatnonzero((chances < _OF_EXPOSURES) & is_own)
    if len(swinging) > _MOST_SWINGING * n:
        swinging = swinging[:0]
    largest, chance = float(found.swing.max(initial=0.0)), float(chances.min(initial=0.0))
    typical, scatter = float(chdtri(dof, 0.5 / n)), float(np.sqrt(2.0 * dof))
    name = "pointing while an exposure is read"
    return Test(name, "swing", (), largest, typical, scatter, chance, sigmas(chance)), swinging


def _induced(swing: np.ndarray, field: np.ndarray) -> np.ndarray:
    """Return the largest chi2 of a swing that the other exposures may bring about.

    The positions of the sources, each a mean over the exposures of its field, carry it, and what
    all exposures share.
    """
    root, count = np.sqrt(swing), np.bincount(field)
    of_field = (np.bincount(field, root)[field] - root) / count[field]
    of_all = (root.sum() - root) / max(len(root), 1)
    return np.square(np.maximum(of_field, of_all))
