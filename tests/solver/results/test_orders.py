"""The comparison of distortion orders, tested with a dense posterior and a known truth."""

from dataclasses import replace

import numpy as np
import pytest

from solver.data.distortion_terms import terms
from solver.data.exclusions import orbit_of_rows
from solver.data.result import FitStatus
from solver.data.settings import MAX_ORDER, FitSettings
from solver.engines.gauss_newton import find_mode
from solver.errors import CancelledError
from solver.fit import OrbitFitter, fit_orbit
from solver.problem.parameter_vector import VectorLayout
from solver.problem.problem import build_problem, orders_held
from solver.results.diagnostics import log_evidence
from solver.results.orders import at_order, compare_orders, judge_reserved, reserved_sources
from tests.solver.small_orbit import make_orbit

TRUE_ORDER = 5
# One order too many; higher ones cost compilations and add nothing.
HIGHEST = 6
# An orbit near its nominal calibration, with priors narrow enough for an accurate covariance of
# its data.
NEAR = {"scatter": 0.01, "pointing_error": 0.1}
EXACT = FitSettings(
    prior_widths={
        **{"pointing_ra": 0.1, "pointing_dec": 0.1, "position_angle": 0.1, "focal_length": 1e-5},
        **{"detector_x": 1.0, "detector_y": 1.0, "detector_rotation": 3.0},
        **{"pitch_x": 1e-4, "pitch_y": 1e-4},
    },
    tolerance=1e-7,
)


@pytest.fixture(scope="module")
def orders():
    """The comparison up to order six of an orbit with distortion of order five."""
    orbit = make_orbit()
    settings = FitSettings(order=HIGHEST)
    return compare_orders(build_problem(orbit.data, orbit.instrument, settings), settings)


@pytest.mark.slow
def test_every_order_is_present_and_converged(orders):
    assert orders["order"].tolist() == list(range(HIGHEST + 1))
    assert orders["n_terms"].tolist() == [2 * len(terms(n)) for n in range(HIGHEST + 1)]
    assert orders["converged"].all()


@pytest.mark.slow
def test_an_order_that_a_warm_start_leads_astray_starts_anew(short_orbit, monkeypatch):
    starts = []

    def astray(problem, settings, progress, start=None):
        found = find_mode(problem, settings, progress, start=start)
        starts.append(start)
        return found if start is None else found._replace(status=FitStatus.NOT_FINITE)

    monkeypatch.setattr("solver.results.orders.find_mode", astray)
    settings = FitSettings(order=3)
    problem = build_problem(short_orbit.data, short_orbit.instrument, settings)
    assert compare_orders(problem, settings)["converged"].all()
    assert any(start is not None for start in starts)


@pytest.mark.slow
def test_evidence_and_reserved_sources_prefer_the_true_order(orders):
    assert int(orders["log_evidence"].argmax()) == TRUE_ORDER
    assert int(orders["held_out_log_density"].argmax()) == TRUE_ORDER


@pytest.mark.slow
def test_chi2_of_the_reserved_sources_falls_up_to_the_true_order(orders):
    ratio = (orders["held_out_chi2"] / orders["held_out_dof"]).to_numpy()
    scatter = np.sqrt(2.0 / orders["held_out_dof"].iloc[0])
    assert ratio[TRUE_ORDER] == pytest.approx(1.0, abs=3.0 * scatter)
    assert (ratio[:TRUE_ORDER] > 1.0 + 10.0 * scatter).all()
    np.testing.assert_allclose(ratio[TRUE_ORDER:], ratio[TRUE_ORDER], atol=2.0 * scatter)


@pytest.mark.slow
def test_chi2_falls_with_the_order(orders):
    """Except for a small rise, because chi2 excludes the priors of the new terms."""
    assert (np.diff(orders["chi2"].to_numpy()) < 1.0).all()


@pytest.mark.slow
def test_effective_parameters_grow_at_most_by_the_number_of_terms(orders):
    growth = np.diff(orders["effective_parameters"].to_numpy())
    assert (growth[TRUE_ORDER:] > 0.0).all()
    assert (growth <= np.diff(orders["n_terms"]) + 1e-3).all()


@pytest.mark.slow
def test_orders_without_terms_are_the_same(orders):
    first, second = (orders.drop(columns="order").iloc[n] for n in (0, 1))
    assert first.equals(second)


