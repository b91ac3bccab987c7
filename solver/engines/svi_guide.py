"""The variational guide of the paper: a normal for every source, a point for the calibration.

Paper, Eq. (method:posterior:svi). A draw lies one standard deviation from the mean in every
coordinate, on a random side: the two nodes of the Gauss-Hermite rule. Averaged with its mirror
image, the evidence lower bound and its gradient are exact where the posterior is Gaussian, which
saves most of the steps.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import numpyro
import numpyro.distributions as dist
from jaxtyping import Array, Float, PRNGKeyArray
from numpyro.infer import Trace_ELBO

from solver.engines.numpyro_model import CALIBRATION, FREE_SOURCES
from solver.model.forward import AnyArray

# Numpyro parameter names of the fields of `Means`.
SITES = ("calibration_loc", "sources_loc", "sources_scale")


class Means(NamedTuple):
    """The guide's parameters in free coordinates."""

    calibration: Float[AnyArray, " calib"]
    sources: Float[AnyArray, "2 src"]
    scale: Float[AnyArray, "2 src"]


def guide(means: Means, draw: Float[Array, "2 src"]) -> None:
    """Define the paper's guide: a point for the calibration, a normal for each source."""
    calibration = numpyro.param(SITES[0], means.calibration)
    loc = numpyro.param(SITES[1], means.sources)
    scale = numpyro.param(SITES[2], means.scale, constraint=dist.constraints.positive)
    numpyro.sample(CALIBRATION, dist.Delta(calibration, event_dim=1))
    numpyro.sample(FREE_SOURCES, _Drawn(loc, scale, draw).to_event(2))


class _Drawn(dist.Normal):
    """A normal distribution with a prescribed draw."""

    def __init__(self, loc: AnyArray, scale: AnyArray, draw: AnyArray) -> None:
        super().__init__(loc, scale)
        self._draw = draw

    def sample(self, key: PRNGKeyArray | None, sample_shape: tuple[int, ...] = ()) -> AnyArray:
        return self.loc + self.scale * self._draw


class MirroredElbo(Trace_ELBO):
    """Minus the evidence lower bound, averaged over a draw and its mirror image."""

    def loss(  # noqa: PLR0913 as numpyro calls it
        self,
        rng_key: PRNGKeyArray,
        param_map: dict,
        model: Callable[[AnyArray], None],
        guide: Callable[[AnyArray], None],
        draw: Float[AnyArray, "2 src"],
    ) -> Float[Array, ""]:
        """Return the loss for one draw, with which model and guide are called."""
        direct = super().loss(rng_key, param_map, model, guide, draw)
        mirrored = super().loss(rng_key, param_map, model, guide, -draw)
        return 0.5 * (direct + mirrored)


def draws(key: PRNGKeyArray, count: int, shape: tuple[int, ...]) -> Float[Array, "count ..."]:
    """Return draws of mean zero and unit variance, with values 1 and -1."""
    return jax.random.rademacher(key, (count, *shape), float)
