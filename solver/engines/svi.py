"""The svi engine: the paper's stochastic variational inference, in whitened coordinates.

Paper, Eq. (method:svi) and section "Optimization": the guide is normal for the sources and a
point for everything else, the loss is minus the evidence lower bound, and Adam follows its
gradient with a rate that falls over seven decades. In the published code's own units Adam
gets nowhere near the mode; here it moves in coordinates whitened by the linearised problem
(`solver.linear.whitening`), made anew after every block of steps, when Adam starts afresh as well.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float, Int, PRNGKeyArray
from numpyro.infer import SVI

from solver.data.engine_settings import SviSettings
from solver.data.parameters import SOURCES
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.engines.estimate import Estimate
from solver.engines.gauss_newton import Iteration, Mode, downhill, largest_step
from solver.engines.guide import SITES, Means, MirroredElbo, draws, guide
from solver.engines.numpyro_model import Evidence, evidence_of, in_coordinates
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import ReducedSystem, eliminate_sources
from solver.linear.whitening import Coordinates, in_bare_units, whitened
from solver.model.forward import AnyArray
from solver.problem.problem import Problem

# Paper, table "Parameters of the ADAM optimizer".
_BETA_1, _BETA_2, _EPSILON = 0.99, 0.999, 1e-4
# No step moves a parameter by more than this share of its prior's width: where the priors
# alone hold a direction, one unit of whitened coordinates is as wide as they are.
_LARGEST_SHARE = 0.25
# No step changes the guide's widths by more than this share.
_LARGEST_CHANGE = 0.05
# A loss that has fallen by less than this has not changed: the same for all parameters together.
_UNCHANGED = 0.1


class SviState(NamedTuple):
    """Where the engine is between two blocks of steps: all it needs to go on.

    Attributes
    ----------
    step : how many were made
    cycle : step and learning rate at which the rate began to fall
    theta, sources : means of the guide, in offsets from the origins
    scale : the guide's deviation of the sources, in free coordinates
    losses : of every step so far
    trace : a row for each block
    """

    step: int
    cycle: tuple[int, float]
    theta: Float[np.ndarray, " calib"]
    sources: Float[np.ndarray, "src 2"]
    scale: Float[np.ndarray, "2 src"]
    losses: Float[np.ndarray, " step"]
    trace: list[Iteration]


def variational(
    problem: Problem,
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
    start: SviState | None = None,
    keep: Callable[[SviState], None] = lambda _: None,
) -> Estimate:
    """Fit the guide, from the catalogue or from where an earlier call was stopped.

    Parameters
    ----------
    progress : called after every block of steps; what it raises stops the fit
    start : the state to go on from
    keep : given the state after every block, before `progress` is called

    Returns
    -------
    The guide's means and the covariance of its sources, which is the conditional one; the
    marginal one is that of the linearised problem there.
    """
    options = settings.svi
    state = start or start_state(problem, options)
    for after in blocks(problem, settings, state):
        state = after
        keep(state)
        progress(state.trace[-1])
    view = _look_ahead(problem, state)
    equations = accumulate(problem, state.theta, state.sources)
    reduced = eliminate_sources(equations, problem.priors)
    mode = Mode(
        state.theta, state.sources, reduced, _status(state, view, options), state.trace, equations
    )
    if view.reduced is None:
        return Estimate(mode, losses=state.losses)
    covariance = _coordinates(problem, view.reduced, options).covariance(state.scale)
    return Estimate(mode, conditional=covariance, losses=state.losses)


def start_state(problem: Problem, options: SviSettings) -> SviState:
    """Return where the engine starts: the centres of all priors."""
    theta, sources = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    scale = np.ones((2, problem.n_src))
    if not options.conditioned:
        # The priors' own widths, in degrees.
        covariance = np.linalg.inv(problem.priors.precision)
        scale = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).T / SOURCES.per_value_unit
    return SviState(0, (0, options.first_rate), theta, sources, scale, np.empty(0), [])


def blocks(problem: Problem, settings: FitSettings, state: SviState) -> Iterator[SviState]:
    """Go on from `state`, a block of steps at a time, until the loss is at rest.

    If the rate has fallen and the mode is still away, it falls once more from where that is within
    reach, as it was restarted by hand for the paper.
    """
    options, spent = settings.svi, state.trace[-1].seconds if state.trace else 0.0
    begin = time.perf_counter() - spent
    evidence = jax.device_put(evidence_of(problem))
    while state.step < options.max_steps:
        view = _look_ahead(problem, state)
        if view.reduced is None:
            return
        is_near = view.distance < options.tolerance or not options.conditioned
        if is_near and _is_at_rest(state, options):
            return
        # With the lowest rate a loss may creep for ever: it need not rest to be too far away.
        if not is_near and _has_fallen(state, options):
            state = state._replace(cycle=(state.step, min(options.first_rate, view.distance)))
        coordinates = _coordinates(problem, view.reduced, options)
        moved, losses = _run_block(
            evidence,
            jax.device_put(coordinates),
            Means(np.zeros_like(state.theta), np.zeros_like(state.scale), state.scale),
            _limits(problem, coordinates, options),
            jax.random.fold_in(jax.random.key(options.seed), state.step),
            rate(options, state.cycle, np.arange(state.step, state.step + options.block)),
        )
        theta, sources = coordinates.place(moved.calibration, moved.sources)
        row = Iteration(
            state.step + options.block,
            2.0 * float(losses.mean()),
            view.chi2,
            view.distance,
            view.parameter,
            0.0,
            time.perf_counter() - begin,
        )
        state = SviState(
            row.iteration,
            state.cycle,
            np.asarray(theta),
            np.asarray(sources),
            np.asarray(moved.scale),
            np.concatenate([state.losses, losses]),
            [*state.trace, row],
        )
        yield state


def rate(
    options: SviSettings, cycle: tuple[int, float], step: Int[np.ndarray, " step"]
) -> Float[np.ndarray, " step"]:
    """Return Adam's learning rate at some steps: it falls geometrically, and then stays."""
    first, highest = cycle
    ratio = options.last_rate / options.first_rate
    lowest = min(options.last_rate, highest)
    schedule = optax.exponential_decay(highest, options.steps, ratio, end_value=lowest)
    return np.asarray(schedule(step - first))


