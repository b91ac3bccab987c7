"""The svi engine: the paper's stochastic variational inference, in whitened coordinates.

Paper, Eq. (method:posterior:svi) and section "Optimization": the guide is normal for the sources
and a point for the calibration, the loss is minus the evidence lower bound, and Adam follows its
gradient with a learning rate that falls over seven decades. In the units of the published code
Adam does not get near the mode; here it moves in coordinates whitened by the linearised problem
(`solver.linear.whitening`). After every block of steps the coordinates are recomputed and Adam's
averages are reset.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import jax
import numpy as np
import optax
from jaxtyping import Float, Int

from solver.data.engine_settings import SviSettings
from solver.data.parameters import SOURCES
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.engines.adam_steps import Stepping, adam_steps
from solver.engines.estimate import Estimate
from solver.engines.gauss_newton import Iteration, Mode, downhill, largest_step
from solver.engines.numpyro_model import model_input
from solver.engines.svi_guide import Means
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import ReducedSystem, eliminate_sources
from solver.linear.whitening import Coordinates, in_bare_units, whitened
from solver.problem.problem import Problem

# Largest step of a parameter, as a fraction of its prior width: along prior-dominated directions
# one unit of whitened coordinates is as long as the prior is wide.
_LARGEST_STEP = 0.25
# Largest relative step of the guide's widths.
_LARGEST_SCALE_STEP = 0.05
# Largest fall of a loss that counts as constant.
_UNCHANGED = 0.1


class SviState(NamedTuple):
    """State between two blocks of steps, from which the engine can resume.

    Attributes
    ----------
    step : number of steps so far
    cycle : step and learning rate at which the rate began to fall
    theta, sources : means of the guide, in offsets from the origins
    scale : standard deviations of the guide for the sources, in free coordinates
    losses : loss of every step so far
    trace : one row for each block
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
    """Fit the guide, starting from the prior centres or from an earlier state.

    Parameters
    ----------
    progress : called after every block of steps; an exception it raises stops the fit
    start : state to resume from
    keep : called with the state after every block, before `progress`

    Returns
    -------
    The guide's means and the covariance of its sources, which is conditional; the marginal
    covariance comes from the problem linearised there.
    """
    options = settings.svi
    state = start or start_state(problem, options)
    for next_state in blocks(problem, settings, state):
        state = next_state
        keep(state)
        progress(state.trace[-1])
    ahead = _linearise_ahead(problem, state)
    equations = accumulate(problem, state.theta, state.sources)
    reduced = eliminate_sources(equations, problem.priors)
    mode = Mode(
        state.theta, state.sources, reduced, _status(state, ahead, options), state.trace, equations
    )
    if ahead.reduced is None:
        return Estimate(mode, losses=state.losses)
    covariance = _coordinates(problem, ahead.reduced, options).covariance(state.scale)
    return Estimate(mode, conditional=covariance, losses=state.losses)


def start_state(problem: Problem, options: SviSettings) -> SviState:
    """Return the initial state, with all parameters at their prior centres."""
    theta, sources = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    scale = np.ones((2, problem.n_src))
    if not options.conditioned:
        # Prior widths, in degrees.
        covariance = np.linalg.inv(problem.priors.precision)
        scale = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).T / SOURCES.per_value_unit
    return SviState(0, (0, options.first_rate), theta, sources, scale, np.empty(0), [])