@pytest.mark.slow
def test_figures_equal_those_of_a_fit_of_that_order(orders, result):
    """The fit has no higher terms, instead of terms fixed at zero."""
    row = orders.iloc[TRUE_ORDER]
    for name in ("chi2", "dof", "effective_parameters"):
        assert row[name] == pytest.approx(result.summary[name], rel=1e-5)
    assert row["log_evidence"] == pytest.approx(result.summary["log_evidence"], abs=0.01)


class LinearModel:
    """The linear model of a problem at its mode, with all parameters integrated out.

    `data` is whitened, in working order, and `covariance` is its covariance, computed from the
    dense Jacobian and the priors without any elimination.
    """

    def __init__(self, problem, make_dense, settings):
        mode = find_mode(problem, settings)
        self.mode = find_mode(problem, settings, start=mode)
        dense = make_dense(problem, self.mode.theta, self.mode.sources)
        n, jacobian = dense.n_calib, dense.jacobian
        prior = np.zeros_like(dense.prior)
        prior[:n, :n] = np.diag(problem.priors.width**2)
        prior[n:, n:] = np.linalg.inv(dense.prior[n:, n:])
        point = np.concatenate([self.mode.theta, self.mode.sources.ravel()])
        self.data = dense.residual + jacobian @ point
        self.covariance = np.eye(len(self.data)) + jacobian @ prior @ jacobian.T

    def log_density(self, sigma):
        """Return the log density of the data, in pixels."""
        _, log_det = np.linalg.slogdet(self.covariance)
        chi2 = self.data @ np.linalg.solve(self.covariance, self.data)
        return -0.5 * (chi2 + log_det + sigma.size * np.log(2 * np.pi)) - np.log(sigma).sum()

    def prediction(self, is_reserved, sigma):
        """Return chi2 and log density of some data given the others."""
        rest = ~is_reserved
        cross = self.covariance[np.ix_(is_reserved, rest)]
        gain = np.linalg.solve(self.covariance[np.ix_(rest, rest)], cross.T).T
        remainder = self.data[is_reserved] - gain @ self.data[rest]
        spread = self.covariance[np.ix_(is_reserved, is_reserved)] - gain @ cross.T
        _, log_det = np.linalg.slogdet(spread)
        chi2 = remainder @ np.linalg.solve(spread, remainder)
        count = is_reserved.sum() * np.log(2 * np.pi)
        return chi2, -0.5 * (chi2 + log_det + count) - np.log(sigma.ravel()[is_reserved]).sum()


@pytest.fixture(scope="module", params=[3, TRUE_ORDER], ids=["too-low", "true"])
def linear(request, make_dense):
    """A problem of a given order, with normal priors, and its linear model."""
    orbit = make_orbit(max_degree=TRUE_ORDER, **NEAR)
    full = build_problem(orbit.data, orbit.instrument, EXACT)
    normal = full.priors._replace(is_gamma=np.zeros_like(full.priors.is_gamma))
    problem = at_order(replace(full, priors=normal), request.param)
    return problem, LinearModel(problem, make_dense, EXACT)


def test_evidence_equals_the_density_of_the_data(linear):
    """This includes the normalisation of every prior; the value is of the order of thousands."""
    problem, model = linear
    log_sigma = float(np.log(problem.measurements.sigma).sum())
    objective, n = model.mode.trace[-1].objective, problem.measurements.sigma.size
    found = log_evidence(model.mode, problem.priors, objective, log_sigma, n)
    assert found == pytest.approx(model.log_density(problem.measurements.sigma), abs=1e-6)


def test_figures_of_reserved_sources_equal_the_predictive_ones(linear):
    problem, model = linear
    reserved = reserved_sources(problem)
    found = judge_reserved(problem, model.mode, reserved, EXACT)
    is_reserved = np.repeat(reserved[problem.measurements.index.source], 2)
    chi2, log_density = model.prediction(is_reserved, problem.measurements.sigma)
    assert found.dof == is_reserved.sum()
    assert found.chi2 == pytest.approx(chi2, rel=1e-4)
    assert found.log_density == pytest.approx(log_density, abs=1e-2)


def test_a_tenth_of_the_non_reference_sources_is_reserved(problem):
    reserved = reserved_sources(problem)
    is_reference = problem.sources["is_reference"].to_numpy(bool)
    assert reserved.sum() == np.ceil(0.1 * (~is_reference).sum())
    assert not (reserved & is_reference).any()
    np.testing.assert_array_equal(reserved, reserved_sources(problem))


