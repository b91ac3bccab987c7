import numpy as np
import pytest
from scipy import stats

from solver.data.parameters import BY_NAME, CALIBRATION_GROUPS
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.problem.priors import Priors, group_widths
from solver.problem.problem import build_problem

CENTRE, WIDTH = 4.86e6, 5729.6


def gamma_prior(centre=CENTRE, width=WIDTH):
    return Priors(np.array([centre]), np.array([width]), np.array([True]), np.zeros((0, 2, 2)))


def scipy_gamma(centre=CENTRE, width=WIDTH):
    return stats.gamma((centre / width) ** 2, scale=width**2 / centre)


NO_SOURCES = np.zeros((0, 2))


@pytest.fixture
def mixed():
    """A normal, a flat and a gamma prior, and two sources."""
    precision = np.linalg.inv(np.array([[[4.0, 1.0], [1.0, 9.0]], [[1e6, 0.0], [0.0, 1e6]]]))
    return Priors(
        np.array([10.0, 0.0, CENTRE]),
        np.array([0.1, np.inf, WIDTH]),
        np.array([False, False, True]),
        precision,
    )


@pytest.mark.parametrize("offset", [-3e4, -700.0, 0.0, 1.0, 5e3, 5e4])
def test_gamma_penalty_equals_that_of_scipy(offset):
    density = scipy_gamma()
    expected = -2.0 * (density.logpdf(CENTRE + offset) - density.logpdf(CENTRE))
    found = gamma_prior().penalty(np.array([offset]), NO_SOURCES)
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_gamma_prior_has_the_given_mean_and_width():
    density = scipy_gamma()
    assert density.mean() == pytest.approx(CENTRE)
    assert density.std() == pytest.approx(WIDTH)


@pytest.mark.parametrize("offset", [-1.5, -0.3, 0.0, 0.4, 2.5])
def test_derivatives_of_the_gamma_penalty_equal_finite_differences(offset):
    # A wide gamma prior, whose skewness matters.
    prior, step = gamma_prior(5.0, 2.0), 1e-4

    def half_penalty(at):
        return 0.5 * prior.penalty(np.array([at]), NO_SOURCES)

    low, here, high = (half_penalty(offset + d) for d in (-step, 0.0, step))
    at = np.array([offset])
    assert prior.gradient(at)[0] == pytest.approx((high - low) / (2 * step), abs=1e-6)
    assert prior.hessian_diagonal(at)[0] == pytest.approx(
        (high - 2 * here + low) / step**2, abs=1e-4
    )


def test_gamma_penalty_forbids_values_below_zero():
    """A finite penalty, however large, is smaller than the chi2 of a start that is far off."""
    inside, limit, outside = (
        gamma_prior(5.0, 2.0).penalty(np.array([x]), NO_SOURCES) for x in (-4.0, -5.0, -6.0)
    )
    assert np.isfinite(inside)
    assert np.isinf([limit, outside]).all()


def test_derivatives_of_a_mixed_prior_equal_finite_differences(mixed):
    theta, steps = np.array([0.03, 12.0, 900.0]), (1e-3, 1.0, 10.0)
    for i, (unit, step) in enumerate(zip(np.eye(3), steps, strict=True)):
        low, high = (mixed.penalty(theta + d * unit, np.zeros((2, 2))) for d in (-step, step))
        expected = 0.5 * (high - low) / (2 * step)
        assert mixed.gradient(theta)[i] == pytest.approx(expected, rel=1e-5, abs=1e-8)


def test_flat_prior_has_no_penalty_gradient_or_hessian(mixed):
    theta = np.array([0.0, 1e9, 0.0])
    assert mixed.penalty(theta, np.zeros((2, 2))) == 0.0
    assert mixed.gradient(theta)[1] == 0.0
    assert mixed.hessian_diagonal(theta)[1] == 0.0


def test_sources_are_penalised_with_their_correlation(mixed):
    sources = np.array([[1.0, -2.0], [300.0, 0.0]])
    covariance = np.linalg.inv(mixed.precision)
    density = [stats.multivariate_normal(np.zeros(2), c) for c in covariance]
    expected = -2.0 * sum(
        d.logpdf(s) - d.logpdf(np.zeros(2)) for d, s in zip(density, sources, strict=True)
    )
    assert mixed.penalty(np.zeros(3), sources) == pytest.approx(expected)


def test_log_normalisation_equals_the_log_density_at_the_centres(mixed):
    expected = stats.norm(0.0, 0.1).logpdf(0.0) + scipy_gamma().logpdf(CENTRE)
    for covariance in np.linalg.inv(mixed.precision):
        expected += stats.multivariate_normal(np.zeros(2), covariance).logpdf(np.zeros(2))
    assert mixed.log_normalisation() == pytest.approx(expected, abs=1e-5)


def test_relative_width_is_a_fraction_of_the_centre():
    centres = {g.name: np.array([-8.0, 4.0]) for g in CALIBRATION_GROUPS}
    widths = group_widths(FitSettings(prior_widths={"pitch_x": 0.02}), centres)
    np.testing.assert_allclose(widths["pitch_x"], [0.16, 0.08])


def test_absolute_width_comes_from_the_settings_or_the_table():
    centres = {g.name: np.array([-8.0, 4.0]) for g in CALIBRATION_GROUPS}
    widths = group_widths(FitSettings(prior_widths={"detector_x": 7.0}), centres)
    np.testing.assert_array_equal(widths["detector_x"], 7.0)
    np.testing.assert_array_equal(widths["detector_y"], BY_NAME["detector_y"].width)
    assert np.isinf(widths["position_angle"]).all()


def test_gamma_prior_without_a_mode_near_its_centre_is_refused(small_orbit):
    orbit = small_orbit.data, small_orbit.instrument
    widest = r"prior of focal_length: expected a width of 1\.\d+e\+06 um or less"
    with pytest.raises(InputError, match=widest):
        build_problem(*orbit, FitSettings(prior_widths={"focal_length": 1e7}))
    flat = FitSettings(prior_widths={"focal_length": np.inf})
    assert np.isinf(build_problem(*orbit, flat).priors.width).any()
