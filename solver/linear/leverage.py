"""Leverage: how far each measurement pulls its own prediction, and residuals corrected for it.

With the whitened Jacobian J_k of measurement k and the marginal covariance C of all
parameters, H_k = J_k C J_k' (2 x 2). The expected chi2 of the measurement is
2 - tr H_k, and (I - H_k)^(-1/2) r_k has unit covariance if model and sigmas are right.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from solver.linear.chunk_leverage import (
    ELEMENTS,
    Leverage,
    SharedCovariances,
    TileCovariances,
    WalkCovariances,
    leverage,
)
from solver.linear.chunks_in_turn import chunks_in_turn
from solver.linear.covariances import Covariances
from solver.linear.linearise import linearise, turning
from solver.model.forward import (
    AnyArray,
    Directions,
    Geometry,
    Index,
    Offsets,
    Pair,
    directions,
    ideal_position,
    image,
)
from solver.problem.problem import Problem, pad

# Chunks computed at once: a single one does not keep all cores busy.
_MAX_PENDING = 3
# Five pairs, and the trace.
_N_COLUMNS = 11


class Residuals(NamedTuple):
    """Residuals of the measurements, in working order.

    `whitened` is (measured minus predicted) / sigma; `standardised` the same corrected for
    leverage, NaN where a measurement determines its own prediction; `trace` is that of H;
    the positions are those of `solver.model.forward.Prediction`.
    """

    whitened: Float[np.ndarray, "obs 2"]
    standardised: Float[np.ndarray, "obs 2"]
    trace: Float[np.ndarray, " obs"]
    pixel: Float[np.ndarray, "obs 2"]
    ideal: Float[np.ndarray, "obs 2"]
    focal: Float[np.ndarray, "obs 2"]

    @property
    def chi2(self) -> Float[np.ndarray, " obs"]:
        """Square of the whitened residual of each measurement."""
        return np.einsum("ij,ij->i", self.whitened, self.whitened)


def residuals(
    problem: Problem,
    theta: Float[np.ndarray, " calib"],
    sources: Float[np.ndarray, "src 2"],
    covariance: Covariances,
) -> Residuals:
    """Return the residuals at a point, and their leverage.

    Parameters
    ----------
    theta, sources : the point, as offsets from the origins
    covariance : marginal, of the problem linearised at its own `at`
    """
    tiles, geometry = problem.measurements.tiles, jax.device_put(problem.geometry)
    # Along prior-dominated directions large variances cancel, but only with the Jacobians
    # from which the covariances were computed.
    linear, at = jax.device_put((problem.offsets(*covariance.at), problem.offsets(theta, sources)))
    turn, sky = turning(linear, geometry), _directions(at, geometry)
    shared = jax.device_put(_shared_covariances(problem, covariance))
    of_chunk = _tile_covariances(problem, covariance)

    def launch(i: int) -> list[Float[Array, "tile slot"]]:
        index, measured, weight = tiles.chunk(i)
        jacobians = linearise(turn, linear, geometry, index, measured, weight)
        found = leverage(jacobians, index.source, shared, of_chunk(index))
        return _columns(sky, at, geometry, index, measured, weight, found)

    values = np.empty((_N_COLUMNS, *tiles.index.source.shape))
    launched = chunks_in_turn(launch, len(tiles.measured), ahead=_MAX_PENDING)
    for i, columns in enumerate(launched):
        for number, column in enumerate(columns):
            values[number, i] = column
    columns = np.take(values.reshape(_N_COLUMNS, -1), tiles.place, axis=1)
    whitened, standardised, pixel, ideal, focal = columns[:-1].reshape(5, 2, -1).swapaxes(1, 2)
    return Residuals(whitened, standardised, columns[-1], pixel, ideal, focal)


_directions = jax.jit(directions)


@jax.jit
def _columns(
    sky: Directions,
    offsets: Offsets,
    geometry: Geometry,
    index: Index,
    measured: Float[AnyArray, "2 tile slot"],
    weight: Float[AnyArray, "2 tile slot"],
    found: Leverage,
) -> list[Float[Array, "tile slot"]]:
    """Return x and y of the fields of `Residuals`, and last the trace."""
    at = image(ideal_position(sky, offsets, geometry, index), offsets, geometry, index)
    whitened = [weight[axis] * (measured[axis] - at.pixel[axis]) for axis in range(2)]
    standardised = _standardised(whitened[0], whitened[1], found)
    return [*whitened, *standardised, *at.pixel, *at.ideal, *at.focal, found.xx + found.yy]


def _standardised(
    x: Float[Array, "tile slot"], y: Float[Array, "tile slot"], found: Leverage
) -> Pair:
    """Return (I - H)^(-1/2) r, by the closed form of a 2 x 2 root."""
    xx, yy = 1.0 - found.xx, 1.0 - found.yy
    determinant, trace = xx * yy - found.xy**2, xx + yy
    # Below this the measurement determines its own prediction, and its residual is rounding noise.
    usable = (determinant > 1e-12) & (trace > 0.0)
    root = jnp.sqrt(jnp.where(usable, determinant, jnp.nan))
    # The root of M is (M + root I) / sqrt(trace + 2 root); this divides by its determinant.
    scale = 1.0 / (root * jnp.sqrt(trace + 2.0 * root))
    return scale * ((yy + root) * x + found.xy * y), scale * (found.xy * x + (xx + root) * y)


def _shared_covariances(problem: Problem, covariance: Covariances) -> SharedCovariances:
    sizes, shared, n_terms = (
        problem.geometry.sizes,
        problem.layout.coefficients(),
        problem.layout.n_terms,
    )
    places, n_padded = _basis_places(problem)
    source = covariance.source[:, [0, 0, 1], [0, 1, 1]]
    # From block order to that of the sources.
    n_sources = covariance.own_cross.shape[-1]
    with_source = covariance.own_cross[shared].reshape(2 * n_terms * 2, n_sources)
    with_source = np.take(with_source, covariance.source_blocks.position, axis=1)
    with_source = with_source.reshape(2, n_terms, 2, n_sources).swapaxes(1, 2)
    terms = covariance.theta[shared, shared].reshape(2, n_terms, 2, n_terms)
    return SharedCovariances(
        pad(source, "src", sizes).T,
        _with_zeros(_of_products(terms), (3, n_padded, n_padded), {1: places, 2: places}),
        _with_zeros(with_source, (2, 2, n_padded, sizes["src"]), {2: places}),
    )


def _of_products(terms: Float[np.ndarray, "2 coef 2 coef"]) -> Float[np.ndarray, "3 coef coef"]:
    """Return the coefficients of the products of two terms, each once, in xx, xy and yy."""
    blocks = np.stack([terms[0, :, 0], terms[0, :, 1], terms[1, :, 1]])
    return np.triu(blocks) + np.triu(blocks.swapaxes(1, 2), 1)


def _tile_covariances(
    problem: Problem, covariance: Covariances
) -> Callable[[Index], TileCovariances]:
    """Return the function that looks up the covariances of the tiles of a chunk."""
    layout, cross = problem.layout, covariance.own_cross
    position, (basis, n_padded) = covariance.source_blocks.position, _basis_places(problem)
    terms = covariance.theta[:, layout.coefficients()].reshape(layout.size, 2, layout.n_terms)
    terms = _with_zeros(terms, (layout.size, 2, n_padded), {2: basis})

    def with_source(
        columns: Int[np.ndarray, "tile k"], source: Int[np.ndarray, "tile slot"]
    ) -> Float[np.ndarray, "tile k 2 slot"]:
        rows = cross.shape[-1] * (2 * columns[..., None] + np.arange(2))
        places = rows[..., None] + position[source][:, None, None, :]
        return cross.reshape(-1).take(places, mode="clip")

    def of_chunk(index: Index) -> TileCovariances:
        own = layout.touched(index.exposure[:, 0], index.detector[:, 0])
        of_terms, walk = terms[own], None
        if layout.n_walk:
            walked = layout.walked(index.exposure[:, 0])
            halves = (len(walked), -1, 2, layout.n_walk)
            of_walk = covariance.theta[own[:, :, None], walked[:, None, :]].reshape(halves)
            of_terms[..., : layout.n_walk] += of_walk
            among = covariance.theta[walked[:, :, None], walked[:, None, :]]
            walk = WalkCovariances(
                _of_walk(terms[walked], among.reshape(len(walked), 2, layout.n_walk, 2, -1)),
                with_source(walked, index.source).reshape(len(walked), 2, layout.n_walk, 2, -1),
            )
        return TileCovariances(
            covariance.theta[own[:, :, None], own[:, None, :]],
            of_terms,
            with_source(own, index.source),
            walk,
        )

    return of_chunk


def _of_walk(
    with_terms: Float[np.ndarray, "tile two_walk 2 coef"],
    among: Float[np.ndarray, "tile 2 walk 2 walk"],
) -> Float[np.ndarray, "tile 3 walk coef"]:
    """Return `WalkCovariances.terms`, from the covariances of the walking coefficients."""
    n_tiles, _, n_walk, *_ = among.shape
    with_terms = with_terms.reshape(n_tiles, 2, n_walk, 2, -1)
    found = np.stack([with_terms[:, i, :, j] + with_terms[:, j, :, i] for i, j in ELEMENTS], axis=1)
    for number, (i, j) in enumerate(ELEMENTS):
        found[:, number, :, :n_walk] += among[:, i, :, j]
    return found


def _basis_places(problem: Problem) -> tuple[Int[np.ndarray, " term"], int]:
    """Return the places of the terms in the basis of the geometry, and its length.

    Those of the distortion are padded; those of optional groups follow the padding.
    """
    n_coef, n_padded = problem.layout.n_coef, problem.geometry.sizes["coef"]
    end = n_padded + problem.layout.n_terms - n_coef
    return np.r_[:n_coef, n_padded:end], end


def _with_zeros(
    values: Float[np.ndarray, "..."],
    shape: tuple[int, ...],
    places: Mapping[int, Int[np.ndarray, " _"]],
) -> Float[np.ndarray, "..."]:
    """Return an array of a larger shape, with zeros where it has no values.

    Parameters
    ----------
    places : axis -> places of the values along it; at its beginning by default
    """
    larger = np.zeros(shape)
    axes = [places.get(axis, np.arange(size)) for axis, size in enumerate(values.shape)]
    larger[np.ix_(*axes)] = values
    return larger


def of_slots(pair: Pair) -> Float[np.ndarray, "slots 2"]:
    """Return x and y of every slot of a chunk, tile after tile."""
    return np.stack([values.ravel() for values in pair], axis=-1)
