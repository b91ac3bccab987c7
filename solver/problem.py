"""Problem: the tables of one orbit as arrays, in the order that the engines work in.

Measurements are sorted by exposure, detector and source, so that those which share a
run of calibration parameters lie together. Shapes are padded to few sizes, because each
new one costs JAX a compilation.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd
from jaxtyping import Bool, Float, Int

from solver.astrometry import propagate, sky_position
from solver.centres import calibration_centres, catalogue_shift
from solver.distortion import terms
from solver.ephemeris import observer_at
from solver.errors import InputError
from solver.forward import Geometry, Index
from solver.instrument import Instrument
from solver.layout import Layout
from solver.orbit import OrbitData
from solver.parameters import CALIBRATION_GROUPS, PARAMETERS, SOURCES
from solver.patches import Patches, patches_of
from solver.priors import Priors, group_widths
from solver.projection import displace, tangent_frame
from solver.settings import MAX_ORDER, FitSettings
from solver.tiles import Gathering, Tiles, lay_tiles
from solver.units import ARCSEC_PER_DEG, RAD_PER_MAS

_KEY = ["field_id", "plate_id"]
# The terms of lower orders are computed with coefficients of zero: one compilation does for all.
_LEAST_ORDER = 5


@dataclass(frozen=True)
class Problem:
    """One orbit, ready to be solved.

    Attributes
    ----------
    order : highest degree of the distortion
    geometry : origins of all parameters, padded along src, exp and coef
    index : source, exposure and detector of each measurement
    measured : pixels from the detector's centre
    sigma : pixels
    row : row of each measurement in the input table
    label : of that row, the same in a table from which others were taken out
    sources : catalogue rows of the measured sources, in ascending source_id
    exposures : environment rows, in order of (field_id, plate_id)
    priors : in offsets from the origins
    layout : columns of the calibration parameters
    patches : the sources by the fields that have seen them
    epoch : mean epoch, MJD in TCB
    """

    order: int
    geometry: Geometry
    index: Index
    measured: Float[np.ndarray, "obs 2"]
    sigma: Float[np.ndarray, "obs 2"]
    row: Int[np.ndarray, " obs"]
    label: Int[np.ndarray, " obs"]
    sources: pd.DataFrame
    exposures: pd.DataFrame
    priors: Priors
    layout: Layout
    patches: Patches
    epoch: float

    @property
    def n_obs(self) -> int:
        """Number of measurements, two coordinates each."""
        return len(self.row)

    @property
    def n_src(self) -> int:
        """Number of measured sources."""
        return len(self.sources)

    @cached_property
    def tiles(self) -> Tiles:
        """The measurements in tiles."""
        return lay_tiles(self.index, self.measured, self.sigma)

    @cached_property
    def by_source(self) -> Gathering:
        """How a 2 x 2 matrix of each slot is gathered by its detector and place in a patch."""
        return self.tiles.by_source(self.patches.position, self.layout.n_det, 4)

    def offsets(
        self, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
    ) -> dict[str, Float[np.ndarray, "..."]]:
        """Return the parameters as `solver.forward.predict` takes them, padded."""
        values = {**self.layout.scatter(theta), SOURCES.name: sources}
        return {g.name: pad(values[g.name], g.axis, self.geometry.sizes) for g in PARAMETERS}

    def gathered(
        self, offsets: Mapping[str, Float[np.ndarray, "..."]]
    ) -> tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]:
        """Return calibration and sources of what `offsets` gives: its inverse."""
        sizes = {"exp": self.layout.n_exp, "coef": self.layout.n_coef}
        values = {g.name: offsets[g.name][: sizes.get(g.axis)] for g in CALIBRATION_GROUPS}
        return self.layout.gather(values), offsets[SOURCES.name][: self.n_src]


def of_rows(problem: Problem, chosen: Bool[np.ndarray, " obs"]) -> Problem:
    """Return the problem with some of its measurements, and all of its parameters."""
    return replace(
        problem,
        index=Index(*(column[chosen] for column in problem.index)),
        measured=problem.measured[chosen],
        sigma=problem.sigma[chosen],
        row=problem.row[chosen],
        label=problem.label[chosen],
    )


def thinned(problem: Problem, keep: Bool[np.ndarray, " src"]) -> Problem:
    """Return the problem with the measurements of some sources alone.

    Its arrays in JAX have the shapes of the whole problem's, so that nothing is compiled anew.
    """
    part = of_rows(problem, keep[problem.index.source])
    index = part.index._replace(source=(np.cumsum(keep) - 1)[part.index.source])
    frames = problem.geometry.source_frame
    kept_first = np.argsort(~np.pad(keep, (0, len(frames) - len(keep))), kind="stable")
    return replace(
        part,
        geometry=replace(problem.geometry, source_frame=frames[kept_first]),
        index=index,
        patches=patches_of(index, problem.exposures, problem.layout, int(keep.sum())),
        sources=problem.sources[keep].reset_index(drop=True),
        priors=problem.priors._replace(precision=problem.priors.precision[keep]),
    )


def build_problem(data: OrbitData, instrument: Instrument, settings: FitSettings) -> Problem:
    """Turn the tables of one orbit into a problem to solve.

    Raises
    ------
    InputError
        If a detector is not part of the instrument, or the measurements cannot hold the
        distortion order asked for.
    """
    exposures = data.exposures.sort_values(_KEY, ignore_index=True)
    measured_ids = np.unique(data.measurements["source_id"].to_numpy())
    sources = data.catalogue.set_index("source_id").loc[measured_ids].reset_index()
    index, row = _index(data.measurements, exposures, measured_ids, instrument)
    layout = Layout(len(exposures), len(terms(settings.order)), len(instrument.detectors))
    _check_freedom(len(row), len(sources), layout, settings.order)

    epoch = float(exposures["obstime"].mean())
    places = propagate(sources, epoch, observer_at(np.array([epoch])).position[0])
    centres = calibration_centres(exposures, instrument, layout, settings)
    frame = _shifted(places.frame, catalogue_shift(settings))
    table = data.measurements.iloc[row]
    return Problem(
        order=settings.order,
        geometry=_geometry(frame, exposures, centres, instrument, settings),
        index=index,
        measured=table[["nx", "ny"]].to_numpy(),
        sigma=table[["sx", "sy"]].to_numpy(),
        row=row,
        label=table.index.to_numpy(),
        sources=sources,
        exposures=exposures,
        priors=_priors(places.covariance, centres, settings, layout),
        layout=layout,
        patches=patches_of(index, exposures, layout, len(sources)),
        epoch=epoch,
    )


def _index(
    measurements: pd.DataFrame,
    exposures: pd.DataFrame,
    source_ids: Int[np.ndarray, " src"],
    instrument: Instrument,
) -> tuple[Index, Int[np.ndarray, " obs"]]:
    """Return the indices of the measurements in working order, and their input rows."""
    source = np.searchsorted(source_ids, measurements["source_id"].to_numpy())
    keys = pd.MultiIndex.from_frame(exposures[_KEY])
    exposure = keys.get_indexer(pd.MultiIndex.from_frame(measurements[_KEY]))
    detector = instrument.index_of(measurements["detector_id"].to_numpy())
    if (detector < 0).any():
        unknown = sorted(set(measurements["detector_id"].to_numpy()[detector < 0].tolist()))
        known = [d.detector_id for d in instrument.detectors]
        raise InputError(
            f"column detector_id of the measurements: expected detectors of the instrument "
            f"{instrument.name!r} ({known}), found {unknown}"
        )
    row = np.lexsort((source, detector, exposure))
    return Index(source[row], exposure[row], detector[row]), row


def _check_freedom(n_obs: int, n_src: int, layout: Layout, order: int) -> None:
    """Refuse a distortion order for which there are more parameters than data."""
    possible = orders_held(n_obs, n_src, layout)
    if order in possible:
        return
    hint = f"the highest order they can hold is {max(possible)}" if possible else "no order fits"
    raise InputError(
        f"distortion order {order}: expected more than {2 * n_src + layout.size} coordinates "
        f"measured for as many parameters, found {2 * n_obs} ({n_obs} measurements); {hint}"
    )


def _shifted(
    frame: Float[np.ndarray, "src 3 3"], shift: Float[np.ndarray, " 2"]
) -> Float[np.ndarray, "src 3 3"]:
    """Return the frames with all directions shifted by so many mas."""
    if not shift.any():
        return frame
    east, north = np.broadcast_to(RAD_PER_MAS * shift, (len(frame), 2)).T
    return tangent_frame(*sky_position(np.asarray(displace(frame, east, north))))


def orders_held(n_obs: int, n_src: int, layout: Layout) -> list[int]:
    """Return the distortion orders, of any, that leave fewer parameters than data.

    Parameters
    ----------
    layout : of an order that need not be one of them
    """
    others = 2 * n_src + layout.size - 2 * layout.n_coef
    return [n for n in range(MAX_ORDER + 1) if 2 * n_obs > others + 2 * len(terms(n))]


def _geometry(
    source_frame: Float[np.ndarray, "src 3 3"],
    exposures: pd.DataFrame,
    centres: dict[str, Float[np.ndarray, " _"]],
    instrument: Instrument,
    settings: FitSettings,
) -> Geometry:
    satellite = exposures[[f"satellite_v{axis}" for axis in "xyz"]].to_numpy()
    observer = observer_at(exposures["obstime"].to_numpy(), satellite)
    pointing = tangent_frame(
        centres["pointing_ra"] / ARCSEC_PER_DEG, centres["pointing_dec"] / ARCSEC_PER_DEG
    )
    order = max(settings.order, _LEAST_ORDER)
    sizes = {
        "src": _rounded_up(len(source_frame), 1024),
        "exp": _rounded_up(len(exposures), 16),
        "coef": len(terms(order)),
    }
    return Geometry(
        source_frame=pad(source_frame, "src", sizes),
        pointing_frame=pad(pointing, "exp", sizes),
        origin={
            group.name: pad(centres[group.name], group.axis, sizes)
            for group in CALIBRATION_GROUPS
            if not group.name.startswith("pointing")
        },
        velocity=pad(observer.velocity * settings.aberration, "exp", sizes),
        sun_distance=pad(observer.sun_distance, "exp", sizes),
        distortion_scale=np.array(instrument.distortion_scale_um),
        order=order,
    )


def _priors(
    covariance: Float[np.ndarray, "src 2 2"],
    centres: dict[str, Float[np.ndarray, " _"]],
    settings: FitSettings,
    layout: Layout,
) -> Priors:
    is_gamma = {
        g.name: np.full(
            len(centres[g.name]), g.family == "gamma" and np.isfinite(settings.width(g.name))
        )
        for g in CALIBRATION_GROUPS
    }
    return Priors(
        centre=layout.gather(centres),
        width=layout.gather(group_widths(settings, centres)),
        is_gamma=layout.gather(is_gamma).astype(bool),
        precision=np.linalg.inv(covariance * settings.width(SOURCES.name) ** 2),
    )


def pad(
    values: Float[np.ndarray, "n ..."], axis: str, sizes: Mapping[str, int]
) -> Float[np.ndarray, "m ..."]:
    """Return `values` lengthened to the size of their axis, where that has one.

    What is added belongs to no measurement, and repeats the last row; but a coefficient acts
    on all measurements, and is zero.
    """
    missing = max(sizes.get(axis, 0) - len(values), 0)
    more = np.zeros(missing) if axis == "coef" else np.repeat(values[-1:], missing, axis=0)
    return np.concatenate([values, more])


def _rounded_up(length: int, step: int) -> int:
    return -(-length // step) * step
