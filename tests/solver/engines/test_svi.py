"""The svi engine compared with gauss-newton, and its behaviour between blocks of steps."""

from dataclasses import replace
from functools import partial

import jax
import numpy as np
import pytest
from numpyro.infer import Trace_ELBO

from solver.data.engine_settings import WARPFIELD, SviSettings
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.engines.estimate import Estimate
from solver.engines.gauss_newton import find_mode
from solver.engines.numpyro_model import in_coordinates, model_input
from solver.engines.svi import blocks, rate, start_state, variational
from solver.engines.svi_guide import Means, MirroredElbo, draws, guide
from solver.errors import CancelledError
from solver.fit import OrbitFitter
from solver.linear.covariances import covariances
from solver.linear.whitening import whitened
from solver.problem.problem import build_problem
from solver.results.summary import summarise
from solver.results.tables import solved_problem

SETTINGS = FitSettings(engine="svi")


# Thousands of steps run faster with compiler optimisation.
pytestmark = pytest.mark.usefixtures("optimised")


@pytest.fixture(scope="module")
def svi_problem(small_orbit, optimised):
    return build_problem(small_orbit.data, small_orbit.instrument, SETTINGS)


@pytest.fixture(scope="module")
def exact(svi_problem):
    return find_mode(svi_problem, SETTINGS)


@pytest.fixture(scope="module")
def found(svi_problem):
    states = []
    return variational(svi_problem, SETTINGS, keep=states.append), states


def sigmas(covariance):
    return np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))


@pytest.mark.slow
def test_svi_agrees_with_gauss_newton_from_a_cold_start(found, exact):
    estimate, states = found
    shift = estimate.mode.sources - exact.sources
    assert np.abs(shift / sigmas(covariances(exact.reduced).source)).max() < 0.05
    assert estimate.mode.status is FitStatus.AT_REST
    assert states[0].trace[0].largest_step > 100.0


@pytest.mark.slow
def test_sigmas_are_the_conditional_ones(found, exact):
    expected = sigmas(exact.reduced.conditional_covariance())
    np.testing.assert_allclose(sigmas(found[0].conditional), expected, rtol=0.02)


@pytest.mark.slow
def test_log_evidence_is_that_of_gauss_newton(svi_problem, exact, found):
    evidence = [
        summarise(solved_problem(svi_problem, one, one.mode.reduced), SETTINGS)["log_evidence"]
        for one in (Estimate(exact), found[0])
    ]
    assert evidence[1] == pytest.approx(evidence[0], abs=0.01)


@pytest.mark.slow
def test_wrong_widths_converge_to_the_right_ones(svi_problem, exact):
    """Widths three times too large at the mode converge to the right ones."""
    start = start_state(svi_problem, SETTINGS.svi)._replace(
        step=1000,
        theta=exact.theta,
        sources=exact.sources,
        scale=np.full((2, svi_problem.n_src), 3.0),
    )
    estimate = variational(svi_problem, SETTINGS, start=start)
    expected = sigmas(exact.reduced.conditional_covariance())
    np.testing.assert_allclose(sigmas(estimate.conditional), expected, rtol=0.02)


@pytest.mark.slow
def test_loss_falls_and_becomes_constant(found):
    """At the optimum the loss hardly depends on the draws; unmirrored ones scatter it by eight."""
    losses = found[0].losses
    assert losses[:100].min() > losses[-1] + 1e3
    assert losses[-200:].std() < 0.5


@pytest.mark.slow
def test_result_depends_only_on_the_seed(svi_problem):
    short = replace(SETTINGS, svi=SviSettings(steps=100, max_steps=100))
    first, again, other = (
        variational(svi_problem, replace(short, svi=replace(short.svi, seed=seed))).mode.sources
        for seed in (0, 0, 1)
    )
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.0


@pytest.mark.full
@pytest.mark.slow
def test_resumed_fit_equals_an_uninterrupted_one(svi_problem, found):
    """Steps, means, widths and losses are compared block by block."""
    _, states = found
    resumed_from = states[9]
    rest = list(blocks(svi_problem, SETTINGS, resumed_from))
    assert rest[0].step == resumed_from.step + SETTINGS.svi.block
    for name in ("theta", "sources", "scale", "losses"):
        np.testing.assert_array_equal(getattr(rest[-1], name), getattr(states[-1], name))


def test_cancelled_fit_is_resumed(small_orbit):
    settings = replace(SETTINGS, svi=SviSettings(steps=200, patience=50, max_steps=300))
    fitter = OrbitFitter(small_orbit.data, small_orbit.instrument)

    def cancel(row):
        if row.iteration == 100:
            raise CancelledError("now")

    with pytest.raises(CancelledError):
        fitter.fit(settings, cancel)
    iterations = []
    result = fitter.fit(settings, lambda row: iterations.append(row.iteration))
    assert iterations[0] == 100 + settings.svi.block
    assert list(result.losses["step"]) == list(range(1, iterations[-1] + 1))


@pytest.mark.full
@pytest.mark.slow
def test_other_settings_start_from_the_beginning(small_orbit):
    settings = replace(SETTINGS, svi=SviSettings(steps=100, max_steps=100))
    fitter = OrbitFitter(small_orbit.data, small_orbit.instrument)

    def cancel(row):
        raise CancelledError("now")

    with pytest.raises(CancelledError):
        fitter.fit(settings, cancel)
    iterations = []
    fitter.fit(
        settings.with_(prior_widths={"sources": 2.0}), lambda row: iterations.append(row.iteration)
    )
    assert iterations[0] == settings.svi.block


