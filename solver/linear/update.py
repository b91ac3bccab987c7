"""Update normal equations for a changed problem: other priors, a lower order or less data.

The blocks of the data do not depend on the priors and are sums over the measurements. Those of
a solved problem therefore give those of the changed one, except for the small change of the
Jacobians on the way to its solution. They also contain every lower distortion order, but
linearised with the dropped terms, which is too inaccurate for leverage and for prior-dominated
directions: for a lower order they are accumulated again, at the point where the fit ended.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from solver.data.parameter_group import EXPOSURE_AXES, Axis
from solver.data.parameters import BY_NAME
from solver.linear.chi2 import Gradient
from solver.linear.contribution import Contribution, contribution_of
from solver.linear.normal_equations import NormalEquations, accumulate
from solver.problem.parameter_vector import VectorLayout
from solver.problem.problem import Problem
from solver.problem.source_blocks import SourceBlocks
from solver.units import RAD_PER_MAS


def update_equations(
    equations: NormalEquations, old: Problem, new: Problem
) -> NormalEquations | None:
    """Return normal equations for `new`, made from those of `old`.

    Returns
    -------
    None if `new` has measurements or distortion terms that `old` lacks, or another model.
    """
    if new.layout.n_coef > old.layout.n_coef or not _same_model(old, new):
        return None
    removed = np.zeros(old.n_obs, dtype=bool)
    if not np.array_equal(old.measurements.label, new.measurements.label):
        removed = ~np.isin(old.measurements.label, new.measurements.label)
    if old.n_obs - removed.sum() != new.n_obs:
        return None
    columns = _columns(old, new)
    # Both are in ascending order.
    sources = np.searchsorted(old.sources["source_id"], new.sources["source_id"])
    at = _same_point(equations, old, new, columns, sources)
    if new.layout.n_coef < old.layout.n_coef:
        term_blocks = (
            None if removed.any() else _lower_term_blocks(equations, old.layout, new.layout.n_coef)
        )
        return accumulate(new, *at, term_blocks)
    if not removed.any():
        return replace(equations, at=at)
    contribution = contribution_of(equations, old, removed)
    return _without(equations, contribution, at, columns, sources, new.source_blocks)


def _lower_term_blocks(
    equations: NormalEquations, layout: VectorLayout, n_coef: int
) -> Float[np.ndarray, "det 2 coef 2 coef"] | None:
    """Return the blocks between the lower distortion terms, by detector.

    At the same point they do not depend on the higher terms.
    """
    by_detector, shared = equations.by_detector, layout.coefficients()
    if by_detector is None:
        return None
    term_blocks = by_detector.theta[:, shared, shared].reshape(
        layout.n_det, *2 * (2, layout.n_terms)
    )
    kept = layout.lower_terms(n_coef)
    return term_blocks[:, :, kept][..., kept].copy()


def _same_model(old: Problem, new: Problem) -> bool:
    aberrated = [bool(np.any(problem.geometry.velocity)) for problem in (old, new)]
    return (
        aberrated[0] == aberrated[1]
        and old.layout.n_det == new.layout.n_det
        and _same_causes(old, new)
    )


def _same_causes(old: Problem, new: Problem) -> bool:
    """Return whether both have the same optional groups with the same elements and functions."""
    names = [[name for name, _ in problem.layout.optional] for problem in (old, new)]
    if names[0] != names[1] or old.geometry.causes is None or new.geometry.causes is None:
        return names[0] == names[1]
    if old.layout.n_walk != new.layout.n_walk:
        return False
    # The elements of a walk are exposures, of which some may be left out.
    axes: set[Axis] = {BY_NAME[name].axis for name in names[0]}
    axes -= set(EXPOSURE_AXES)
    if any(old.elements[axis] != new.elements[axis] for axis in axes):
        return False
    # The exposures of the new problem are among the old ones.
    kept = _kept_exposures(old, new)
    families = zip(old.geometry.causes.families, new.geometry.causes.families, strict=True)
    return all(
        np.array_equal(before.factor[:, kept], after.factor[:, : len(kept)])
        for before, after in families
    )


def _same_point(
    equations: NormalEquations,
    old: Problem,
    new: Problem,
    columns: Int[np.ndarray, " calib"],
    rows: Int[np.ndarray, " src"],
) -> tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]:
    """Return the linearisation point of the equations, in offsets from the origins of `new`."""
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
    contribution: Contribution,
    at: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]],
    columns: Int[np.ndarray, " calib"],
    sources: Int[np.ndarray, " src"],
    source_blocks: SourceBlocks,
) -> NormalEquations:
    """Return the equations minus a contribution, for a subset of the parameters."""
    whole, removed = equations.gradient, contribution.gradient
    cross = np.empty((len(columns), 2, len(sources)))
    places = equations.source_blocks.position[sources][source_blocks.order]
    # Row by row, because the whole block would not fit in the caches.
    for row, column in zip(cross, columns.tolist(), strict=True):
        np.take(contribution.remaining_cross(column), places, axis=1, out=row, mode="clip")
    return NormalEquations(
        at,
        Gradient(
            whole.chi2 - removed.chi2,
            (whole.by_theta - removed.by_theta)[columns],
            (whole.by_source - removed.by_source)[sources],
        ),
        (equations.theta - contribution.theta)[np.ix_(columns, columns)],
        (equations.source - contribution.source)[sources],
        source_blocks,
        cross,
        None,
    )


def _columns(old: Problem, new: Problem) -> Int[np.ndarray, " calib"]:
    """Return the column of `old` of each calibration parameter of `new`."""
    columns = np.empty(new.layout.size, dtype=np.int64)
    kept = _kept_exposures(old, new)
    for group in new.layout.groups:
        own = old.layout.columns(group)
        columns[new.layout.columns(group)] = (
            own.reshape(old.layout.n_exp, -1)[kept].ravel()
            if group.axis in EXPOSURE_AXES
            else own[: len(new.layout.columns(group))]
        )
    return columns


def _kept_exposures(old: Problem, new: Problem) -> Int[np.ndarray, " exp"]:
    """Return the index in `old` of each exposure of `new`."""
    old_keys, new_keys = (p.exposures[["field_id", "plate_id"]].to_numpy() for p in (old, new))
    return (old_keys[:, None] == new_keys).all(axis=2).argmax(axis=0)
