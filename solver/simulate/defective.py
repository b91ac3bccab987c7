"""Measurements of one orbit with the defects of the survey."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
from jaxtyping import Array, Float, Int

from solver.data.instrument import Instrument
from solver.model.forward import Geometry, Index, directions, ideal_position, image
from solver.simulate.defects.defect import Altered, DefectStage, TrueRows
from solver.simulate.defects.stages import (
    defective_table,
    displaced_pixels,
    focal_displacement,
    has_stage,
    noise_ratio,
    true_observer,
)
from solver.simulate.geometry import CHUNK, padded, true_geometry, zero_offsets
from solver.simulate.placement import place_detectors
from solver.simulate.settings import SurveySettings


class Exposed(NamedTuple):
    """The measurements of an orbit without defects, in the order of their table.

    `pixel` is without and `noise` is the noise alone; `frame` holds the directions of the sources.
    """

    index: Index
    pixel: Float[np.ndarray, "obs 2"]
    noise: Float[np.ndarray, "obs 2"]
    frame: Float[np.ndarray, "src 3 3"]
    attitude: pd.DataFrame


def with_defects(
    table: pd.DataFrame,
    exposed: Exposed,
    instrument: Instrument,
    settings: SurveySettings,
    orbit_id: int,
) -> Altered:
    """Return the table of measurements with the defects of the survey.

    The sources measured are those of the orbit without defects, so that these keep their noise.
    A source that a defect moves off its detector is left out; one that it would move onto a
    detector is not added.

    Parameters
    ----------
    table : `schema.MEASUREMENT` without defects
    instrument : the nominal instrument
    """
    rows = _rows(table, exposed, instrument, settings, orbit_id)
    pixel = displaced_pixels(rows, settings, orbit_id)
    measured = pixel + noise_ratio(rows, settings, orbit_id)[:, None] * exposed.noise
    inside = np.all(np.abs(pixel) < 0.5 * rows.of_detector("n_x", "n_y"), axis=1)
    moved = table.assign(nx=measured[:, 0], ny=measured[:, 1])[inside]
    return defective_table(moved, settings, orbit_id)


def _rows(
    table: pd.DataFrame,
    exposed: Exposed,
    instrument: Instrument,
    settings: SurveySettings,
    orbit_id: int,
) -> TrueRows:
    """Return the measurements before noise, with the defects up to the focal plane."""
    index, attitude = exposed.index, exposed.attitude
    rows = TrueRows(
        exposure=index.exposure,
        detector=index.detector,
        ideal=np.zeros_like(exposed.pixel),
        pixel=exposed.pixel,
        magnitude=table["magnitude"].to_numpy(),
        attitude=attitude,
        instrument=place_detectors(instrument, settings),
    )
    if not has_stage(settings, DefectStage.OBSERVER, DefectStage.FOCAL_PLANE):
        return rows
    actual = true_observer(attitude, settings, orbit_id)
    geometry = true_geometry(padded(exposed.frame), actual, instrument, settings)
    ideal = _in_chunks(_ideal, geometry, index, exposed.pixel)
    rows = rows.moved(ideal, exposed.pixel)
    displacement = focal_displacement(rows, settings, orbit_id)
    return rows.moved(ideal, _in_chunks(_pixels, geometry, index, displacement))


def _in_chunks(
    compute: Callable[..., Array],
    geometry: Geometry,
    index: Index,
    values: Float[np.ndarray, "obs 2"],
) -> Float[np.ndarray, "obs 2"]:
    """Return what is computed of all measurements, in chunks of one length."""
    parts = [
        np.asarray(compute(geometry, *part))[: len(values) - start]
        for start, part in _chunks(index, values)
    ]
    return np.concatenate(parts) if parts else np.empty((0, 2))


def _chunks(index: Index, values: Float[np.ndarray, "obs 2"]) -> Iterator[tuple[int, tuple]]:
    """Yield the start of each chunk, and its indices and values, padded."""
    for start in range(0, len(values), CHUNK):
        part = slice(start, start + CHUNK)
        missing = (0, CHUNK - len(values[part]))
        padded_index = (np.pad(one[part], missing) for one in index)
        yield start, (*padded_index, np.pad(values[part], (missing, (0, 0))))


@jax.jit
def _ideal(
    geometry: Geometry,
    source: Int[Array, " obs"],
    exposure: Int[Array, " obs"],
    detector: Int[Array, " obs"],
    _: Float[Array, "obs 2"],
) -> Float[Array, "obs 2"]:
    """Return the positions on the undistorted focal plane, um."""
    offsets, index = zero_offsets(geometry), Index(source, exposure, detector)
    seen = directions(offsets, geometry)
    return jnp.stack(ideal_position(seen, offsets, geometry, index), axis=-1)


@jax.jit
def _pixels(
    geometry: Geometry,
    source: Int[Array, " obs"],
    exposure: Int[Array, " obs"],
    detector: Int[Array, " obs"],
    displacement: Float[Array, "obs 2"],
) -> Float[Array, "obs 2"]:
    """Return the positions in pixels of sources displaced on the focal plane, um."""
    offsets, index = zero_offsets(geometry), Index(source, exposure, detector)
    ideal = ideal_position(directions(offsets, geometry), offsets, geometry, index)
    predicted = image(ideal, offsets, geometry, index, (displacement[:, 0], displacement[:, 1]))
    return jnp.stack(predicted.pixel, axis=-1)
