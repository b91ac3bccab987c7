"""Problem: one orbit under one set of settings, with measurements, origins and priors as arrays.

Arrays are padded to a few fixed shapes, because JAX compiles once for each shape.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd
from jaxtyping import Bool, Float

from solver.data.detector_spans import span_numbers
from solver.data.distortion_terms import terms
from solver.data.instrument import Instrument
from solver.data.orbit import OrbitData
from solver.data.parameters import BY_NAME, FRAME_GROUPS, SOURCES
from solver.data.plural import plural
from solver.data.settings import MAX_ORDER, FitSettings
from solver.errors import InputError
from solver.model.astrometry import propagate, sky_position
from solver.model.causes import ModelledCauses
from solver.model.directions import displaced, tangent_frame
from solver.model.ephemeris import observer_at
from solver.model.forward import Geometry
from solver.problem.causes import causes_of, padded
from solver.problem.elements import Elements, elements
from solver.problem.measurements import KEY, Measurements, sort_measurements
from solver.problem.padding import pad, padded_exposures, padded_sources
from solver.problem.parameter_vector import VectorLayout
from solver.problem.prior_centres import calibration_centres, catalogue_shift
from solver.problem.priors import Priors, priors_of
from solver.problem.source_blocks import SourceBlocks
from solver.problem.walks import walks_of
from solver.units import ARCSEC_PER_DEG, RAD_PER_MAS

# Lower orders are computed with additional coefficients of zero, so that they share a compilation.
_MIN_COMPUTED_ORDER = 5


@dataclass(frozen=True)
class Problem:
    """One orbit, ready to be solved.

    Attributes
    ----------
    order : highest degree of the distortion
    geometry : origins of all parameters, padded along src, exp and coef
    measurements : the measurements
    sources : catalogue rows of the measured sources, in ascending source_id
    exposures : environment rows, in order of (field_id, plate_id)
    priors : in offsets from the origins
    layout : columns of the calibration parameters
    epoch : mean epoch, MJD in TCB
    elements : elements of the calibration axes
    """

    order: int
    geometry: Geometry
    measurements: Measurements
    sources: pd.DataFrame
    exposures: pd.DataFrame
    priors: Priors
    layout: VectorLayout
    epoch: float
    elements: Elements

    @property
    def n_obs(self) -> int:
        """Number of measurements, two coordinates each."""
        return len(self.measurements.row)

    @property
    def n_src(self) -> int:
        """Number of measured sources."""
        return len(self.sources)

    @cached_property
    def source_blocks(self) -> SourceBlocks:
        """The source blocks, with the columns that each depends on."""
        return self.measurements.sets.touching(self.layout)

    def offsets(
        self, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
    ) -> dict[str, Float[np.ndarray, "..."]]:
        """Return the parameters as `solver.model.forward.predict` expects them, padded."""
        values, sizes = {**self.layout.scatter(theta), SOURCES.name: sources}, self.geometry.sizes
        return {n: pad(v, BY_NAME[n].axis, sizes) for n, v in values.items()}

    def gathered(
        self, offsets: Mapping[str, Float[np.ndarray, "..."]]
    ) -> tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]:
        """Return calibration and sources from padded parameters: the inverse of `offsets`."""
        sizes = self.layout.lengths
        values = {g.name: offsets[g.name][: sizes.get(g.axis)] for g in self.layout.groups}
        return self.layout.gather(values), offsets[SOURCES.name][: self.n_src]


def of_rows(problem: Problem, chosen: Bool[np.ndarray, " obs"]) -> Problem:
    """Return the problem with a subset of its measurements and all of its parameters."""
    return replace(problem, measurements=problem.measurements.of_rows(chosen))


def thinned(problem: Problem, keep: Bool[np.ndarray, " src"]) -> Problem:
    """Return the problem of a subset of the sources and their measurements.

    Padded arrays keep the shapes of the full problem, so that JAX does not compile again.
    """
    frames = problem.geometry.source_frame
    kept_first = np.argsort(~np.pad(keep, (0, len(frames) - len(keep))), kind="stable")
    geometry = replace(problem.geometry, source_frame=frames[kept_first])
    if (causes := geometry.causes) is not None:
        of_kept = replace(causes, faintness=causes.faintness[kept_first])
        geometry = replace(geometry, causes=of_kept)
    return replace(
        problem,
        geometry=geometry,
        measurements=problem.measurements.of_sources(keep, problem.exposures),
        sources=problem.sources[keep].reset_index(drop=True),
        priors=problem.priors._replace(precision=problem.priors.precision[keep]),
    )


def build_problem(data: OrbitData, instrument: Instrument, settings: FitSettings) -> Problem:
    """Build the problem of one orbit from its tables.

    Raises
    ------
    InputError
        If a detector is not part of the instrument, or the measurements are too few for the
        distortion order of the settings.
    """
    exposures = data.exposures.sort_values(KEY, ignore_index=True)
    measured_ids = np.unique(data.measurements["source_id"].to_numpy())
    sources = data.catalogue.set_index("source_id").loc[measured_ids].reset_index()
    measurements = sort_measurements(data.measurements, exposures, measured_ids, instrument)
    return _build(measurements, sources, exposures, instrument, settings)


def rebuilt(problem: Problem, instrument: Instrument, settings: FitSettings) -> Problem:
    """Return the problem of the same measurements under other settings.

    Raises
    ------
    InputError
        If the measurements are too few for the distortion order of the settings.
    """
    return _build(problem.measurements, problem.sources, problem.exposures, instrument, settings)


def remaining(
    problem: Problem, kept: Bool[np.ndarray, " row"], instrument: Instrument, settings: FitSettings
) -> Problem:
    """Return the problem of some rows of the measurements' table, under other settings.

    It equals the one that `build_problem` makes of these rows, without sorting them again.

    Parameters
    ----------
    kept : whether each row of the table is kept

    Raises
    ------
    InputError
        If the measurements are too few for the distortion order of the settings.
    """
    measurements, with_source, exposures = problem.measurements.remaining(kept, problem.exposures)
    sources = problem.sources[with_source].reset_index(drop=True)
    return _build(measurements, sources, exposures, instrument, settings)


def _build(
    measurements: Measurements,
    sources: pd.DataFrame,
    exposures: pd.DataFrame,
    instrument: Instrument,
    settings: FitSettings,
) -> Problem:
    axes = elements(exposures, instrument, settings)
    layout = VectorLayout(
        len(exposures),
        len(axes["coef"]),
        measurements.n_det,
        tuple((group.name, len(axes[group.axis])) for group in settings.optional_groups),
        tuple(span_numbers(exposures).tolist()),
    )
    _check_freedom(len(measurements.row), len(sources), layout, settings.order)
    epoch = float(exposures["obstime"].mean())
    places = propagate(sources, epoch, observer_at(np.array([epoch])).position[0])
    centres = calibration_centres(exposures, instrument, layout, settings, axes)
    frame = _shifted(places.frame, catalogue_shift(settings))
    causes = causes_of(exposures, sources, instrument, settings)
    walks = walks_of(layout, exposures["obstime"].to_numpy())
    return Problem(
        order=settings.order,
        geometry=_geometry(frame, exposures, centres, instrument, settings, causes, layout),
        measurements=measurements,
        sources=sources,
        exposures=exposures,
        priors=priors_of(places.covariance, centres, settings, layout, walks),
        layout=layout,
        epoch=epoch,
        elements=axes,
    )


def _check_freedom(n_obs: int, n_src: int, layout: VectorLayout, order: int) -> None:
    """Raise InputError unless there are more data than parameters."""
    possible = orders_held(n_obs, n_src, layout)
    if order in possible:
        return
    hint = f"the highest order they allow is {max(possible)}" if possible else "no order fits"
    raise InputError(
        f"distortion order {order}: expected more than {2 * n_src + layout.size} coordinates "
        f"measured for as many parameters, found {2 * n_obs} "
        f"({n_obs} {plural(n_obs, 'measurement')}); {hint}"
    )


def _shifted(
    frame: Float[np.ndarray, "src 3 3"], shift: Float[np.ndarray, " 2"]
) -> Float[np.ndarray, "src 3 3"]:
    """Return the frames with all directions shifted by (alpha*, delta), mas."""
    if not shift.any():
        return frame
    east, north = np.broadcast_to(RAD_PER_MAS * shift, (len(frame), 2)).T
    return tangent_frame(*sky_position(displaced(frame, east, north)))


def orders_held(n_obs: int, n_src: int, layout: VectorLayout) -> list[int]:
    """Return all distortion orders with fewer parameters than data.

    Parameters
    ----------
    layout : of any order, whether or not it is returned
    """
    others = 2 * n_src + layout.size - 2 * layout.n_coef
    return [n for n in range(MAX_ORDER + 1) if 2 * n_obs > others + 2 * len(terms(n))]


def _geometry(
    source_frame: Float[np.ndarray, "src 3 3"],
    exposures: pd.DataFrame,
    centres: dict[str, Float[np.ndarray, " _"]],
    instrument: Instrument,
    settings: FitSettings,
    causes: ModelledCauses | None,
    layout: VectorLayout,
) -> Geometry:
    satellite = exposures[[f"satellite_v{axis}" for axis in "xyz"]].to_numpy()
    observer = observer_at(exposures["obstime"].to_numpy(), satellite)
    pointing = tangent_frame(
        centres["pointing_ra"] / ARCSEC_PER_DEG, centres["pointing_dec"] / ARCSEC_PER_DEG
    )
    order = max(settings.order, _MIN_COMPUTED_ORDER)
    n_exp = padded_exposures(len(exposures))
    sizes = {
        "src": padded_sources(len(source_frame)),
        "exp": n_exp,
        "coef": len(terms(order)),
        "walk": n_exp * layout.n_walk,
    }
    return Geometry(
        source_frame=pad(source_frame, "src", sizes),
        pointing_frame=pad(pointing, "exp", sizes),
        origin={
            name: pad(values, BY_NAME[name].axis, sizes)
            for name, values in centres.items()
            if name not in FRAME_GROUPS
        },
        velocity=pad(observer.velocity * settings.aberration, "exp", sizes),
        sun_distance=pad(observer.sun_distance, "exp", sizes),
        distortion_scale=np.array(instrument.distortion_scale_um),
        order=order,
        causes=None if causes is None else padded(causes, sizes),
    )
