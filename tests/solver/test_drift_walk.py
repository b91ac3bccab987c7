"""A random walk of the distortion: recovered from an orbit that has one, and absent if off."""

from dataclasses import replace

import jax
import numpy as np
import pandas as pd
import pytest

from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.fit import OrbitFitter, fit_orbit
from solver.linear.covariances import covariances
from solver.linear.leverage import residuals
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import eliminate_sources
from solver.model.forward import predict
from solver.problem.problem import build_problem
from tests.solver.conftest import TIGHT_PRIORS
from tests.solver.small_orbit import true_offsets

STEP_UM = 0.1
SETTINGS = FitSettings(
    drift_walk=2,
    prior_widths={"drift_walk_x": STEP_UM, "drift_walk_y": STEP_UM, **TIGHT_PRIORS},
)


def walked_orbit(orbit, walk, seed=0):
    """Return tables of an orbit whose quadratic terms walk.

    Parameters
    ----------
    walk : um, shape (walk, exposure), in the order of `Walks.columns`
    """
    problem = build_problem(orbit.data, orbit.instrument, SETTINGS)
    theta, sources = true_offsets(orbit, problem)
    theta[problem.priors.walks.columns] = walk
    offsets = problem.offsets(theta, sources)
    pixel = jax.jit(predict)(offsets, problem.geometry, problem.measurements.index).pixel
    noise = np.random.default_rng(seed).standard_normal((problem.n_obs, 2))
    measured = np.stack(pixel, axis=-1) + problem.measurements.sigma * noise
    rows = orbit.data.measurements.copy()
    row = problem.measurements.row
    rows.iloc[row, rows.columns.get_indexer(["nx", "ny"])] = measured
    return replace(orbit.data, measurements=rows)


def walks_of(kind, n_exp):
    """Return six walks about their means, um."""
    rng = np.random.default_rng(1)
    if kind == "linear":
        walk = rng.standard_normal((6, 1)) * np.linspace(-0.5, 0.5, n_exp)
    else:
        walk = np.cumsum(STEP_UM * rng.standard_normal((6, n_exp)), axis=1)
    return walk - walk.mean(axis=1, keepdims=True)


@pytest.mark.parametrize("kind", ["walk", "linear"])
def test_walk_is_recovered_within_its_sigmas(small_orbit, kind):
    n_exp = len(small_orbit.data.exposures)
    truth = walks_of(kind, n_exp)
    data = walked_orbit(small_orbit, truth)
    without = fit_orbit(data, small_orbit.instrument, replace(SETTINGS, drift_walk=0))
    found = fit_orbit(data, small_orbit.instrument, SETTINGS)
    assert found.summary["converged"]
    assert found.summary["chi2_per_dof"] == pytest.approx(1.0, abs=0.1)
    assert without.summary["chi2_per_dof"] > found.summary["chi2_per_dof"] + 0.1
    problem = build_problem(data, small_orbit.instrument, SETTINGS)
    expected = np.zeros(problem.layout.size)
    expected[problem.priors.walks.columns] = truth
    for group in problem.layout.on("walk"):
        rows = found.calibration[found.calibration["group"] == group.name]
        pulls = rows["offset"] - expected[problem.layout.columns(group)]
        pulls /= rows["sigma_marginal"]
        assert np.abs(pulls).max() < 4.0
        assert 0.5 < np.sqrt(np.mean(pulls**2)) < 1.5
        assert rows["label"].iloc[0] == f"{group.label[-1]}(2,0) field 0 plate 0"


def test_equations_and_leverage_are_those_of_the_dense_jacobian(small_orbit, make_dense):
    problem = build_problem(small_orbit.data, small_orbit.instrument, SETTINGS)
    theta, sources = true_offsets(small_orbit, problem)
    walk = walks_of("walk", problem.layout.n_exp)
    theta[problem.priors.walks.columns] = walk
    dense = make_dense(problem, theta, sources)
    equations, n = accumulate(problem, theta, sources), dense.n_calib
    hessian = dense.jacobian.T @ dense.jacobian
    scale = np.sqrt(np.diag(hessian))
    np.testing.assert_allclose(
        equations.theta / np.outer(scale[:n], scale[:n]),
        hessian[:n, :n] / np.outer(scale[:n], scale[:n]),
        atol=1e-9,
    )
    reduced = eliminate_sources(equations, problem.priors)
    right = dense.gradient[:n], dense.gradient[n:].reshape(-1, 2)
    step = np.concatenate([part.ravel() for part in reduced.solve(*right)])
    sigma = np.sqrt(np.diag(dense.covariance))
    np.testing.assert_allclose(
        step / sigma, np.linalg.solve(dense.hessian, dense.gradient) / sigma, atol=1e-6
    )
    covariance = covariances(reduced)
    # What all exposures share with the walk is known from the priors only: there the normal
    # equations leave three to four digits on some processors.
    np.testing.assert_allclose(np.sqrt(np.diag(covariance.theta)) / sigma[:n], 1.0, atol=1e-3)
    found = residuals(problem, theta, sources, covariance)
    jacobian = dense.jacobian.reshape(-1, 2, dense.jacobian.shape[1])
    expected = np.einsum("kia,ab,kib->k", jacobian, dense.covariance, jacobian)
    np.testing.assert_allclose(found.trace, expected, atol=1e-6)


def test_a_walk_without_terms_changes_nothing(small_orbit):
    off, without_terms = (
        fit_orbit(small_orbit.data, small_orbit.instrument, FitSettings(order=1, drift_walk=k))
        for k in (0, 2)
    )
    for name in ("sources", "calibration", "residuals"):
        a, b = (getattr(one, name) for one in (off, without_terms))
        # Each is compiled for itself, and the last bit depends on how.
        pd.testing.assert_frame_equal(a, b, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "change",
    [
        {"prior_widths": {**SETTINGS.prior_widths, "drift_walk_x": 0.05}},
        {"exclusions": Subset(exposures=frozenset({(0, 1)}))},
        {"exclusions": Subset(detectors=frozenset({1}))},
    ],
    ids=["prior", "exposure", "detector"],
)
def test_what_if_is_the_refit(small_orbit, change):
    data = walked_orbit(small_orbit, walks_of("walk", len(small_orbit.data.exposures)))
    fitter = OrbitFitter(data, small_orbit.instrument)
    fitter.fit(SETTINGS)
    changed = replace(SETTINGS, **change)
    found, refit = fitter.what_if(changed), fit_orbit(data, small_orbit.instrument, changed)
    for table in ("sources", "calibration"):
        a, b = getattr(found, table), getattr(refit, table)
        names = ("offset_ra", "sigma_ra_marginal") if table == "sources" else ("offset",)
        for name in names:
            sigma = b["sigma_ra_marginal" if table == "sources" else "sigma_marginal"]
            np.testing.assert_allclose(a[name] / sigma, b[name] / sigma, atol=5e-3)


def test_a_change_of_the_walk_needs_a_refit():
    assert not SETTINGS.what_if_holds(replace(SETTINGS, drift_walk=3))
    assert SETTINGS.what_if_holds(replace(SETTINGS, prior_widths={"drift_walk_x": 0.5}))
