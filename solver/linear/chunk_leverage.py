"""Leverage of a chunk of tiles: J C J' of each slot, compiled by JAX.

A measurement depends on few parameters, and on the distortion's many coefficients only
through the displacement that they add at its position; so the covariance C is projected onto the
source, the parameters of the local groups and that displacement. Three programs are compiled
instead of one, in which XLA would recompute the first two for each element of the result.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from solver.linear.linearise import Linearised
from solver.model.forward import AnyArray, Pair

_Slots = Float[AnyArray, "tile slot"]
# Elements of symmetric 2 x 2 matrices.
ELEMENTS = ((0, 0), (0, 1), (1, 1))
# Most terms whose products are compiled one by one; order 9 has 52.
_MAX_UNROLLED = 52


class SharedCovariances(NamedTuple):
    """Covariances that all chunks use, padded as the geometry is.

    Attributes
    ----------
    source : elements of each source's covariance
    terms : of the displacement's elements, coefficients of the products of two distortion terms,
        each product once: zero below the diagonal
    source_terms : between the coefficients of x and y and the two offsets of each source
    """

    source: Float[AnyArray, "3 src"]
    terms: Float[AnyArray, "3 coef coef"]
    source_terms: Float[AnyArray, "2 2 coef src"]


class WalkCovariances(NamedTuple):
    """What walking terms add to the covariances of the displacement in each tile.

    Attributes
    ----------
    terms : of the displacement's elements, coefficients of the products of a walking term with
        any term
    source : between the walking coefficients of x and y and the two offsets of each source
    """

    terms: Float[AnyArray, "tile 3 walk coef"]
    source: Float[AnyArray, "tile 2 walk 2 slot"]


class TileCovariances(NamedTuple):
    """Covariances of the local parameters of each tile: of one another, and with the others.

    Those with the terms include the walking coefficients at the tile's exposure.
    """

    local: Float[AnyArray, "tile local local"]
    terms: Float[AnyArray, "tile local 2 coef"]
    source: Float[AnyArray, "tile local 2 slot"]
    walk: WalkCovariances | None


class Leverage(NamedTuple):
    """The elements of a symmetric 2 x 2 matrix of each slot."""

    xx: _Slots
    xy: _Slots
    yy: _Slots


class _OfDisplacement(NamedTuple):
    """Covariances of the displacement: its elements, and those with the source's offsets."""

    own: list[_Slots]
    source: list[list[_Slots]]


def leverage(
    chunk: Linearised,
    source: Int[AnyArray, "tile slot"],
    shared: SharedCovariances,
    tiles: TileCovariances,
) -> Leverage:
    """Return the leverage of every slot of a chunk.

    Parameters
    ----------
    source : source of each slot
    """
    of_displacement = _of_displacement(chunk.prediction.basis, source, shared)
    if tiles.walk is not None:
        of_displacement = _with_walk(of_displacement, chunk.prediction.basis, tiles.walk)
    return _projected(chunk, source, shared, _half(chunk, tiles), of_displacement)


@jax.jit
def _of_displacement(
    basis: list[_Slots], source: Int[AnyArray, "tile slot"], shared: SharedCovariances
) -> _OfDisplacement:
    if len(basis) > _MAX_UNROLLED:
        return _of_many_terms(jnp.stack(basis), source, shared)
    count = range(len(basis))
    # Taken apart at once: an index of each element takes long to trace.
    terms = [[jnp.unstack(row) for row in jnp.unstack(of)] for of in shared.terms]
    own = [
        sum(basis[k] * sum(of[k][m] * basis[m] for m in count[k:]) for k in count) for of in terms
    ]
    with_source = [
        [sum(shared.source_terms[i, a, k][source] * basis[k] for k in count) for a in range(2)]
        for i in range(2)
    ]
    return _OfDisplacement(own, with_source)


