"""Second-order term of the posterior along prior-dominated directions.

The data do not constrain common displacements of pointings and detectors by up to a tenth of a
millimetre. Over such a distance the conditional mode of the other parameters is not a linear
function: it departs from the linearised problem by many times its own uncertainty. A
second-order term describes it, and a sampler that uses it takes steps a hundred times as long.
"""

from itertools import combinations_with_replacement

import numpy as np
from jaxtyping import Float

from solver.engines.gauss_newton import Mode, downhill
from solver.linear.chi2 import gradient
from solver.linear.source_elimination import ReducedSystem
from solver.linear.whitening import Curvature
from solver.problem.problem import Problem

# Steps with the Jacobians of the mode; each leaves about a hundredth of the remaining distance.
_RELAXATION_STEPS = 4

_Point = tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]


def curvature_at(problem: Problem, mode: Mode, reduced: ReducedSystem) -> Curvature:
    """Return the second-order term of the posterior at its mode.

    Parameters
    ----------
    reduced : the problem linearised at the mode
    """
    weak = reduced.weak_directions()
    components = weak.T * np.diag(reduced.theta)
    spread = reduced.theta_covariance() @ components.T
    # Conditional mean of the calibration per sigma along each direction, linearised.
    sigma = np.linalg.cholesky(components @ spread)
    displacements = np.linalg.solve(sigma, spread.T)
    n_weak = len(displacements)

    def departure(*numbers: int, sign: float = 1.0) -> _Point:
        """Return conditional mode minus conditional mean, one sigma along some directions."""
        by_theta = sign * displacements[list(numbers)].sum(axis=0)
        by_source = reduced.source_shifts(by_theta[:, None])[0].T
        theta, sources = mode.theta + by_theta, mode.sources + by_source
        for _ in range(_RELAXATION_STEPS):
            right = downhill(problem, theta, sources, gradient(problem, theta, sources))
            step = reduced.solve(*right, weak)
            theta, sources = theta + step[0], sources + step[1]
        return theta - mode.theta - by_theta, sources - mode.sources - by_source

    terms = [np.zeros((n_weak, n_weak, *values.shape)) for values in (mode.theta, mode.sources)]
    forward = [departure(i) for i in range(n_weak)]
    backward = [departure(i, sign=-1.0) for i in range(n_weak)]
    for i, j in combinations_with_replacement(range(n_weak), 2):
        both = departure(i, j) if i != j else None
        for kind, term in enumerate(terms):
            if both is None:
                term[i, i] = 0.5 * (forward[i][kind] + backward[i][kind])
            else:
                term[i, j] = 0.5 * (both[kind] - forward[i][kind] - forward[j][kind])
                term[j, i] = term[i, j]
    return Curvature(np.linalg.solve(sigma, components), *terms)