class _View(NamedTuple):
    """What the linearised problem says of a state.

    `distance` is that of its mode, in sigmas, and `parameter` the one that is furthest away;
    `reduced` is the problem linearised at that mode, with the state itself as its origin.
    """

    chi2: float
    distance: float
    parameter: str
    reduced: ReducedSystem | None


def _look_ahead(problem: Problem, state: SviState) -> _View:
    """Linearise the problem at the state, and again where that puts the mode.

    The second one is the better whitening: the posterior bends by more than its own width in
    what the priors alone hold.
    """
    here = accumulate(problem, state.theta, state.sources)
    chi2 = here.gradient.chi2
    reduced = eliminate_sources(here, problem.priors)
    if reduced is None:
        return _View(chi2, np.inf, "", None)
    step = reduced.solve(*downhill(problem, state.theta, state.sources, here.gradient))
    distance, parameter = largest_step(problem, step, reduced)
    there = accumulate(problem, state.theta + step[0], state.sources + step[1])
    ahead = eliminate_sources(there, problem.priors)
    return _View(chi2, distance, parameter, ahead and replace(ahead, at=reduced.at))


def _coordinates(problem: Problem, reduced: ReducedSystem, options: SviSettings) -> Coordinates:
    return whitened(reduced) if options.conditioned else in_bare_units(problem.layout, reduced.at)


def _is_at_rest(state: SviState, options: SviSettings) -> bool:
    """Return whether the rate has fallen and the loss not changed for as long as asked for."""
    if not _has_fallen(state, options):
        return False
    patience = options.patience
    before, after = state.losses[-2 * patience : -patience], state.losses[-patience:]
    noise = np.hypot(before.std(), after.std()) / np.sqrt(patience)
    return bool(before.mean() - after.mean() < max(_UNCHANGED, 3.0 * noise))


def _has_fallen(state: SviState, options: SviSettings) -> bool:
    """Return whether the rate has fallen, over as many steps as a rest is looked for in."""
    first, highest = state.cycle
    # The share of the whole fall that is left from there.
    share = np.log(highest / options.last_rate) / np.log(options.first_rate / options.last_rate)
    return bool(state.step >= first + max(share * options.steps, 2 * options.patience))


def _status(state: SviState, view: _View, options: SviSettings) -> FitStatus:
    if view.reduced is None:
        return FitStatus.SINGULAR
    if not _is_at_rest(state, options):
        return FitStatus.MAX_STEPS
    return FitStatus.AT_REST if view.distance < options.tolerance else FitStatus.STALLED


def _limits(problem: Problem, coordinates: Coordinates, options: SviSettings) -> Means:
    """Return the longest step of every parameter of the guide, in free coordinates."""
    if not options.conditioned:
        return Means(*(np.full(1, np.inf) for _ in Means._fields))
    of_theta = 1.0 / np.abs(coordinates.calibration / problem.priors.width[:, None]).max(axis=0)
    free = np.full(1, np.inf)
    return Means(_LARGEST_SHARE * of_theta, free, np.full(1, _LARGEST_CHANGE))


@jax.jit
def _run_block(
    evidence: Evidence,
    coordinates: Coordinates,
    means: Means,
    limits: Means,
    key: PRNGKeyArray,
    rates: Float[AnyArray, " step"],
) -> tuple[Means, Float[Array, " step"]]:
    """Make a block of Adam's steps from a fresh start of its averages."""

    def model(draw: AnyArray) -> None:
        in_coordinates(evidence, coordinates)

    def guide_with(draw: AnyArray) -> None:
        guide(means, draw)

    adam = optax.chain(
        optax.scale_by_adam(_BETA_1, _BETA_2, _EPSILON),
        _bounded(lambda count: rates[count], limits),
    )
    engine = SVI(model, guide_with, adam, MirroredElbo())
    shape = means.scale.shape
    state = engine.init(key, jnp.zeros(shape))

    def step(state: Any, draw: AnyArray) -> tuple[Any, AnyArray]:  # noqa: ANN401 numpyro's
        return engine.update(state, draw)

    state, losses = jax.lax.scan(step, state, draws(key, len(rates), shape))
    found = engine.get_params(state)
    return Means(*(found[name] for name in SITES)), losses


def _bounded(
    schedule: Callable[[AnyArray], AnyArray], limits: Means
) -> optax.GradientTransformation:
    """Return steps against the gradient, at the schedule's rate or at most at the limits."""
    by_site = dict(zip(SITES, limits, strict=True))

    def update(updates: dict, state: AnyArray, params: object = None) -> tuple[dict, AnyArray]:
        del params
        now = schedule(state)
        rates = {name: jnp.minimum(now, limit) for name, limit in by_site.items()}
        return {name: -rates[name] * values for name, values in updates.items()}, state + 1

    return optax.GradientTransformation(lambda _: jnp.zeros((), int), update)
