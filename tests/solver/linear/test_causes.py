"""Every cause in the model at once: linear algebra, engines and what-ifs against dense ones."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from numpyro.infer.util import log_density

from solver.data.parameters import OPTIONAL_GROUPS, SOURCES
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import objective
from solver.engines.numpyro_model import model_input, plate_analysis
from solver.errors import InputError
from solver.fit import fit_orbit
from solver.linear.chi2 import gradient
from solver.linear.covariances import covariances
from solver.linear.leverage import residuals
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import eliminate_sources
from solver.linear.update import update_equations
from solver.problem.problem import build_problem
from tests.solver.conftest import TIGHT_PRIORS
from tests.solver.small_orbit import true_offsets

EVERY = FitSettings(
    focal_anisotropy=True,
    drift=2,
    drift_in_time=2,
    drift_walk=3,
    breathing=2,
    field_distortion=2,
    detector_distortion=2,
    detector_motion=True,
    charge_transfer=True,
    magnitude_shift=True,
    pixel_phase=True,
    prior_widths=TIGHT_PRIORS,
)


@pytest.fixture(scope="module")
def data(small_orbit):
    """The small orbit with magnitudes."""
    catalogue = small_orbit.data.catalogue
    magnitude = np.random.default_rng(0).uniform(10.0, 19.0, len(catalogue))
    return replace(small_orbit.data, catalogue=catalogue.assign(magnitude=magnitude))


@pytest.fixture(scope="module")
def problem(data, small_orbit):
    return build_problem(data, small_orbit.instrument, EVERY)


@pytest.fixture(scope="module")
def expansion_point(small_orbit, problem):
    """About the truth, with no cause at zero."""
    theta, sources = true_offsets(small_orbit, problem)
    rng = np.random.default_rng(1)
    for group in OPTIONAL_GROUPS:
        columns = problem.layout.columns(group)
        theta[columns] = 0.1 * group.width * rng.standard_normal(len(columns))
    return theta, sources


@pytest.fixture(scope="module")
def dense(problem, expansion_point, make_dense):
    return make_dense(problem, *expansion_point)


def test_groups_have_the_elements_that_the_settings_name(problem):
    count = {g.name: len(problem.layout.columns(g)) for g in OPTIONAL_GROUPS}
    # Two fields of four exposures, four detectors, three terms of degree two.
    assert count["focal_anisotropy"] == 8
    assert count["drift_x"] == count["breathing_y"] == 2 * 3
    assert (count["field_distortion_x"], count["own_distortion_x"]) == (3, 4 * 3)
    assert count["drift_walk_x"] == 8 * 7
    assert count["detector_turn"] == count["detector_skew"] == count["phase_sine_y"] == 4
    columns = np.concatenate([problem.layout.columns(g) for g in problem.layout.groups])
    assert sorted(columns) == list(range(problem.layout.size))


def test_gradient_is_that_of_the_equations(problem, expansion_point):
    found = accumulate(problem, *expansion_point)
    at, scale = gradient(problem, *expansion_point), np.sqrt(np.diag(found.theta))
    assert at.chi2 == pytest.approx(found.gradient.chi2)
    np.testing.assert_allclose(
        at.by_theta / scale, found.gradient.by_theta / scale, atol=1e-6, rtol=1e-8
    )


@pytest.mark.full
def test_equations_equal_those_of_the_dense_jacobian(problem, expansion_point, dense):
    found, n = accumulate(problem, *expansion_point), dense.n_calib
    hessian = dense.jacobian.T @ dense.jacobian
    scale = np.sqrt(np.diag(hessian))
    theta = found.theta / np.outer(scale[:n], scale[:n])
    expected = hessian[:n, :n] / np.outer(scale[:n], scale[:n])
    np.testing.assert_allclose(theta, expected, atol=1e-9)
    cross = found.cross[:, :, problem.source_blocks.position].swapaxes(1, 2).reshape(n, -1)
    np.testing.assert_allclose(
        cross / scale[:n, None], hessian[:n, n:] / scale[:n, None], atol=1e-9 * scale[n:].max()
    )
    at = found.gradient
    by_theta = (dense.jacobian.T @ dense.residual)[:n]
    np.testing.assert_allclose(at.by_theta / scale[:n], by_theta / scale[:n], atol=1e-6)


@pytest.mark.full
def test_leverage_equals_the_dense_one(problem, expansion_point, dense):
    reduced = eliminate_sources(accumulate(problem, *expansion_point), problem.priors)
    found = residuals(problem, *expansion_point, covariances(reduced))
    jacobian = dense.jacobian.reshape(-1, 2, dense.jacobian.shape[1])
    expected = np.einsum("kia,ab,kib->k", jacobian, dense.covariance, jacobian)
    np.testing.assert_allclose(found.trace, expected, atol=1e-6)


@pytest.mark.full
def test_numpyro_model_has_the_same_posterior(problem, expansion_point):
    def total(theta, sources):
        values = {**problem.layout.scatter(theta), SOURCES.name: sources}
        density, trace = log_density(plate_analysis, (model_input(problem),), {}, values)
        assert {group.name for group in problem.layout.groups} < set(trace)
        return density

    (density, by_theta) = jax.value_and_grad(total)(*expansion_point)
    origin = np.zeros_like(expansion_point[0]), np.zeros_like(expansion_point[1])
    found, at_origin = (
        objective(problem, *point, gradient(problem, *point)) for point in (expansion_point, origin)
    )
    assert density - total(*origin) == pytest.approx(-0.5 * (found - at_origin), rel=1e-6)
    at = gradient(problem, *expansion_point)
    downhill = at.by_theta - problem.priors.gradient(expansion_point[0])
    scale = np.sqrt(np.diag(accumulate(problem, *expansion_point).theta))
    np.testing.assert_allclose(by_theta / scale, downhill / scale, atol=1e-3)


def test_equations_of_less_data_are_those_of_a_new_problem(
    problem, expansion_point, data, small_orbit
):
    equations = accumulate(problem, *expansion_point)
    for chosen in (data.measurements["detector_id"] != 1, data.measurements["plate_id"] != 2):
        rows = data.measurements[chosen]
        keys = rows[["field_id", "plate_id"]].drop_duplicates()
        less = replace(data, measurements=rows, exposures=data.exposures.merge(keys))
        changed = build_problem(less, small_orbit.instrument, EVERY)
        found = update_equations(equations, problem, changed)
        expected = accumulate(changed, *found.at)
        scale = np.sqrt(np.maximum(np.diag(expected.theta), 1e-12))
        np.testing.assert_allclose(
            found.theta / np.outer(scale, scale), expected.theta / np.outer(scale, scale), atol=1e-8
        )
        np.testing.assert_allclose(
            found.cross / scale[:, None, None], expected.cross / scale[:, None, None], atol=1e-7
        )


def test_a_change_of_the_time_scale_needs_a_refit(problem, expansion_point, data, small_orbit):
    last = data.exposures.sort_values("obstime").iloc[-1]
    is_last = (data.measurements["field_id"] == last["field_id"]) & (
        data.measurements["plate_id"] == last["plate_id"]
    )
    exposures = data.exposures.sort_values("obstime").iloc[:-1]
    less = replace(data, measurements=data.measurements[~is_last], exposures=exposures)
    changed = build_problem(less, small_orbit.instrument, EVERY)
    assert update_equations(accumulate(problem, *expansion_point), problem, changed) is None
    without = build_problem(data, small_orbit.instrument, replace(EVERY, drift=0))
    assert update_equations(accumulate(problem, *expansion_point), problem, without) is None


@pytest.mark.parametrize("setting", ["charge_transfer", "magnitude_shift"])
def test_a_shift_by_magnitude_needs_magnitudes(small_orbit, setting):
    with pytest.raises(InputError, match="expected magnitudes in the catalogue, found none"):
        build_problem(small_orbit.data, small_orbit.instrument, FitSettings(**{setting: True}))


def test_causes_that_are_off_change_no_bit_of_the_solution(small_orbit, data):
    """Neither do their widths and periods, nor magnitudes, which only causes use."""
    off = FitSettings(
        breathing_period=50.0,
        drift_in_time=3,
        prior_widths={group.name: 0.1 for group in OPTIONAL_GROUPS},
    )
    plain = fit_orbit(small_orbit.data, small_orbit.instrument)
    found = fit_orbit(data, small_orbit.instrument, off)
    for name in ("calibration", "sources", "residuals"):
        expected, table = getattr(plain, name), getattr(found, name)
        assert len(table) == len(expected)
        for column in expected.columns.drop("magnitude", errors="ignore"):
            np.testing.assert_array_equal(table[column], expected[column], err_msg=column)
