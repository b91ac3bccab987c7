"""The variational guide of the paper: a normal for every source, a point for all else.

Paper, Eq. (method:svi). The draws come in groups of four: two, scaled to the variance that two
are expected to have, and their mirror images. Their mean and variance are then exact, and
with them the gradient wherever the posterior is Gaussian, so that far fewer steps do.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpyro
import numpyro.distributions as dist
from jaxtyping import Array, Float, PRNGKeyArray

from solver.forward import AnyArray
from solver.model import CALIBRATION, FREE_SOURCES

# The names of the fields of `Means` as numpyro's parameters.
SITES = ("calibration_loc", "sources_loc", "sources_scale")


class Means(NamedTuple):
    """The guide's parameters in free coordinates."""

    calibration: Float[AnyArray, " calib"]
    sources: Float[AnyArray, "2 src"]
    scale: Float[AnyArray, "2 src"]


def guide(means: Means, draw: Float[Array, "2 src"]) -> None:
    """Say the paper's guide: a point for the calibration, a normal for each source."""
    calibration = numpyro.param(SITES[0], means.calibration)
    loc = numpyro.param(SITES[1], means.sources)
    scale = numpyro.param(SITES[2], means.scale, constraint=dist.constraints.positive)
    numpyro.sample(CALIBRATION, dist.Delta(calibration, event_dim=1))
    numpyro.sample(FREE_SOURCES, _Drawn(loc, scale, draw).to_event(2))


class _Drawn(dist.Normal):
    """A normal distribution whose next draw is known."""

    def __init__(self, loc: AnyArray, scale: AnyArray, draw: AnyArray) -> None:
        super().__init__(loc, scale)
        self._draw = draw

    def sample(self, key: PRNGKeyArray | None, sample_shape: tuple[int, ...] = ()) -> AnyArray:
        return self.loc + self.scale * self._draw


def draws(key: PRNGKeyArray, count: int, shape: tuple[int, ...]) -> Float[Array, "count ..."]:
    """Return standard normal draws in groups of four with mean zero and unit variance."""
    pairs = jax.random.normal(key, (-(-count // 4), 2, *shape))
    pairs = pairs * jnp.sqrt(2.0 / jnp.sum(pairs**2, axis=1, keepdims=True))
    return jnp.stack([pairs, -pairs], axis=2).reshape(-1, *shape)[:count]
