"""The posterior of one orbit as a numpyro model, generated from the parameter table.

Paper, Eqs. (method:posterior:radec), (exp:priors): a prior for every group, and the likelihood of
the measurements under the observation model. `in_coordinates` is the same model in the
coordinates in which the svi and nuts engines work (`solver.linear.whitening`).
"""

from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import numpyro
import numpyro.distributions as dist
from jaxtyping import Float, Int
from numpyro.distributions import constraints

from solver.data.parameters import BY_NAME, SOURCES, Group
from solver.engines.walk_prior import random_walk
from solver.linear.chi2 import half_chi2_of_chunks
from solver.linear.whitening import Coordinates
from solver.model.forward import AnyArray, Geometry, Index
from solver.problem.parameter_vector import VectorLayout
from solver.problem.problem import Problem

# Sites of `in_coordinates`.
CALIBRATION, FREE_SOURCES = "calibration", "free_sources"


class ModelInput(eqx.Module):
    """Input of the model as JAX arrays: the measurements and priors of one orbit.

    Attributes
    ----------
    index, measured, weight : as in `solver.problem.tiles.Tiles`
    width, centre : width and centre of the calibration's priors, per group
    precision : inverse covariance of the sources' priors, mas^-2
    log_norm : logarithm of the likelihood where all residuals are zero
    in_order : the exposures in order of time
    flat : groups with flat priors
    """

    geometry: Geometry
    index: Index
    measured: Float[AnyArray, "chunk 2 tile slot"]
    weight: Float[AnyArray, "chunk 2 tile slot"]
    width: dict[str, Float[AnyArray, " _"]]
    centre: dict[str, Float[AnyArray, " _"]]
    precision: Float[AnyArray, "src 2 2"]
    log_norm: Float[AnyArray, ""]
    in_order: Int[AnyArray, " exp"]
    layout: VectorLayout = eqx.field(static=True)
    flat: frozenset[str] = eqx.field(static=True)


def model_input(problem: Problem) -> ModelInput:
    """Return the input of the model for a problem."""
    layout, priors, tiles = problem.layout, problem.priors, problem.measurements.tiles
    width = layout.scatter(priors.width)
    return ModelInput(
        geometry=problem.geometry,
        index=tiles.index,
        measured=tiles.measured,
        weight=tiles.weight,
        width=width,
        centre=layout.scatter(priors.centre),
        precision=priors.precision,
        log_norm=-np.log(problem.measurements.sigma).sum()
        - np.array(problem.measurements.sigma.size * _HALF_LOG_2PI),
        in_order=np.argsort(problem.exposures["obstime"].to_numpy(), kind="stable"),
        layout=layout,
        flat=frozenset(name for name, values in width.items() if np.isinf(values).any()),
    )


def plate_analysis(inputs: ModelInput) -> None:
    """Define the posterior of an orbit: the numpyro model."""
    groups = (SOURCES, *inputs.layout.groups)
    offsets = {g.name: numpyro.sample(g.name, _prior(inputs, g)) for g in groups}
    half_chi2 = half_chi2_of_chunks(
        _padded(offsets, inputs.geometry),
        inputs.geometry,
        inputs.index,
        inputs.measured,
        inputs.weight,
    )
    numpyro.factor("measurements", inputs.log_norm - half_chi2)


def in_coordinates(inputs: ModelInput, coordinates: Coordinates) -> None:
    """Define the same model in coordinates that determine the offsets of all groups."""
    free_theta = numpyro.sample(CALIBRATION, _improper(inputs.layout.size))
    free_sources = numpyro.sample(FREE_SOURCES, _improper(2, len(inputs.precision)))
    theta, sources = coordinates.place(free_theta, free_sources)
    offsets = {**inputs.layout.scatter(theta), SOURCES.name: sources}
    with numpyro.handlers.condition(data=offsets):
        plate_analysis(inputs)
    numpyro.factor("volume", coordinates.log_volume)


_HALF_LOG_2PI = 0.5 * np.log(2.0 * np.pi)


def _prior(inputs: ModelInput, group: Group) -> dist.Distribution:
    if group is SOURCES:
        mean = jnp.zeros((len(inputs.precision), 2))
        return dist.MultivariateNormal(mean, precision_matrix=inputs.precision).to_event(1)
    width, centre = inputs.width[group.name], inputs.centre[group.name]
    if group.name in inputs.flat:
        return _improper(len(width))
    if group.axis == "walk":
        return random_walk(width, inputs.in_order)
    return _FAMILIES[group.family](width, centre).to_event(1)


def _improper(*shape: int) -> dist.Distribution:
    return dist.ImproperUniform(constraints.real, (), shape)


def _normal(width: Float[AnyArray, " _"], _: Float[AnyArray, " _"]) -> dist.Distribution:
    return dist.Normal(jnp.zeros_like(width), width)


def _gamma(width: Float[AnyArray, " _"], centre: Float[AnyArray, " _"]) -> dist.Distribution:
    """Return a gamma distribution of the absolute value with this mean and standard deviation."""
    absolute = dist.Gamma((centre / width) ** 2, centre / width**2)
    return dist.TransformedDistribution(absolute, dist.transforms.AffineTransform(-centre, 1.0))


_FAMILIES: dict[str, Callable[[AnyArray, AnyArray], dist.Distribution]] = {
    "normal": _normal,
    "gamma": _gamma,
}


def _padded(offsets: dict[str, AnyArray], geometry: Geometry) -> dict[str, AnyArray]:
    """Return the offsets padded with zeros to the sizes of the geometry."""
    lengths = {n: geometry.sizes.get(BY_NAME[n].axis, len(v)) for n, v in offsets.items()}
    return {
        name: jnp.pad(values, [(0, lengths[name] - len(values)), *[(0, 0)] * (values.ndim - 1)])
        for name, values in offsets.items()
    }
