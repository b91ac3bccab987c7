"""Carry normal equations over to a changed problem: other priors, a lower order, less data.

The blocks of the data know nothing of the priors, hold every lower distortion order, and
are sums over the measurements. So those of a problem that was solved before make those of
the changed one, but for the small change of the Jacobians on the way to its solution.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
from jaxtyping import Bool, Int

from solver.forward import Index
from solver.layout import PER_COEFFICIENT, PER_DETECTOR, PER_EXPOSURE
from solver.normal import NormalEquations, accumulate
from solver.objective import Gradient
from solver.problem import Problem


def carry_over(equations: NormalEquations, old: Problem, new: Problem) -> NormalEquations | None:
    """Return normal equations for `new`, made of those of `old`.

    Returns
    -------
    None if `new` has measurements or distortion terms that `old` had not, or another model.
    """
    if new.geometry.order > old.geometry.order or not _same_model(old, new):
        return None
    gone = ~np.isin(old.label, new.label)
    if old.n_obs - gone.sum() != new.n_obs:
        return None
    if gone.any():
        equations = _without(equations, old, gone)
    columns, sources = _columns(old, new), _rows_of(new.sources, old.sources, ["source_id"])
    if len(columns) < old.layout.size:
        equations = _at_zero(equations, np.setdiff1d(_coefficients(old), columns))
    if len(columns) == old.layout.size and len(sources) == old.n_src:
        return equations
    theta, positions = equations.at
    return NormalEquations(
        (theta[columns], positions[sources]),
        Gradient(
            equations.gradient.chi2,
            equations.gradient.by_theta[columns],
            equations.gradient.by_source[sources],
        ),
        equations.theta[np.ix_(columns, columns)],
        equations.source[sources],
        equations.cross[columns][:, :, sources],
    )


def _same_model(old: Problem, new: Problem) -> bool:
    aberrated = [bool(np.any(problem.geometry.velocity)) for problem in (old, new)]
    return aberrated[0] == aberrated[1] and old.layout.n_det == new.layout.n_det


def _without(
    equations: NormalEquations, old: Problem, gone: Bool[np.ndarray, " obs"]
) -> NormalEquations:
    """Return the equations without what some measurements added."""
    part = accumulate(
        replace(
            old,
            index=Index(*(column[gone] for column in old.index)),
            measured=old.measured[gone],
            sigma=old.sigma[gone],
            row=old.row[gone],
            label=old.label[gone],
        ),
        *equations.at,
    )
    return NormalEquations(
        equations.at,
        Gradient(
            equations.gradient.chi2 - part.gradient.chi2,
            equations.gradient.by_theta - part.gradient.by_theta,
            equations.gradient.by_source - part.gradient.by_source,
        ),
        equations.theta - part.theta,
        equations.source - part.source,
        equations.cross - part.cross,
    )


def _at_zero(equations: NormalEquations, columns: Int[np.ndarray, " gone"]) -> NormalEquations:
    """Return the equations where the parameters of some columns are zero."""
    theta, sources = equations.at
    by_theta, by_source, step = *equations.gradient[1:], -theta[columns]
    bent = equations.theta[:, columns] @ step
    chi2 = equations.gradient.chi2 - 2.0 * by_theta[columns] @ step + step @ bent[columns]
    moved = theta.copy()
    moved[columns] = 0.0
    shift = np.einsum("kas,k->sa", equations.cross[columns], step)
    return replace(
        equations,
        at=(moved, sources),
        gradient=Gradient(float(chi2), by_theta - bent, by_source - shift),
    )


def _columns(old: Problem, new: Problem) -> Int[np.ndarray, " calib"]:
    """Return the column of `old` of each calibration parameter of `new`."""
    exposures = _rows_of(new.exposures, old.exposures, ["field_id", "plate_id"])
    columns = np.empty(new.layout.size, dtype=np.int64)
    for groups, kept in (
        (PER_EXPOSURE, exposures),
        (PER_COEFFICIENT, np.arange(new.layout.n_coef)),
        (PER_DETECTOR, np.arange(new.layout.n_det)),
    ):
        for group in groups:
            columns[new.layout.columns(group)] = old.layout.columns(group)[kept]
    return columns


def _coefficients(problem: Problem) -> Int[np.ndarray, " coef"]:
    return np.arange(problem.layout.size)[problem.layout.coefficients()]


def _rows_of(new: pd.DataFrame, old: pd.DataFrame, key: list[str]) -> Int[np.ndarray, " kept"]:
    """Return the row of `old` of each row of `new`, by their keys."""
    return pd.MultiIndex.from_frame(old[key]).get_indexer(pd.MultiIndex.from_frame(new[key]))
