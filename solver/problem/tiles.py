"""Tiles: measurements of one exposure on one detector, in contiguous memory.

A tile is a row of slots, filled with measurements in working order; the last tile of an
exposure and detector is padded with copies of weight zero. Values of the exposure or the
detector are then looked up once per tile, and every loop over measurements runs along
contiguous memory. Tiles are processed a chunk at a time.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, Shaped

from solver.model.forward import Index

# Slots per tile: enough for the vector units, few enough to leave few slots empty. `FEW_SLOTS`
# applies where exposures have few measurements on a detector. JAX compiles once for each length.
SLOTS = 128
FEW_SLOTS = 16
# Tiles per chunk: enough to keep the cores busy, few enough to stay in their caches. A fixed
# length needs one compilation, whatever the number of measurements.
CHUNK = 256
# Tiles of a problem of one shorter chunk, such as the measurements of one exposure or source.
FEW_TILES = 128
# Bytes; alignment that XLA needs to use an array without a copy.
_ALIGNMENT = 64


class Tiles(NamedTuple):
    """The measurements of an orbit in chunks of tiles.

    Attributes
    ----------
    index : `source` (chunk, tile, slot), `exposure` and `detector` (chunk, tile, 1)
    measured : pixels from the detector's centre
    weight : 1/sigma, pixel^-1; zero where there is no measurement
    place : slot of each measurement, in working order, among all slots
    """

    index: Index
    measured: Float[np.ndarray, "chunk 2 tile slot"]
    weight: Float[np.ndarray, "chunk 2 tile slot"]
    place: Int[np.ndarray, " obs"]

    def chunk(self, i: int) -> tuple[Index, np.ndarray, np.ndarray]:
        """Return index, measured and weight of one chunk."""
        return Index(*(column[i] for column in self.index)), self.measured[i], self.weight[i]

    def by_source(
        self, position: Int[np.ndarray, " src"], n_det: int, n_values: int
    ) -> "Gathering":
        """Return how to sum `n_values` values of each measurement by detector and source.

        Parameters
        ----------
        position : place of each source in the order of the rows
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
    """Indices of a sparse matrix that sums several values of each slot by detector and source.

    The rows of one detector and source, one per value, are adjacent, so that the dense factor
    is fetched from memory once for all of them.

    Attributes
    ----------
    value : place of each entry in an array (value, slot)
    slot : column of each entry
    first : first entry of each row, and the end of the last row
    """

    value: Int[np.ndarray, " entries"]
    slot: Int[np.ndarray, " entries"]
    first: Int[np.ndarray, " bounds"]


def lay_tiles(
    index: Index, measured: Float[np.ndarray, "obs 2"], sigma: Float[np.ndarray, "obs 2"]
) -> Tiles:
    """Arrange measurements, sorted by exposure and detector, in a whole number of chunks."""
    n_obs = len(measured)
    changes = np.flatnonzero(np.diff(index.exposure) | np.diff(index.detector)) + 1
    first = np.concatenate([[0], changes])
    length = np.diff(first, append=n_obs)
    slots = SLOTS if length.mean() > 2 * FEW_SLOTS else FEW_SLOTS
    tiles = -(-length // slots)
    chunk = min(CHUNK, FEW_TILES) if tiles.sum() <= FEW_TILES else CHUNK
    n_chunks = -(-tiles.sum() // chunk)
    place = np.repeat(slots * (np.cumsum(tiles) - tiles) - first, length) + np.arange(n_obs)
    # Padding repeats the measurement before it.
    row = np.zeros(n_chunks * chunk * slots, dtype=np.int64)
    row[place] = np.arange(n_obs)
    row = np.maximum.accumulate(row).reshape(n_chunks, chunk, slots)
    weight = np.zeros((2, row.size))
    weight[:, place] = 1.0 / sigma.T
    first_slot = row[:, :, :1]
    return Tiles(
        Index(
            *map(
                _aligned,
                (index.source[row], index.exposure[first_slot], index.detector[first_slot]),
            )
        ),
        _aligned(measured.T[:, row].swapaxes(0, 1)),
        _aligned(weight.reshape(2, *row.shape).swapaxes(0, 1)),
        place,
    )


def _aligned(values: Shaped[np.ndarray, "..."]) -> Shaped[np.ndarray, "..."]:
    """Return an aligned copy, which JAX on a CPU uses directly instead of copying each chunk."""
    buffer = np.empty(values.nbytes + _ALIGNMENT, dtype=np.uint8)
    first = -buffer.ctypes.data % _ALIGNMENT
    copy = buffer[first : first + values.nbytes].view(values.dtype).reshape(values.shape)
    copy[...] = values
    return copy
