"""The svi engine against gauss-newton, and what happens between its blocks of steps."""

from dataclasses import replace
from functools import partial

import jax
import numpy as np
import pytest
from numpyro.infer import Trace_ELBO

from solver.data.engine_settings import WARPFIELD, SviSettings
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import find_mode
from solver.engines.guide import Means, MirroredElbo, draws, guide
from solver.engines.numpyro_model import evidence_of, in_coordinates
from solver.engines.svi import blocks, rate, start_state, variational
from solver.errors import CancelledError
from solver.fit import OrbitFitter
from solver.linear.leverage import covariances
from solver.linear.whitening import whitened
from solver.problem.problem import build_problem

SETTINGS = FitSettings(engine="svi")


# Thousands of steps are worth an optimised program.
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
def test_agrees_with_gauss_newton_from_a_cold_start(found, exact):
    estimate, states = found
    shift = estimate.mode.sources - exact.sources
    assert np.abs(shift / sigmas(covariances(exact.reduced).source)).max() < 0.05
    assert estimate.mode.status is FitStatus.AT_REST
    assert states[0].trace[0].largest_step > 100.0


@pytest.mark.slow
def test_its_sigmas_are_the_conditional_ones(found, exact):
    expected = sigmas(exact.reduced.conditional_covariance())
    np.testing.assert_allclose(sigmas(found[0].conditional), expected, rtol=0.02)


@pytest.mark.slow
def test_widths_are_found_and_not_only_kept(svi_problem, exact):
    """From widths three times too large at the mode it comes back to the right ones."""
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
def test_loss_falls_and_comes_to_rest(found):
    """With the guide at its best, draws hardly matter: they would scatter the loss by eight."""
    losses = found[0].losses
    assert losses[:100].min() > losses[-1] + 1e3
    assert losses[-200:].std() < 0.5


def test_same_seed_same_answer_and_another_one_another(svi_problem):
    few = replace(SETTINGS, svi=SviSettings(steps=100, max_steps=100))
    first, again, other = (
        variational(svi_problem, replace(few, svi=replace(few.svi, seed=seed))).mode.sources
        for seed in (0, 0, 1)
    )
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.0


@pytest.mark.slow
def test_stopped_run_goes_on_as_if_it_had_not_been(svi_problem, found):
    """Block for block, in step, means, widths and losses."""
    _, states = found
    begun = states[9]
    rest = list(blocks(svi_problem, SETTINGS, begun))
    assert rest[0].step == begun.step + SETTINGS.svi.block
    for name in ("theta", "sources", "scale", "losses"):
        np.testing.assert_array_equal(getattr(rest[-1], name), getattr(states[-1], name))


def test_cancelled_fit_is_gone_on_with(small_orbit):
    settings = replace(SETTINGS, svi=SviSettings(steps=200, patience=50))
    fitter = OrbitFitter(small_orbit.data, small_orbit.instrument)

    def cancel(row):
        if row.iteration == 100:
            raise CancelledError("now")

    with pytest.raises(CancelledError):
        fitter.fit(settings, cancel)
    seen = []
    result = fitter.fit(settings, lambda row: seen.append(row.iteration))
    assert seen[0] == 100 + settings.svi.block
    assert list(result.losses["step"]) == list(range(1, seen[-1] + 1))


def test_other_settings_start_anew(small_orbit):
    settings = replace(SETTINGS, svi=SviSettings(steps=100, max_steps=100))
    fitter = OrbitFitter(small_orbit.data, small_orbit.instrument)

    def cancel(row):
        raise CancelledError("now")

    with pytest.raises(CancelledError):
        fitter.fit(settings, cancel)
    seen = []
    fitter.fit(settings.with_(order=4), lambda row: seen.append(row.iteration))
    assert seen[0] == settings.svi.block


