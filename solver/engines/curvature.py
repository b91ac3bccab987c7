"""How the posterior bends along the directions that the priors alone hold.

Pointings and detectors may move together by a tenth of a millimetre where the data alone
cannot tell, and on so long a way the best place of all else is no straight line: it leaves
the one of the linearised problem by many times its own uncertainty. To second order it does
not, and a sampler that follows it takes steps a hundred times as long.
"""

from itertools import combinations_with_replacement

import numpy as np
from jaxtyping import Float

from solver.engines.gauss_newton import Mode, downhill
from solver.linear.chi2 import gradient
from solver.linear.source_elimination import ReducedSystem
from solver.linear.whitening import Curvature
from solver.problem.problem import Problem

# Short steps with the Jacobians of the mode; each brings a hundredth of the way that is left.
_SETTLING_STEPS = 4

_Point = tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]


def curvature_at(problem: Problem, mode: Mode, reduced: ReducedSystem) -> Curvature:
    """Return how the posterior bends at its mode.

    Parameters
    ----------
    reduced : the problem linearised at the mode
    """
    held = reduced.weak_directions()
    along = held.T * np.diag(reduced.theta)
    spread = reduced.theta_covariance() @ along.T
    # Where all else goes with one sigma along each direction, in the linearised problem.
    sigma = np.linalg.cholesky(along @ spread)
    ways = np.linalg.solve(sigma, spread.T)
    n_weak = len(ways)

    def settled(*numbers: int, sign: float = 1.0) -> _Point:
        """Return how far all else settles from there after a sigma along some directions."""
        way = sign * ways[list(numbers)].sum(axis=0)
        follow = reduced.source_shifts(way[:, None])[0].T
        theta, sources = mode.theta + way, mode.sources + follow
        for _ in range(_SETTLING_STEPS):
            right = downhill(problem, theta, sources, gradient(problem, theta, sources))
            step = reduced.solve(*right, held)
            theta, sources = theta + step[0], sources + step[1]
        return theta - mode.theta - way, sources - mode.sources - follow

    bends = [np.zeros((n_weak, n_weak, *part.shape)) for part in (mode.theta, mode.sources)]
    forth = [settled(i) for i in range(n_weak)]
    back = [settled(i, sign=-1.0) for i in range(n_weak)]
    for i, j in combinations_with_replacement(range(n_weak), 2):
        together = settled(i, j) if i != j else None
        for part, bend in enumerate(bends):
            if together is None:
                bend[i, i] = 0.5 * (forth[i][part] + back[i][part])
            else:
                bend[i, j] = 0.5 * (together[part] - forth[i][part] - forth[j][part])
                bend[j, i] = bend[i, j]
    return Curvature(np.linalg.solve(sigma, along), *bends)