def _of_many_terms(
    basis: Float[Array, "coef tile slot"],
    source: Int[AnyArray, "tile slot"],
    shared: SharedCovariances,
) -> _OfDisplacement:
    """Return the same without a product for each pair of terms, which would compile slowly."""
    own = [jnp.sum(basis * jnp.tensordot(of, basis, 1), axis=0) for of in shared.terms]
    with_source = [
        [jnp.sum(shared.source_terms[i, a][:, source] * basis, axis=0) for a in range(2)]
        for i in range(2)
    ]
    return _OfDisplacement(own, with_source)


@jax.jit
def _with_walk(
    of_displacement: _OfDisplacement, basis: list[_Slots], walk: WalkCovariances
) -> _OfDisplacement:
    """Return the covariances of a displacement to which walking terms contribute."""
    n_tiles, n_elements, n_walk, n_terms = walk.terms.shape
    by_term = walk.terms.reshape(n_tiles, n_elements * n_walk, n_terms) @ jnp.stack(basis, axis=1)
    by_term = by_term.reshape(n_tiles, n_elements, n_walk, -1)
    count = range(n_walk)
    own = [
        element + sum(basis[k] * by_term[:, number, k] for k in count)
        for number, element in enumerate(of_displacement.own)
    ]
    with_source = [
        [
            element + sum(basis[k] * walk.source[:, i, k, a] for k in count)
            for a, element in enumerate(elements)
        ]
        for i, elements in enumerate(of_displacement.source)
    ]
    return _OfDisplacement(own, with_source)


@jax.jit
def _half(chunk: Linearised, tiles: TileCovariances) -> list[Pair]:
    """Return, for each local parameter, its covariance with a part of the prediction.

    Products with the derivatives by the local parameters are added to their transposes. So of the
    local parameters each pair is counted once, and each alone by half.
    """
    terms = jnp.stack(chunk.prediction.basis, axis=1)
    n_tiles, n_local, _, n_coef = tiles.terms.shape
    by_displacement = tiles.terms.reshape(n_tiles, 2 * n_local, n_coef) @ terms
    by_displacement = by_displacement.reshape(n_tiles, n_local, 2, -1)

    def half(i: int, axis: int) -> _Slots:
        later = range(i + 1, n_local)
        of_local = sum(tiles.local[:, i, j, None] * chunk.local[j][axis] for j in later)
        others = sum(
            by_displacement[:, i, k] * chunk.displacement[k][axis]
            + tiles.source[:, i, k] * chunk.source[k][axis]
            for k in range(2)
        )
        return 0.5 * tiles.local[:, i, i, None] * chunk.local[i][axis] + of_local + others

    return [(half(i, 0), half(i, 1)) for i in range(n_local)]


@jax.jit
def _projected(
    chunk: Linearised,
    source: Int[AnyArray, "tile slot"],
    shared: SharedCovariances,
    half: list[Pair],
    of_displacement: _OfDisplacement,
) -> Leverage:
    of_source = [element[source] for element in shared.source]

    def element(p: int, q: int) -> Float[Array, "tile slot"]:
        total = _quadratic(chunk.source, of_source, p, q)
        total += _quadratic(chunk.displacement, of_displacement.own, p, q)
        for by, covariance in zip(chunk.local, half, strict=True):
            total += by[p] * covariance[q] + by[q] * covariance[p]
        for by, covariances in zip(chunk.displacement, of_displacement.source, strict=True):
            for by_source, covariance in zip(chunk.source, covariances, strict=True):
                total += covariance * (by[p] * by_source[q] + by[q] * by_source[p])
        return total

    return Leverage(*(element(p, q) for p, q in ELEMENTS))


def _quadratic(by: list[Pair], covariance: list[_Slots], p: int, q: int) -> _Slots:
    """Return an element of J C J' of two parameters."""
    (first, second), (xx, xy, yy) = by, covariance
    crossed = first[p] * second[q] + second[p] * first[q]
    return xx * first[p] * first[q] + xy * crossed + yy * second[p] * second[q]