def test_without_reserved_sources_there_is_no_predictive_density(problem):
    references_only = replace(problem, sources=problem.sources.assign(is_reference=True))
    reserved = reserved_sources(references_only)
    found = judge_reserved(
        references_only, find_mode(problem, FitSettings()), reserved, FitSettings()
    )
    assert found.dof == 0
    assert np.isnan([found.chi2, found.log_density]).all()


@pytest.mark.parametrize(
    ("spare", "highest"), [(1, 0), (7, 2), (37, 5), (1000, MAX_ORDER)], ids=str
)
def test_orders_held_leave_at_least_one_spare_coordinate(spare, highest):
    layout, n_src = VectorLayout(8, len(terms(4)), 4), 51
    bare = 2 * n_src + layout.size - 2 * layout.n_coef
    n_obs = (bare + spare + 1) // 2
    assert max(orders_held(n_obs, n_src, layout), default=-1) == max(highest, highest == 0)


@pytest.fixture(scope="module")
def short_orbit():
    """Two exposures without distortion, with few enough data to limit the number of orders."""
    orbit = make_orbit(max_degree=1)
    rows = orbit.data.measurements
    is_kept = rows["field_id"].eq(0) & rows["plate_id"].le(1)
    return orbit._replace(data=orbit_of_rows(orbit.data, is_kept.to_numpy()))


COMPARED = FitSettings(order=HIGHEST, compare_orders=True)


@pytest.fixture(scope="module")
def fitter(short_orbit):
    return OrbitFitter(short_orbit.data, short_orbit.instrument)


@pytest.fixture(scope="module")
def compared(fitter):
    return fitter.fit(COMPARED)


@pytest.mark.slow
def test_orders_with_too_many_parameters_are_omitted(compared):
    assert compared.orders["order"].tolist() == list(range(HIGHEST + 1))


@pytest.mark.slow
def test_comparison_does_not_change_the_fit(short_orbit, compared):
    without_comparison = fit_orbit(
        short_orbit.data, short_orbit.instrument, FitSettings(order=HIGHEST)
    )
    assert without_comparison.orders is None
    assert compared.sources.equals(without_comparison.sources)
    without_times = {**compared.summary, "seconds": {}}
    assert without_times == {**without_comparison.summary, "seconds": {}}
    assert set(compared.summary["seconds"]) - set(without_comparison.summary["seconds"]) == {
        "orders"
    }


@pytest.mark.slow
def test_what_if_of_another_order_keeps_the_comparison(fitter, compared):
    changed = fitter.what_if(COMPARED.with_(order=5))
    assert changed.orders.equals(compared.orders)


@pytest.mark.slow
def test_other_what_ifs_have_no_comparison(fitter, compared):
    assert compared.orders is not None
    changed = fitter.what_if(COMPARED.with_(prior_widths={"distortion_x": 0.5}))
    assert changed is not None
    assert changed.orders is None


def test_flat_distortion_prior_gives_predictions_without_evidence(short_orbit):
    flat = FitSettings(order=HIGHEST, prior_widths={"distortion_y": np.inf})
    problem = build_problem(short_orbit.data, short_orbit.instrument, flat)
    orders = compare_orders(problem, flat)
    assert orders["log_evidence"].isna().all()
    assert orders["held_out_log_density"].notna().all()


def test_walk_of_a_term_ends_with_the_term(short_orbit):
    walking = FitSettings(order=2, drift_walk=2)
    problem = build_problem(short_orbit.data, short_orbit.instrument, walking)
    orders = compare_orders(problem, walking).set_index("order")
    lower = fit_orbit(short_orbit.data, short_orbit.instrument, walking.with_(order=1)).summary
    for name in ("chi2", "effective_parameters", "log_evidence"):
        assert orders.loc[1, name] == pytest.approx(lower[name], rel=1e-4)
    assert orders["n_terms"].tolist() == [0, 0, 6]


def test_comparison_can_be_cancelled(short_orbit):
    def cancel(row):
        raise CancelledError("now")

    problem = build_problem(short_orbit.data, short_orbit.instrument, COMPARED)
    with pytest.raises(CancelledError):
        compare_orders(problem, COMPARED, cancel)
