"""Estimate: the result of any engine."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from solver.engines.gauss_newton import Mode


class Estimate(NamedTuple):
    """Result of an engine; covariances that are None come from the linearised problem.

    Attributes
    ----------
    mode : estimate, and the problem linearised there
    conditional, marginal : covariance of each source, mas^2, if the engine computes it
    calibration : marginal covariance of the calibration, if the engine computes it
    losses : loss of every step, if the engine has a loss
    entries : further entries of the summary, specific to the engine
    """

    mode: Mode
    conditional: Float[np.ndarray, "src 2 2"] | None = None
    marginal: Float[np.ndarray, "src 2 2"] | None = None
    calibration: Float[np.ndarray, "calib calib"] | None = None
    losses: Float[np.ndarray, " step"] | None = None
    entries: Mapping[str, object] = {}
