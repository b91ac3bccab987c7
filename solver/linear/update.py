"""Carry normal equations over to a changed problem: other priors, a lower order, less data.

The blocks of the data know nothing of the priors and are sums over the measurements. So those
of a problem that was solved before make those of the changed one, but for the small change of
the Jacobians on the way to its solution. They hold every lower distortion order, too, but bent
by the terms that are dropped, which neither the leverage of the measurements nor what the
priors alone hold would forgive: those are made anew, where the fit ended.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from solver.data.parameters import BY_NAME
from solver.linear.chi2 import Gradient
from solver.linear.contribution import Contribution, contribution_of
from solver.linear.normal_equations import NormalEquations, accumulate
from solver.problem.parameter_vector import (
    PER_COEFFICIENT,
    PER_DETECTOR,
    PER_EXPOSURE,
    VectorLayout,
)
from solver.problem.problem import Problem
from solver.problem.source_blocks import SourceBlocks
from solver.units import RAD_PER_MAS


def update_equations(
    equations: NormalEquations, old: Problem, new: Problem
) -> NormalEquations | None:
    """Return normal equations for `new`, made of those of `old`.

    Returns
    -------
    None if `new` has measurements or distortion terms that `old` had not, or another model.
    """
    if new.layout.n_coef > old.layout.n_coef or not _same_model(old, new):
        return None
    gone = np.zeros(old.n_obs, dtype=bool)
    if not np.array_equal(old.measurements.label, new.measurements.label):
        gone = ~np.isin(old.measurements.label, new.measurements.label)
    if old.n_obs - gone.sum() != new.n_obs:
        return None
    columns = _columns(old, new)
    # Both in ascending order.
    sources = np.searchsorted(old.sources["source_id"], new.sources["source_id"])
    at = _same_point(equations, old, new, columns, sources)
    if new.layout.n_coef < old.layout.n_coef:
        known = None if gone.any() else _of_lower_terms(equations, old.layout, new.layout.n_coef)
        return accumulate(new, *at, known)
    if not gone.any():
        return replace(equations, at=at)
    part = contribution_of(equations, old, gone)
    return _without(equations, part, at, columns, sources, new.source_blocks)


def _of_lower_terms(
    equations: NormalEquations, layout: VectorLayout, n_coef: int
) -> Float[np.ndarray, "det 2 coef 2 coef"] | None:
    """Return the blocks between the lower terms of the distortion, of each detector.

    They are the same with and without the higher ones, at the same point.
    """
    own, shared = equations.by_detector, layout.coefficients()
    if own is None:
        return None
    of_terms = own.theta[:, shared, shared].reshape(layout.n_det, *2 * (2, layout.n_coef))
    return of_terms[:, :, :n_coef, :, :n_coef].copy()


def _same_model(old: Problem, new: Problem) -> bool:
    aberrated = [bool(np.any(problem.geometry.velocity)) for problem in (old, new)]
    return aberrated[0] == aberrated[1] and old.layout.n_det == new.layout.n_det


def _same_point(
    equations: NormalEquations,
    old: Problem,
    new: Problem,
    columns: Int[np.ndarray, " calib"],
    rows: Int[np.ndarray, " src"],
) -> tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]:
    """Return where the equations were made, in offsets from the origins of `new`."""
    theta, sources = equations.at
    moved = old.priors.centre[columns] - new.priors.centre
    declination = np.radians(new.exposures["dec_est"].to_numpy())
    moved[new.layout.columns(BY_NAME["pointing_ra"])] *= np.cos(declination)
    frame = new.geometry.source_frame[: new.n_src]
    shift = np.einsum("sij,sj->si", frame[:, 1:], old.geometry.source_frame[rows, 0] - frame[:, 0])
    shift /= RAD_PER_MAS
    return theta[columns] + moved, sources[rows] + shift


def _without(
    equations: NormalEquations,
    part: Contribution,
    at: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]],
    columns: Int[np.ndarray, " calib"],
    sources: Int[np.ndarray, " src"],
    source_blocks: SourceBlocks,
) -> NormalEquations:
    """Return the equations less a part of them, for some of the parameters."""
    whole, less = equations.gradient, part.gradient
    cross = np.empty((len(columns), 2, len(sources)))
    places = equations.source_blocks.position[sources][source_blocks.order]
    # Row by row, since the whole would be too much for the caches.
    for row, column in zip(cross, columns.tolist(), strict=True):
        np.take(part.left(column), places, axis=1, out=row, mode="clip")
    return NormalEquations(
        at,
        Gradient(
            whole.chi2 - less.chi2,
            (whole.by_theta - less.by_theta)[columns],
            (whole.by_source - less.by_source)[sources],
        ),
        (equations.theta - part.theta)[np.ix_(columns, columns)],
        (equations.source - part.source)[sources],
        source_blocks,
        cross,
        None,
    )


def _columns(old: Problem, new: Problem) -> Int[np.ndarray, " calib"]:
    """Return the column of `old` of each calibration parameter of `new`."""
    among, wanted = (p.exposures[["field_id", "plate_id"]].to_numpy() for p in (old, new))
    exposures = (among[:, None] == wanted).all(axis=2).argmax(axis=0)
    columns = np.empty(new.layout.size, dtype=np.int64)
    for groups, kept in (
        (PER_EXPOSURE, exposures),
        (PER_COEFFICIENT, np.arange(new.layout.n_coef)),
        (PER_DETECTOR, np.arange(new.layout.n_det)),
    ):
        for group in groups:
            columns[new.layout.columns(group)] = old.layout.columns(group)[kept]
    return columns
