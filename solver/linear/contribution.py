"""Contribution: the terms that some of the measurements add to the normal equations.

Normal equations are sums over the measurements, so removing measurements subtracts their
contribution. It is already summed for whole detectors; other subsets are linearised again.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from solver.data.parameter_group import EXPOSURE_AXES
from solver.linear.chi2 import Gradient
from solver.linear.normal_equations import DetectorSums, NormalEquations, accumulate
from solver.problem.parameter_vector import VectorLayout
from solver.problem.problem import Problem, of_rows

# One source in so many: enough for more than `tiles.FEW_TILES`, few measurements in each.
_APART = 50


class Contribution(NamedTuple):
    """Contribution of some measurements, with the sources in the order of the full equations.

    Instead of their contribution to W, `remaining_cross` returns a row of W without it.
    """

    gradient: Gradient
    theta: Float[np.ndarray, "calib calib"]
    source: Float[np.ndarray, "src 2 2"]
    remaining_cross: Callable[[int], Float[np.ndarray, "2 src"]]


def contribution_of(
    equations: NormalEquations, problem: Problem, removed: Bool[np.ndarray, " obs"]
) -> Contribution:
    """Return the contribution of the measurements `removed` to the equations of a problem."""
    index, sums = problem.measurements.index, equations.by_detector
    detectors = np.bincount(index.detector[removed], minlength=problem.layout.n_det) > 0
    if sums is not None and np.array_equal(removed, detectors[index.detector]):
        pair = index.exposure * problem.n_src + index.source
        kept_share = np.ones(problem.layout.n_exp * problem.n_src)
        kept_share[pair[removed]] = 0.0
        # If detectors overlap, several of them can contribute to the row of an exposure.
        if kept_share[pair[~removed]].all():
            kept_share = kept_share.reshape(problem.layout.n_exp, -1)[
                :, equations.source_blocks.order
            ]
            return _detectors_contribution(equations, sums, problem.layout, detectors, kept_share)
    # The source blocks of the full problem keep the order of its sources.
    removed_equations = accumulate(of_rows(problem, removed), *equations.at)

    def remaining_cross(column: int) -> Float[np.ndarray, "2 src"]:
        return equations.cross[column] - removed_equations.cross[column]

    return Contribution(
        removed_equations.gradient,
        removed_equations.theta,
        removed_equations.source,
        remaining_cross,
    )


def typical_removals(problem: Problem) -> list[Bool[np.ndarray, " obs"]]:
    """Return some measurements of a problem, of each kind for which `contribution_of` compiles.

    Tiles of few measurements have other shapes than those of an orbit, and JAX compiles once for
    each, for seconds: for a source, for sources that lie in many tiles, and for an exposure.
    """
    index = problem.measurements.index
    return [
        index.source == index.source[0],
        index.source % _APART == 0,
        index.exposure == index.exposure[0],
    ]


def _detectors_contribution(
    equations: NormalEquations,
    sums: DetectorSums,
    layout: VectorLayout,
    detectors: Bool[np.ndarray, " det"],
    kept_share: Float[np.ndarray, "exp src"],
) -> Contribution:
    """Return the contribution of some detectors.

    Parameters
    ----------
    kept_share : 1 where other detectors contribute to the rows of an exposure, 0 elsewhere
    """
    owner = np.empty(layout.size, dtype=np.int64)
    for group in (*layout.local_groups, *layout.on("walk")):
        columns = layout.columns(group)
        count = layout.n_exp if group.axis in EXPOSURE_AXES else layout.n_det
        owner[columns] = np.repeat(np.arange(count), len(columns) // count)
    coefficients = sums.coefficients[detectors].sum(axis=0)

    def remaining_cross(column: int) -> Float[np.ndarray, "2 src"]:
        row = equations.cross[column]
        if column < layout.first_coefficient:
            return row * kept_share[owner[column]]
        if column < layout.first_detector:
            return row - coefficients[column - layout.first_coefficient]
        return row * (not detectors[owner[column]])

    gradient = Gradient(
        float(sums.chi2[detectors].sum()),
        sums.by_theta[detectors].sum(axis=0),
        sums.by_source[detectors].sum(axis=0).T,
    )
    source = sums.source[detectors].sum(axis=0).transpose(2, 0, 1)
    return Contribution(gradient, sums.theta[detectors].sum(axis=0), source, remaining_cross)
