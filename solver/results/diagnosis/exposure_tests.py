"""Tests of the exposures: a pattern that each has of its own, and a pointing that swings."""

import numpy as np
from scipy.special import chdtri

from solver.results.diagnosis.exposures import WAVES, ExposureChi2
from solver.results.diagnosis.rate import log_chance, of_many, sigmas
from solver.results.diagnosis.test import Test

# An exposure stands out if chance makes one like it in so many orbits.
_OWN_CHANCE = np.log(1e-3)
# If more of the exposures swing than this share, it is not the pointing of some.
_MOST_SWINGING = 0.3


def exposure_tests(found: ExposureChi2, swinging: np.ndarray) -> list[Test]:
    """Return the tests of patterns that all exposures may have, each its own.

    Parameters
    ----------
    swinging : indices of the exposures to leave out
    """
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


def swing_test(found: ExposureChi2, field: np.ndarray) -> tuple[Test, np.ndarray]:
    """Return the test of the largest swing of an exposure, and which exposures swing.

    Parameters
    ----------
    field : number of the field of each exposure, shape (exposures,)

    Returns
    -------
    The test, and the indices of the exposures that swing
    """
    dof, n = 4.0 * WAVES, len(found.swing)
    chances = np.array([of_many(log_chance(one, dof), n) for one in found.swing])
    is_own = found.swing * found.scale > _induced(found.swing * found.scale, field)
    swinging = np.flatnonzero((chances < _OWN_CHANCE) & is_own)
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
