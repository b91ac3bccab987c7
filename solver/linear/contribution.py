"""Contribution: what some of the measurements add to normal equations.

All of them are sums over the measurements, so that what is taken out is what would not be
added. Those of whole detectors are at hand; any others have to be linearised again.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from solver.linear.chi2 import Gradient
from solver.linear.normal_equations import DetectorSums, NormalEquations, accumulate
from solver.problem.parameter_vector import PER_DETECTOR, PER_EXPOSURE, VectorLayout
from solver.problem.problem import Problem, of_rows


class Contribution(NamedTuple):
    """Blocks of some measurements, in the order of sources of the whole `NormalEquations`.

    Instead of W it has `left`: a row of W without what these measurements added to it.
    """

    gradient: Gradient
    theta: Float[np.ndarray, "calib calib"]
    source: Float[np.ndarray, "src 2 2"]
    left: Callable[[int], Float[np.ndarray, "2 src"]]


def contribution_of(
    equations: NormalEquations, problem: Problem, gone: Bool[np.ndarray, " obs"]
) -> Contribution:
    """Return what the measurements `gone` have added to the equations of a problem."""
    index, own = problem.measurements.index, equations.by_detector
    detectors = np.bincount(index.detector[gone], minlength=problem.layout.n_det) > 0
    if own is not None and np.array_equal(gone, detectors[index.detector]):
        seen = index.exposure * problem.n_src + index.source
        share = np.ones(problem.layout.n_exp * problem.n_src)
        share[seen[gone]] = 0.0
        # Where detectors overlap, an exposure's row is not of one detector for each source.
        if share[seen[~gone]].all():
            share = share.reshape(problem.layout.n_exp, -1)[:, equations.source_blocks.order]
            return _of_detectors(equations, own, problem.layout, detectors, share)
    # With the patches of the whole, so that the sources stand in their order.
    part = accumulate(of_rows(problem, gone), *equations.at)

    def left(column: int) -> Float[np.ndarray, "2 src"]:
        return equations.cross[column] - part.cross[column]

    return Contribution(part.gradient, part.theta, part.source, left)


def _of_detectors(
    equations: NormalEquations,
    own: DetectorSums,
    layout: VectorLayout,
    detectors: Bool[np.ndarray, " det"],
    share: Float[np.ndarray, "exp src"],
) -> Contribution:
    """Return the part of some detectors; the others have a share in what exposures have seen."""
    whose = np.empty(layout.size, dtype=np.int64)
    for groups, count in ((PER_EXPOSURE, layout.n_exp), (PER_DETECTOR, layout.n_det)):
        for group in groups:
            whose[layout.columns(group)] = np.arange(count)
    coefficients = own.coefficients[detectors].sum(axis=0)

    def left(column: int) -> Float[np.ndarray, "2 src"]:
        row = equations.cross[column]
        if column < layout.first_coefficient:
            return row * share[whose[column]]
        if column < layout.first_detector:
            return row - coefficients[column - layout.first_coefficient]
        return row * (not detectors[whose[column]])

    gradient = Gradient(
        float(own.chi2[detectors].sum()),
        own.by_theta[detectors].sum(axis=0),
        own.by_source[detectors].sum(axis=0).T,
    )
    of_sources = own.source[detectors].sum(axis=0).transpose(2, 0, 1)
    return Contribution(gradient, own.theta[detectors].sum(axis=0), of_sources, left)
