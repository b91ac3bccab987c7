"""Tiles: measurements of one exposure on one detector, side by side.

A tile is a row of slots, filled from the measurements in working order; the last
one of an exposure and detector is filled up with copies of no weight. What belongs to the
exposure or the detector is then looked up once for each tile, and every loop over
measurements runs along contiguous memory. Tiles are worked on a chunk at a time.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, Shaped

from solver.model.forward import Index

# Long enough for the vector units, short enough to waste few places; the shorter where an
# exposure has few measurements on a detector. Each length is a compilation.
SLOTS = 128
FEW_SLOTS = 16
# Long enough to keep the cores busy, short enough to stay in their caches. One length means
# one compilation, whatever the number of measurements.
CHUNK = 256
# One chunk of so many does for what a single exposure or source adds.
FEW_TILES = 128
# Bytes; what XLA asks of an array that it is to share.
_ALIGNMENT = 64


class Tiles(NamedTuple):
    """The measurements of an orbit in chunks of tiles.

    Attributes
    ----------
    index : `source` (chunk, tile, slot), `exposure` and `detector` (chunk, tile, 1)
    measured : pixels from the detector's centre
    weight : 1/sigma, pixel^-1; zero where there is no measurement
    place : of each measurement in working order among all slots
    """

    index: Index
    measured: Float[np.ndarray, "chunk 2 tile slot"]
    weight: Float[np.ndarray, "chunk 2 tile slot"]
    place: Int[np.ndarray, " obs"]

    def chunk(self, i: int) -> tuple[Index, np.ndarray, np.ndarray]:
        """Return index, measured and weight of one chunk."""
        return Index(*(part[i] for part in self.index)), self.measured[i], self.weight[i]

    def by_source(
        self, position: Int[np.ndarray, " src"], n_det: int, n_values: int
    ) -> "Gathering":
        """Return how to gather so many values of each measurement by its detector and source.

        Parameters
        ----------
        position : of each source among the rows
        """
        pair = self.index.detector * len(position) + position[self.index.source]
        pair = pair.reshape(-1)[self.place]
        order = self.place[np.argsort(pair, kind="stable")]
        count = np.bincount(pair, minlength=n_det * len(position))
        first = np.cumsum(count) - count
        begin = n_values * first + np.arange(n_values)[:, None] * count
        place = np.repeat(begin - first, count, axis=1) + np.arange(len(order))
        slot, value = np.empty(place.size, dtype=np.int32), np.empty(place.size, dtype=np.int64)
        slot[place] = order
        value[place] = order + self.index.source.size * np.arange(n_values)[:, None]
        return Gathering(value, slot, np.append(begin.T, place.size).astype(np.int32))


class Gathering(NamedTuple):
    """Several values of each slot, as rows of a sparse matrix that sums them by their source.

    The rows of one detector and source, one for each value, stand one after the other, so
    that what they are multiplied with is fetched from memory once for all of them.

    Attributes
    ----------
    value : place of each entry in an array (value, slot)
    slot : its column
    first : where each row begins, and where the last one ends
    """

    value: Int[np.ndarray, " entries"]
    slot: Int[np.ndarray, " entries"]
    first: Int[np.ndarray, " bounds"]


def lay_tiles(
    index: Index, measured: Float[np.ndarray, "obs 2"], sigma: Float[np.ndarray, "obs 2"]
) -> Tiles:
    """Lay measurements, sorted by exposure and detector, in a whole number of chunks."""
    n_obs = len(measured)
    changes = np.flatnonzero(np.diff(index.exposure) | np.diff(index.detector)) + 1
    first = np.concatenate([[0], changes])
    length = np.diff(first, append=n_obs)
    slots = SLOTS if length.mean() > 2 * FEW_SLOTS else FEW_SLOTS
    tiles = -(-length // slots)
    chunk = min(CHUNK, FEW_TILES) if tiles.sum() <= FEW_TILES else CHUNK
    n_chunks = -(-tiles.sum() // chunk)
    place = np.repeat(slots * (np.cumsum(tiles) - tiles) - first, length) + np.arange(n_obs)
    # Empty slots repeat the measurement before them.
    row = np.zeros(n_chunks * chunk * slots, dtype=np.int64)
    row[place] = np.arange(n_obs)
    row = np.maximum.accumulate(row).reshape(n_chunks, chunk, slots)
    weight = np.zeros((2, row.size))
    weight[:, place] = 1.0 / sigma.T
    head = row[:, :, :1]
    return Tiles(
        Index(*map(_aligned, (index.source[row], index.exposure[head], index.detector[head]))),
        _aligned(measured.T[:, row].swapaxes(0, 1)),
        _aligned(weight.reshape(2, *row.shape).swapaxes(0, 1)),
        place,
    )


def _aligned(values: Shaped[np.ndarray, "..."]) -> Shaped[np.ndarray, "..."]:
    """Return a copy that JAX on a CPU takes as it is: from elsewhere it would copy each chunk."""
    room = np.empty(values.nbytes + _ALIGNMENT, dtype=np.uint8)
    first = -room.ctypes.data % _ALIGNMENT
    copy = room[first : first + values.nbytes].view(values.dtype).reshape(values.shape)
    copy[...] = values
    return copy
