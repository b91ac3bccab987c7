"""The prior of walking distortion terms as a numpyro distribution."""

from typing import Any

import jax.numpy as jnp
import numpyro.distributions as dist
from jaxtyping import Float, Int
from numpyro.distributions import constraints
from numpyro.distributions.transforms import Transform

from solver.model.forward import AnyArray


class WalkTransform(Transform):
    """From mean and steps of walks to their elements, as in `solver.problem.walks`.

    Attributes
    ----------
    in_order : the exposures in order of time; values are exposure by exposure, all terms of
        an exposure adjacent
    """

    domain = constraints.real_vector
    codomain = constraints.real_vector

    def __init__(self, in_order: Int[AnyArray, " exp"]) -> None:
        """Take the order of the exposures in time."""
        self.in_order = in_order

    def __call__(self, x: Float[AnyArray, " walk"]) -> Float[AnyArray, " walk"]:
        """Return the elements of the walks from their means and steps."""
        values = self._by_time(x)
        walk = jnp.cumsum(values.at[0].set(0.0), axis=0)
        return self._flat(values[0] + walk - walk.mean(axis=0))

    def _inverse(self, y: Float[AnyArray, " walk"]) -> Float[AnyArray, " walk"]:
        values = self._by_time(y)
        steps = jnp.diff(values, axis=0)
        return self._flat(jnp.concatenate([values.mean(axis=0, keepdims=True), steps]))

    def log_abs_det_jacobian(
        self,
        x: Float[AnyArray, " walk"],
        y: Float[AnyArray, " walk"],
        intermediates: Any = None,  # noqa: ANN401, ARG002 the signature of numpyro
    ) -> Float[AnyArray, ""]:
        """Return zero: the transform keeps volumes."""
        return jnp.zeros(jnp.shape(x)[:-1])

    def tree_flatten(self) -> tuple[tuple, tuple]:
        """Return the parts of the transform, for JAX."""
        return (self.in_order,), (("in_order",), {})

    def _by_time(self, flat: Float[AnyArray, " walk"]) -> Float[AnyArray, "exp term"]:
        return jnp.reshape(flat, (len(self.in_order), -1))[self.in_order]

    def _flat(self, by_time: Float[AnyArray, "exp term"]) -> Float[AnyArray, " walk"]:
        return jnp.zeros_like(by_time).at[self.in_order].set(by_time).ravel()


def random_walk(
    width: Float[AnyArray, " walk"], in_order: Int[AnyArray, " exp"]
) -> dist.Distribution:
    """Return the prior of walking terms.

    Parameters
    ----------
    width : prior width of mean and steps, the mean at the first exposure in time
    in_order : the exposures in order of time
    """
    steps = dist.Normal(jnp.zeros_like(width), width).to_event(1)
    return dist.TransformedDistribution(steps, WalkTransform(in_order))