@pytest.mark.full
@pytest.mark.slow
def test_published_coordinates_do_not_converge(svi_problem, exact):
    """This is why the engine works in whitened coordinates."""
    options = replace(WARPFIELD, steps=3000, max_steps=3000, patience=100)
    estimate = variational(svi_problem, replace(SETTINGS, svi=options))
    assert estimate.mode.trace[-1].largest_step > 100.0
    assert estimate.mode.status is not FitStatus.AT_REST


def test_constant_loss_away_from_the_mode_is_no_solution(svi_problem, exact):
    """With too low a rate the loss is constant anywhere; the linearised problem shows it."""
    options = SviSettings(first_rate=2e-9, last_rate=1e-9, steps=100, patience=50, max_steps=100)
    far = start_state(svi_problem, options)._replace(theta=exact.theta, sources=exact.sources + 0.5)
    estimate = variational(svi_problem, replace(SETTINGS, svi=options), start=far)
    assert estimate.mode.status is FitStatus.STALLED
    assert not estimate.mode.status.is_solution


def test_limit_of_steps_is_reported(svi_problem):
    options = SviSettings(steps=50, max_steps=100, patience=200)
    estimate = variational(svi_problem, replace(SETTINGS, svi=options))
    assert estimate.mode.status is FitStatus.MAX_STEPS


def test_rate_falls_over_seven_decades_and_stays_constant():
    rates = rate(SviSettings(steps=2000), (500, 1e4), np.array([500, 1500, 2500, 3500]))
    np.testing.assert_allclose(rates, [1e4, np.sqrt(1e4 * 1e-3), 1e-3, 1e-3], rtol=1e-12)


@pytest.mark.full
@pytest.mark.slow
def test_constant_loss_away_from_the_mode_restarts_the_rate(svi_problem, exact):
    """The rate is raised until the mode is reached, as the paper's authors did by hand."""
    options = SviSettings(first_rate=1.0, steps=300, patience=50)
    moved = exact.sources + 10.0 * np.random.default_rng(1).normal(size=exact.sources.shape)
    far = start_state(svi_problem, options)._replace(theta=exact.theta, sources=moved)
    states = list(blocks(svi_problem, replace(SETTINGS, svi=options), far))
    assert states[-1].cycle[0] > options.steps
    assert states[-1].trace[-1].largest_step < options.tolerance


def test_slowly_falling_loss_away_from_the_mode_restarts_the_rate(svi_problem, exact):
    """The loss would never be constant: with the lowest rate the mode is out of reach."""
    options = SviSettings(steps=100, patience=50, max_steps=200)
    far = start_state(svi_problem, options)._replace(
        step=100,
        theta=exact.theta,
        sources=exact.sources + 0.5,
        losses=np.linspace(1e6, 0.0, 100),
    )
    after = next(blocks(svi_problem, replace(SETTINGS, svi=options), far))
    restarted_at, highest = after.cycle
    assert restarted_at == 100
    assert highest == pytest.approx(min(options.first_rate, after.trace[-1].largest_step))


def test_draws_have_either_sign_equally_often():
    values = np.asarray(draws(jax.random.key(3), 40, (2, 5000)))
    np.testing.assert_array_equal(np.abs(values), 1.0)
    # Five standard deviations of a mean of 400,000 values.
    assert abs(values.mean()) < 0.008
    assert np.abs(values.mean(axis=0)).max() < 0.95


def test_mirrored_gradient_does_not_depend_on_the_draw(svi_problem, exact):
    """One sigma from the mode, gradients of single draws scatter by more than their mean."""
    inputs = jax.device_put(model_input(svi_problem))
    coordinates = whitened(replace(exact.reduced, at=(exact.theta, exact.sources)))
    shape = (2, svi_problem.n_src)
    means = Means(np.zeros(svi_problem.layout.size), np.ones(shape), np.ones(shape))

    @partial(jax.jit, static_argnums=0)
    def slope(elbo, draw):
        def loss(sources):
            return elbo.loss(
                jax.random.key(0),
                {},
                lambda _: in_coordinates(inputs, coordinates),
                lambda one: guide(means._replace(sources=sources), one),
                draw,
            )

        return jax.grad(loss)(means.sources)

    pair = draws(jax.random.key(1), 2, shape)
    single, mirrored = (
        [np.asarray(slope(elbo, draw)) for draw in pair] for elbo in (Trace_ELBO(), MirroredElbo())
    )
    np.testing.assert_allclose(mirrored, 1.0, atol=0.01)
    assert np.abs(single[0] - single[1]).max() > 1.9


def test_steps_are_told_apart_from_the_iterations_that_find_outliers(small_orbit):
    settings = replace(SETTINGS, robust=True, svi=SviSettings(steps=50, patience=25, max_steps=50))
    fitter, steps, others = OrbitFitter(small_orbit.data, small_orbit.instrument), [], []
    fitter.fit(settings, lambda row: steps.append(row.iteration), beside=others.append)
    assert steps == [25, 50]
    assert len(others) > 1
    assert max(row.iteration for row in others) < 25
