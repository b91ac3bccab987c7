"""Comparison of distortion orders by evidence and by reserved sources.

Every order is fitted as the highest one with the coefficients above it fixed at zero, so that
one compiled model and one set of tiles serve all orders. The solution of each order is the warm
start of the next lower one.

Let X be the posterior's chi2 at the mode and H the Hessian of X / 2, both over the same
measurements and priors for every order. The log evidence in Laplace's approximation is

    log Z = log prior density at its centre - sum log(sigma sqrt(2 pi)) - (X + log |H / 2 pi|) / 2.

A fraction of the sources is reserved and predicted with the calibration from the others. For
their whitened measurements y, with J_s, J_t the Jacobians by the reserved sources and by the
calibration, P the covariance of the catalogue and C the marginal one of the calibration given
the other sources, the covariance of the prediction is M = I + J_s P J_s' + J_t C J_t'. With the
subscripts of all measurements and of those of the other sources,

    chi2 = (y - f)' M^-1 (y - f) = X_all - X_rest,
    log p(y | rest) = log Z_all - log Z_rest,

which are identities of a linear model that do not need M. The position of every reserved source
is free within its catalogue errors, and correlations of the reserved sources through the
calibration are included. If model and sigmas are right, chi2 has twice as many degrees of
freedom as there are reserved measurements, for every order. Too low an order raises chi2. A
needless term does not, because M includes the uncertainty that the term adds to the prediction;
log |M| in the density penalises it. The order that predicts best has the highest density.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Bool, Int

from solver.data.distortion_terms import terms
from solver.data.result import FitResult
from solver.data.schema import ORDERS
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Iteration, Mode, find_mode, objective
from solver.engines.what_if import solve_what_if
from solver.linear.chi2 import gradient
from solver.linear.covariances import covariances
from solver.problem.parameter_vector import PER_COEFFICIENT
from solver.problem.problem import Problem, thinned
from solver.results.diagnostics import effective_parameters, log_evidence

# Fraction of the non-reference sources that is reserved, the same ones for every order.
_RESERVED_FRACTION = 0.1
_SEED = 0
# Prior width of a coefficient fixed at zero, um: its factor in the evidence is then one.
_FIXED_WIDTH = 1e-12
# Largest step at convergence, sigmas: since the last step is taken, the evidence is then accurate
# to some thousandths.
_TOLERANCE = 0.03


class HeldOut(NamedTuple):
    """How well the other sources predict the reserved measurements; see the module.

    `chi2` should be about `dof`; it is NaN without a solution or without reserved sources.
    """

    chi2: float
    dof: int
    log_density: float


def compare_orders(
    problem: Problem,
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
) -> pd.DataFrame:
    """Solve every order up to that of a problem by gauss-newton.

    Parameters
    ----------
    problem : problem of the highest order; see `solver.problem.problem.orders_held`
    settings : settings of the engine; their order is ignored
    progress : called after every iteration; an exception it raises stops the comparison

    Returns
    -------
    `schema.ORDERS`, from order 0 upwards
    """
    settings = settings.with_(tolerance=max(settings.tolerance, _TOLERANCE))
    reserved = reserved_sources(problem)
    rows: list[dict[str, object]] = []
    current, mode = problem, _evaluated(problem, find_mode(problem, settings, progress))
    for order in range(problem.order, -1, -1):
        if rows and len(terms(order)) == len(terms(order + 1)):
            rows.append({**rows[-1], "order": order})
            continue
        if order < problem.order:
            lower = at_order(problem, order)
            mode = _solve_from(mode, current, lower, settings, progress)
            current = lower
        prediction = judge_reserved(current, mode, reserved, settings, progress)
        rows.append({"order": order, **_numbers(current, mode, settings), **_columns(prediction)})
        rows[-1]["n_reserved"] = int(reserved.sum())
    table = pd.DataFrame(rows[::-1])
    return table[ORDERS.names].astype({column.name: column.dtype for column in ORDERS})


def with_orders(result: FitResult, orders: pd.DataFrame | None, seconds: float) -> FitResult:
    """Return a result with a comparison of orders, if there is one, and the time that it took."""
    if orders is None:
        return result
    timings = {**dict(result.summary["seconds"]), "orders": seconds}
    return replace(result, summary={**result.summary, "seconds": timings}, orders=orders)


def at_order(problem: Problem, order: int) -> Problem:
    """Return the problem with the terms above an order, and their walks, fixed at zero."""
    width = problem.priors.width.copy()
    width[_above(problem, order)] = _FIXED_WIDTH
    width[_walks_above(problem, order)] = _FIXED_WIDTH
    return replace(problem, priors=problem.priors._replace(width=width))


def reserved_sources(problem: Problem) -> Bool[np.ndarray, " src"]:
    """Return which sources are reserved: a random fraction of the non-reference sources."""
    others = np.flatnonzero(~problem.sources["is_reference"].to_numpy(bool))
    chosen = np.random.default_rng(_SEED).permutation(others)
    reserved = np.zeros(problem.n_src, dtype=bool)
    reserved[chosen[: int(np.ceil(_RESERVED_FRACTION * len(others)))]] = True
    return reserved


def judge_reserved(
    problem: Problem,
    mode: Mode,
    reserved: Bool[np.ndarray, " src"],
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
) -> HeldOut:
    """Compare the measurements of reserved sources with the prediction from the other sources.

    Parameters
    ----------
    mode : mode of the full problem; the last row of its trace is evaluated at its point
    """
    dof = 2 * int(reserved[problem.measurements.index.source].sum())
    if dof == 0 or not mode.status.is_solution:
        return HeldOut(np.nan, dof, np.nan)
    others = thinned(problem, ~reserved)
    rest = solve_what_if(mode, problem, others, settings)
    if rest is None:
        start = mode._replace(sources=mode.sources[~reserved])
        rest = find_mode(others, settings, progress, start=start)
    if not rest.status.is_solution:
        return HeldOut(np.nan, dof, np.nan)
    rest = _evaluated(others, rest)
    chi2 = mode.trace[-1].objective - rest.trace[-1].objective
    return HeldOut(chi2, dof, _log_evidence(problem, mode) - _log_evidence(others, rest))


def _above(problem: Problem, order: int) -> Int[np.ndarray, " above"]:
    """Return the columns of the coefficients above an order."""
    layout, kept = problem.layout, len(terms(order))
    return np.concatenate([layout.columns(group)[kept:] for group in PER_COEFFICIENT])


def _walks_above(problem: Problem, order: int) -> Int[np.ndarray, " above"]:
    """Return the columns of the walks of coefficients above an order, which that order lacks."""
    layout, kept = problem.layout, len(terms(order))
    walked = layout.walked(np.arange(layout.n_exp))
    return np.concatenate(
        [walked[:, kept : layout.n_walk].ravel(), walked[:, layout.n_walk + kept :].ravel()]
    )


def _solve_from(
    mode: Mode,
    solved: Problem,
    lower: Problem,
    settings: FitSettings,
    progress: Callable[[Iteration], None],
) -> Mode:
    """Return the mode of a lower order, from that of the order above it.

    A what-if gives a warm start if the dropped terms were small. The fit then recomputes the
    Jacobians, so that the evidence is evaluated at its own point.
    """
    warm_start = solve_what_if(mode, solved, lower, settings) if mode.status.is_solution else None
    found = find_mode(lower, settings, progress, start=warm_start)
    if warm_start is not None and not found.status.is_solution:
        # The solution of a higher order may be a bad start where that order is far too low.
        found = find_mode(lower, settings, progress)
    return _evaluated(lower, found)


def _evaluated(problem: Problem, mode: Mode) -> Mode:
    """Return a mode with the objective at its point instead of that before the last step."""
    found = gradient(problem, mode.theta, mode.sources)
    total = objective(problem, mode.theta, mode.sources, found)
    return mode._replace(trace=[mode.trace[-1]._replace(objective=total, chi2=found.chi2)])


def _log_evidence(problem: Problem, mode: Mode) -> float:
    log_sigma = float(np.log(problem.measurements.sigma).sum())
    found = mode.trace[-1].objective
    return log_evidence(mode, problem.priors, found, log_sigma, 2 * problem.n_obs)


def _numbers(problem: Problem, mode: Mode, settings: FitSettings) -> dict[str, object]:
    """Return the columns of `schema.ORDERS` that describe the fit of all measurements."""
    numbers: dict[str, object] = {
        "n_terms": int(2 * problem.layout.n_coef - _n_fixed(problem)),
        "converged": mode.status.is_solution,
        **dict.fromkeys(("chi2", "dof", "effective_parameters", "log_evidence"), np.nan),
    }
    if mode.reduced is None or not mode.status.is_solution:
        return numbers
    prior_hessian = problem.priors.hessian_diagonal(mode.theta)
    parameters = effective_parameters(problem.priors, prior_hessian, covariances(mode.reduced))
    numbers |= {
        "chi2": mode.trace[-1].chi2,
        "dof": 2 * problem.n_obs - parameters,
        "effective_parameters": parameters,
    }
    # A flat prior has no density: each of its terms would make the evidence depend on the unit.
    if all(np.isfinite(settings.width(group.name)) for group in PER_COEFFICIENT):
        numbers["log_evidence"] = _log_evidence(problem, mode)
    return numbers


def _n_fixed(problem: Problem) -> int:
    """Return the number of coefficients that are fixed at zero."""
    columns = np.concatenate([problem.layout.columns(group) for group in PER_COEFFICIENT])
    return int((problem.priors.width[columns] == _FIXED_WIDTH).sum())


def _columns(held_out: HeldOut) -> dict[str, object]:
    return {f"held_out_{name}": value for name, value in held_out._asdict().items()}