def blocks(problem: Problem, settings: FitSettings, state: SviState) -> Iterator[SviState]:
    """Yield the state after each further block of steps, until the loss is constant.

    If the learning rate has fallen but the mode is still distant, the rate is raised to reach it
    and falls again, as the paper's authors did by hand.
    """
    options, spent = settings.svi, state.trace[-1].seconds if state.trace else 0.0
    begin = time.perf_counter() - spent
    inputs = jax.device_put(model_input(problem))
    while state.step < options.max_steps:
        ahead = _linearise_ahead(problem, state)
        if ahead.reduced is None:
            return
        is_near = ahead.distance < options.tolerance or not options.conditioned
        if is_near and _is_constant(state, options):
            return
        # At the lowest rate the loss may fall slowly for ever, so it need not be constant here.
        if not is_near and _has_fallen(state, options):
            state = state._replace(cycle=(state.step, min(options.first_rate, ahead.distance)))
        coordinates = _coordinates(problem, ahead.reduced, options)
        schedule = rate(options, state.cycle, np.arange(state.step, state.step + options.block))
        limits = _limits(problem, coordinates, options)
        moved, losses = adam_steps(
            Stepping(inputs, coordinates, limits, schedule),
            Means(np.zeros_like(state.theta), np.zeros_like(state.scale), state.scale),
            jax.random.fold_in(jax.random.key(options.seed), state.step),
        )
        theta, sources = coordinates.place(moved.calibration, moved.sources)
        row = Iteration(
            state.step + options.block,
            2.0 * float(losses.mean()),
            ahead.chi2,
            ahead.distance,
            ahead.parameter,
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
    """Return Adam's learning rate at some steps: it falls geometrically, then stays constant."""
    first, highest = cycle
    ratio = options.last_rate / options.first_rate
    lowest = min(options.last_rate, highest)
    schedule = optax.exponential_decay(highest, options.steps, ratio, end_value=lowest)
    return np.asarray(schedule(step - first))


class _Lookahead(NamedTuple):
    """The linearised problem near a state.

    `distance` is the largest distance of a parameter from its mode, in sigmas, and `parameter`
    its name; `reduced` is the problem linearised at that mode, with the state as its origin.
    """

    chi2: float
    distance: float
    parameter: str
    reduced: ReducedSystem | None


def _linearise_ahead(problem: Problem, state: SviState) -> _Lookahead:
    """Linearise the problem at the state, and again at the mode found there.

    The second linearisation whitens better, because along prior-dominated directions the
    posterior is curved by more than its width.
    """
    equations = accumulate(problem, state.theta, state.sources)
    chi2 = equations.gradient.chi2
    reduced = eliminate_sources(equations, problem.priors)
    if reduced is None:
        return _Lookahead(chi2, np.inf, "", None)
    step = reduced.solve(*downhill(problem, state.theta, state.sources, equations.gradient))
    distance, parameter = largest_step(problem, step, reduced)
    at_mode = accumulate(problem, state.theta + step[0], state.sources + step[1])
    ahead = eliminate_sources(at_mode, problem.priors)
    return _Lookahead(chi2, distance, parameter, ahead and replace(ahead, at=reduced.at))


def _coordinates(problem: Problem, reduced: ReducedSystem, options: SviSettings) -> Coordinates:
    return whitened(reduced) if options.conditioned else in_bare_units(problem.layout, reduced.at)


def _is_constant(state: SviState, options: SviSettings) -> bool:
    """Return whether the rate has fallen and the loss was constant over `patience` steps."""
    if not _has_fallen(state, options):
        return False
    patience = options.patience
    before, after = state.losses[-2 * patience : -patience], state.losses[-patience:]
    noise = np.hypot(before.std(), after.std()) / np.sqrt(patience)
    return bool(before.mean() - after.mean() < max(_UNCHANGED, 3.0 * noise))


def _has_fallen(state: SviState, options: SviSettings) -> bool:
    """Return whether the rate has fallen to its end, over at least twice `patience` steps."""
    first, highest = state.cycle
    # Fraction of a full fall that starts at the rate of this cycle.
    fraction = np.log(highest / options.last_rate) / np.log(options.first_rate / options.last_rate)
    return bool(state.step >= first + max(fraction * options.steps, 2 * options.patience))


def _status(state: SviState, ahead: _Lookahead, options: SviSettings) -> FitStatus:
    if ahead.reduced is None:
        return FitStatus.SINGULAR
    if not _is_constant(state, options):
        return FitStatus.MAX_STEPS
    return FitStatus.AT_REST if ahead.distance < options.tolerance else FitStatus.STALLED


def _limits(problem: Problem, coordinates: Coordinates, options: SviSettings) -> Means:
    """Return the largest step of every parameter of the guide, in free coordinates."""
    if not options.conditioned:
        return Means(*(np.full(1, np.inf) for _ in Means._fields))
    priors = problem.priors
    independent = priors.walks.independent(np.asarray(coordinates.calibration))
    longest = 1.0 / np.abs(independent / priors.width[:, None]).max(axis=0)
    unlimited = np.full(1, np.inf)
    return Means(_LARGEST_STEP * longest, unlimited, np.full(1, _LARGEST_SCALE_STEP))