@pytest.mark.slow
def test_published_coordinates_get_nowhere(svi_problem, exact):
    """Why the engine works in whitened ones."""
    options = replace(WARPFIELD, steps=3000, max_steps=3000, patience=100)
    estimate = variational(svi_problem, replace(SETTINGS, svi=options))
    assert estimate.mode.trace[-1].largest_step > 100.0
    assert estimate.mode.status is not FitStatus.AT_REST


def test_loss_at_rest_away_from_the_mode_is_no_solution(svi_problem, exact):
    """A rate that is too low makes the loss rest anywhere; the linearised problem says so."""
    options = SviSettings(first_rate=2e-9, last_rate=1e-9, steps=100, patience=50, max_steps=100)
    far = start_state(svi_problem, options)._replace(theta=exact.theta, sources=exact.sources + 0.5)
    estimate = variational(svi_problem, replace(SETTINGS, svi=options), start=far)
    assert estimate.mode.status is FitStatus.STALLED
    assert not estimate.mode.status.is_solution


def test_limit_of_steps_is_said(svi_problem):
    options = SviSettings(steps=50, max_steps=100, patience=200)
    estimate = variational(svi_problem, replace(SETTINGS, svi=options))
    assert estimate.mode.status is FitStatus.MAX_STEPS


def test_rate_falls_over_seven_decades_and_stays():
    rates = rate(SviSettings(steps=2000), (500, 1e4), np.array([500, 1500, 2500, 3500]))
    np.testing.assert_allclose(rates, [1e4, np.sqrt(1e4 * 1e-3), 1e-3, 1e-3], rtol=1e-12)


@pytest.mark.slow
def test_loss_at_rest_away_from_the_mode_starts_the_rate_again(svi_problem, exact):
    """As the paper's runs were restarted by hand, until the mode is reached."""
    options = SviSettings(first_rate=1.0, steps=300, patience=50)
    moved = exact.sources + 10.0 * np.random.default_rng(1).normal(size=exact.sources.shape)
    far = start_state(svi_problem, options)._replace(theta=exact.theta, sources=moved)
    states = list(blocks(svi_problem, replace(SETTINGS, svi=options), far))
    assert states[-1].cycle[0] > options.steps
    assert states[-1].trace[-1].largest_step < options.tolerance


def test_loss_that_creeps_away_from_the_mode_starts_the_rate_again(svi_problem, exact):
    """It would never come to rest: with the lowest rate the mode is out of reach."""
    options = SviSettings(steps=100, patience=50, max_steps=200)
    far = start_state(svi_problem, options)._replace(
        step=100,
        theta=exact.theta,
        sources=exact.sources + 0.5,
        losses=np.linspace(1e6, 0.0, 100),
    )
    after = next(blocks(svi_problem, replace(SETTINGS, svi=options), far))
    begun, highest = after.cycle
    assert begun == 100
    assert highest == pytest.approx(min(options.first_rate, after.trace[-1].largest_step))


def test_draws_are_of_either_sign_as_often():
    values = np.asarray(draws(jax.random.key(3), 40, (2, 5000)))
    np.testing.assert_array_equal(np.abs(values), 1.0)
    # Five deviations of a mean of 400,000.
    assert abs(values.mean()) < 0.008
    assert np.abs(values.mean(axis=0)).max() < 0.95


def test_with_its_mirror_image_one_draw_is_as_good_as_another(svi_problem, exact):
    """A sigma from the mode, where single draws scatter by more than the way is long."""
    evidence = jax.device_put(evidence_of(svi_problem))
    coordinates = whitened(replace(exact.reduced, at=(exact.theta, exact.sources)))
    shape = (2, svi_problem.n_src)
    means = Means(np.zeros(svi_problem.layout.size), np.ones(shape), np.ones(shape))

    @partial(jax.jit, static_argnums=0)
    def slope(elbo, draw):
        def loss(sources):
            return elbo.loss(
                jax.random.key(0),
                {},
                lambda _: in_coordinates(evidence, coordinates),
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
