"""A block of Adam's steps of the svi engine, which gives way to other work every few of them.

Paper, section "Optimization". What JAX has begun cannot be interrupted, and on a full orbit 25
steps take a second; so the steps run a few at a time.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float, PRNGKeyArray
from numpyro.infer import SVI
from numpyro.infer.svi import SVIState

from solver.engines.numpyro_model import ModelInput, in_coordinates
from solver.engines.svi_guide import SITES, Means, MirroredElbo, draws, guide
from solver.linear.whitening import Coordinates
from solver.model.forward import AnyArray
from solver.runtime.interruption import give_way

# Steps that nothing can interrupt.
_AT_ONCE = 5
# Paper, table "Parameters of the ADAM optimizer".
_BETA_1, _BETA_2, _EPSILON = 0.99, 0.999, 1e-4


class Stepping(NamedTuple):
    """What stays the same during a block of steps.

    Attributes
    ----------
    limits : largest step of every parameter of the guide, in free coordinates
    rates : Adam's learning rate at each step
    """

    inputs: ModelInput
    coordinates: Coordinates
    limits: Means
    rates: Float[AnyArray, " step"]


def adam_steps(
    stepping: Stepping, means: Means, key: PRNGKeyArray
) -> tuple[Means, Float[np.ndarray, " step"]]:
    """Make a block of Adam's steps, whose averages begin at zero.

    Parameters
    ----------
    means : the guide's parameters before, in free coordinates
    key : of the draws

    Returns
    -------
    The guide's parameters after the steps, and the loss of each step.

    Raises
    ------
    CancelledError
        If other work waits (`solver.runtime.interruption`).
    """
    count = len(stepping.rates)
    stepping = jax.device_put(stepping)
    state, all_draws = _first_state(stepping, means, key, count)
    # Each slice of an array of JAX's own would be compiled.
    drawn = np.asarray(all_draws)
    losses = []
    for first in range(0, count, _AT_ONCE):
        give_way()
        means, state, found = _steps(stepping, means, state, drawn[first : first + _AT_ONCE])
        losses.append(np.asarray(found))
    return means, np.concatenate(losses)


@partial(jax.jit, static_argnames="count")
def _first_state(
    stepping: Stepping, means: Means, key: PRNGKeyArray, count: int
) -> tuple[SVIState, Float[Array, "step 2 src"]]:
    """Return the state before the first step, and the draws of all steps."""
    shape = means.scale.shape
    return _engine(stepping, means).init(key, jnp.zeros(shape)), draws(key, count, shape)


@jax.jit
def _steps(
    stepping: Stepping, means: Means, state: SVIState, drawn: Float[AnyArray, "step 2 src"]
) -> tuple[Means, SVIState, Float[Array, " step"]]:
    """Make some steps; return the guide's parameters and the state after them, and the losses."""
    engine = _engine(stepping, means)
    # Which parameters are positive becomes known to the engine when it begins.
    engine.init(state.rng_key, drawn[0])

    def step(state: SVIState, draw: AnyArray) -> tuple[SVIState, AnyArray]:
        return engine.update(state, draw)

    state, losses = jax.lax.scan(step, state, drawn)
    found = engine.get_params(state)
    return Means(*(found[name] for name in SITES)), state, losses


def _engine(stepping: Stepping, means: Means) -> SVI:
    """Return the engine of numpyro whose guide begins at some parameters."""

    def model(draw: AnyArray) -> None:
        in_coordinates(stepping.inputs, stepping.coordinates)

    def guide_with(draw: AnyArray) -> None:
        guide(means, draw)

    adam = optax.chain(
        optax.scale_by_adam(_BETA_1, _BETA_2, _EPSILON),
        _limited_steps(lambda count: stepping.rates[count], stepping.limits),
    )
    return SVI(model, guide_with, adam, MirroredElbo())


def _limited_steps(
    schedule: Callable[[AnyArray], AnyArray], limits: Means
) -> optax.GradientTransformation:
    """Return a transformation to descent steps, at the rate of the schedule up to the limits."""
    by_site = dict(zip(SITES, limits, strict=True))

    def update(updates: dict, state: AnyArray, params: object = None) -> tuple[dict, AnyArray]:
        del params
        now = schedule(state)
        rates = {name: jnp.minimum(now, limit) for name, limit in by_site.items()}
        return {name: -rates[name] * values for name, values in updates.items()}, state + 1

    return optax.GradientTransformation(lambda _: jnp.zeros((), int), update)
