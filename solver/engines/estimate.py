"""Estimate: where an engine ended, whichever it was."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from solver.engines.gauss_newton import Mode


class Estimate(NamedTuple):
    """The answer of an engine; what it does not say itself the linearised problem does.

    Attributes
    ----------
    mode : the point it found, and the problem linearised there
    conditional, marginal : covariance of each source, mas^2, where the engine has its own
    calibration : marginal covariance of the calibration, likewise
    losses : of every step, of an engine that has one
    figures : what the engine says of itself, for the summary
    """

    mode: Mode
    conditional: Float[np.ndarray, "src 2 2"] | None = None
    marginal: Float[np.ndarray, "src 2 2"] | None = None
    calibration: Float[np.ndarray, "calib calib"] | None = None
    losses: Float[np.ndarray, " step"] | None = None
    figures: Mapping[str, object] = {}
