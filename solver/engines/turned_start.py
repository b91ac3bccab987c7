"""A start for fits whose estimated position angles are wrong by a large angle.

The steps of Gauss-Newton find the mode from pointings that are arcminutes off and from rolls up to
some 90 deg off. A sign or a handedness that two programs define in different ways is worse.
"""

import numpy as np
from jaxtyping import Float

from solver.data.parameters import PARAMETERS
from solver.linear.chi2 import gradient
from solver.problem.problem import Problem

_TURNS_DEG = (90.0, 180.0, 270.0)
# Chi2 per coordinate above which an angle is suspected: residuals of a thousand sigmas. Below,
# nothing more is computed.
_SUSPICIOUS = 1e6
_POSITION_ANGLE = next(group for group in PARAMETERS if group.name == "position_angle")


def turned_start(problem: Problem, chi2: float) -> Float[np.ndarray, " calib"]:
    """Return the calibration parameters to start from: the origins, or these with a turned roll.

    Parameters
    ----------
    chi2 : of the data at the origins

    Returns
    -------
    Offsets from the origins; zero unless residuals are very large there and turning all exposures
    by 90, 180 or 270 deg makes them smaller.
    """
    best = np.zeros(problem.layout.size)
    if chi2 < _SUSPICIOUS * 2 * problem.n_obs:
        return best
    sources, smallest = np.zeros((problem.n_src, 2)), chi2
    columns = problem.layout.columns(_POSITION_ANGLE)
    for turn in _TURNS_DEG:
        theta = np.zeros(problem.layout.size)
        theta[columns] = turn * 3600.0
        found = gradient(problem, theta, sources).chi2 + problem.priors.penalty(theta, sources)
        if found < smallest:
            best, smallest = theta, found
    return best
