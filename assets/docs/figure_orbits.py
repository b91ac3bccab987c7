"""Orbits for the example figures of the documents: one good, the others with one defect each.

Each defect is introduced into the measurements, the catalogue or the settings of the same simulated
orbit, which is then fitted and drawn like any other.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from plateviz.plots.diagnostic import Chosen
from solver.data.engine_settings import SviSettings
from solver.data.instrument import MINI_MOCK
from solver.data.orbit import OrbitData
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.fit import fit_orbit
from solver.io.survey import read_survey_orbit
from solver.simulate.magnitudes import draw_magnitudes
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey

_SKY = SurveySettings(orbits=1, seed=1).scaled(18_000)
_VAGUE = {"ra_error": 1000.0, "dec_error": 1000.0, "pmra_error": 1.0, "pmdec_error": 1.0}
_CALIBRATION = ("detector_x", "detector_y", "distortion_x", "distortion_y")
# The exposures whose residuals are drawn.
_FIELD = tuple((0, plate) for plate in range(24))
_FIELDS = tuple((field, plate) for field in range(4) for plate in range(24))


@cache
def _orbit() -> OrbitData:
    with TemporaryDirectory() as folder:
        directory = Path(folder) / "survey"
        simulate_survey(directory, _SKY)
        return read_survey_orbit(directory, 0)


@cache
def _good() -> FitResult:
    return fit_orbit(_orbit(), settings=FitSettings(compare_orders=True))


def _fitted(data: OrbitData | None = None, **settings: object) -> FitResult:
    return fit_orbit(data or _orbit(), settings=FitSettings(**settings))  # type: ignore[arg-type]


@cache
def _low_order() -> FitResult:
    return _fitted(order=3, compare_orders=True)


def _measured(change: Callable[[pd.DataFrame, np.random.Generator], None]) -> OrbitData:
    """Return the orbit with its measurements changed in place."""
    rows = _orbit().measurements.copy()
    change(rows, np.random.default_rng(1))
    return replace(_orbit(), measurements=rows)


def _understated(rows: pd.DataFrame, random: np.random.Generator) -> None:
    """Make the errors 1.5 times as large as stated, and one measurement in a hundred an outlier."""
    for axis in "xy":
        scale = np.sqrt(1.5**2 - 1.0) * rows[f"s{axis}"]
        rows[f"n{axis}"] += scale * random.standard_normal(len(rows))
        wrong = random.random(len(rows)) < 0.01
        rows.loc[wrong, f"n{axis}"] += 6.0 * rows[f"s{axis}"] * random.choice([-1, 1], len(rows))


def _moved_detector(rows: pd.DataFrame, _: np.random.Generator) -> None:
    """Move detector 1 by 0.1 pixels in x, half way through each field."""
    late = (rows["detector_id"] == 1) & (rows["plate_id"] >= 12)
    rows.loc[late, "nx"] += 0.1


def _displaced_columns(rows: pd.DataFrame, _: np.random.Generator) -> None:
    """Displace the last 160 columns of detector 3 along x, by about the measurement error."""
    edge = (rows["detector_id"] == 3) & (rows["nx"] > 800.0)
    rows.loc[edge, "nx"] += 0.012


def _drifting_detector(rows: pd.DataFrame, _: np.random.Generator) -> None:
    """Move detector 1 along x in the course of each field, by 0.02 pixels."""
    on = rows["detector_id"] == 1
    rows.loc[on, "nx"] += 0.02 * rows.loc[on, "plate_id"] / 23.0


def _moved_in_field(rows: pd.DataFrame, _: np.random.Generator) -> None:
    """Move detector 2 along x in field 3, by the measurement error."""
    rows.loc[(rows["detector_id"] == 2) & (rows["field_id"] == 3), "nx"] += 0.01


def _displaced_stars(rows: pd.DataFrame, _: np.random.Generator) -> None:
    """Displace two reference stars in one of their fields, by twice the measurement error."""
    known = _orbit().catalogue.query("is_reference")["source_id"]
    of_star = rows[rows["source_id"].isin(known)].groupby("source_id")
    often = of_star["field_id"].nunique().sort_values(kind="stable").index[-2:]
    for star in often:
        field = rows.loc[rows["source_id"] == star, "field_id"].max()
        rows.loc[(rows["source_id"] == star) & (rows["field_id"] == field), "nx"] += 0.02


def _deforming(rows: pd.DataFrame, random: np.random.Generator) -> None:
    """Add gradients of waves of 12 mm to each exposure, of a quarter of the measurement error."""
    number = {d.detector_id: i for i, d in enumerate(MINI_MOCK.detectors)}
    own = rows["detector_id"].map(number).to_numpy()
    angle = np.radians([d.rotation_deg for d in MINI_MOCK.detectors])[own]
    centre = np.array([(d.x_um, d.y_um) for d in MINI_MOCK.detectors])[own].T / 1000.0
    nx, ny = 0.01 * rows["nx"].to_numpy(), 0.01 * rows["ny"].to_numpy()
    place = (np.cos(angle) * nx + np.sin(angle) * ny, np.cos(angle) * ny - np.sin(angle) * nx)
    exposure = rows.groupby(["field_id", "plate_id"]).ngroup().to_numpy()
    field = np.zeros((2, len(rows)))
    for _ in range(12):
        towards, start = random.uniform(0.0, 2.0 * np.pi, (2, exposure.max() + 1))[:, exposure]
        along = np.cos(towards) * (place[0] + centre[0]) + np.sin(towards) * (place[1] + centre[1])
        wave = 0.001 * np.sin(2.0 * np.pi / 12.0 * along + start)
        field += wave * np.array([np.cos(towards), np.sin(towards)])
    rows["nx"] += np.cos(angle) * field[0] - np.sin(angle) * field[1]
    rows["ny"] += np.sin(angle) * field[0] + np.cos(angle) * field[1]


def _depending_on_phase(rows: pd.DataFrame, _: np.random.Generator) -> None:
    """Displace measurements along x by a sine of their pixel phase, a tenth of their error."""
    rows["nx"] += 0.001 * np.sin(2.0 * np.pi * rows["nx"])


def _with_magnitudes(data: OrbitData) -> FitResult:
    """Fit with magnitudes in the catalogue, which the simulated orbit has not."""
    catalogue = data.catalogue
    magnitude = draw_magnitudes(np.random.default_rng(3), len(catalogue))
    return _fitted(replace(data, catalogue=catalogue.assign(magnitude=magnitude)))


def _trailed(rows: pd.DataFrame, random: np.random.Generator) -> None:
    """Smear two exposures along x."""
    for field, plate in ((1, 9), (2, 20)):
        smeared = (rows["field_id"] == field) & (rows["plate_id"] == plate)
        rows.loc[smeared, "nx"] += 0.02 * random.standard_normal(int(smeared.sum()))


def _with_tails(rows: pd.DataFrame, random: np.random.Generator) -> None:
    """Make the errors of one measurement in twenty three times as large, in three exposures."""
    for field, plate in ((0, 17), (1, 9), (3, 4)):
        taken = (rows["field_id"] == field) & (rows["plate_id"] == plate)
        wrong = rows.index[taken & (random.random(len(rows)) < 0.05)]
        for axis in "xy":
            added = np.sqrt(3.0**2 - 1.0) * random.standard_normal(len(wrong))
            rows.loc[wrong, f"n{axis}"] += added * rows.loc[wrong, f"s{axis}"]


def _mismatched(rows: pd.DataFrame, random: np.random.Generator) -> None:
    """Take a neighbour for the star in 15 measurements, and let a star move during the orbit."""
    wrong = random.choice(len(rows), 15, replace=False)
    rows.loc[rows.index[wrong], "nx"] += 0.01 * random.uniform(8.0, 20.0, 15)
    often = rows["source_id"].value_counts().index[0]
    moving = rows["source_id"] == often
    rows.loc[moving, "nx"] += 0.002 * (rows.loc[moving, "plate_id"] - 12.0)


@cache
def _wrong_references() -> FitResult:
    """Fit with two reference sources of which the catalogue has a wrong position."""
    catalogue = _orbit().catalogue.copy()
    measured = _orbit().measurements["source_id"].value_counts()
    rows = catalogue.index[catalogue["is_reference"] & catalogue["source_id"].isin(measured.index)]
    for row, mas in zip(rows[:2], (6.0, -9.0), strict=True):
        catalogue.loc[row, "dec"] += mas / 3.6e6
    return _fitted(replace(_orbit(), catalogue=catalogue))


def _stale_attitude() -> FitResult:
    """Fit with estimates of the pointing that lag behind in a field, and a narrow prior."""
    exposures = _orbit().exposures.copy()
    late = (exposures["field_id"] == 2) & (exposures["plate_id"] >= 12)
    exposures.loc[late, "dec_est"] -= 12.0 / 3600.0
    narrow = dict.fromkeys(("pointing_ra", "pointing_dec"), 3.0)
    return _fitted(replace(_orbit(), exposures=exposures), prior_widths=narrow)


@cache
def _few_references() -> FitResult:
    """Fit with five reference sources, all in the east of the orbit's fields."""
    catalogue = _orbit().catalogue.copy()
    known = catalogue[catalogue["is_reference"]].sort_values("ra", ascending=False)
    dropped = known.index[5:]
    catalogue.loc[dropped, "is_reference"] = False
    random = np.random.default_rng(2)
    for name, error in _VAGUE.items():
        catalogue.loc[dropped, name] = error
        if name in ("ra_error", "dec_error"):
            shift = error / 3.6e6 * random.standard_normal(len(dropped))
            catalogue.loc[dropped, name.removesuffix("_error")] += shift
    return _fitted(replace(_orbit(), catalogue=catalogue))


@cache
def _overconfident_catalogue() -> FitResult:
    """Fit with a catalogue that states the errors of its reference sources five times too small."""
    catalogue = _orbit().catalogue.copy()
    references = catalogue["is_reference"]
    for name in ("ra_error", "dec_error", "pmra_error", "pmdec_error"):
        catalogue.loc[references, name] /= 5.0
    return _fitted(replace(_orbit(), catalogue=catalogue))


@cache
def _one_field() -> FitResult:
    """Fit only five exposures of a single field, without overlap with another."""
    kept = {(0, plate) for plate in range(5)}
    exposures = _orbit().exposures[["field_id", "plate_id"]].itertuples(index=False, name=None)
    return _fitted(exclusions=Subset(exposures=frozenset(set(exposures) - kept)))


def _sparse_distortion() -> FitResult:
    flat = dict.fromkeys(("distortion_x", "distortion_y"), float("inf"))
    return _fitted(order=9, thin=12, prior_widths=flat)


def _assumed() -> FitResult:
    tight = {"detector_x": 0.05, "detector_y": 0.05, "distortion_x": 0.005, "distortion_y": 0.005}
    return _fitted(prior_widths=tight)


def _by_svi(svi: SviSettings) -> FitResult:
    return _fitted(thin=4, engine="svi", svi=svi)


def _chosen(
    result: FitResult,
    other: FitResult | None = None,
    detector: int | None = None,
    plates: tuple[tuple[int, int], ...] = _FIELD,
) -> Chosen:
    return Chosen(result, MINI_MOCK, plates, detector, other)


def _good_chosen() -> Chosen:
    return _chosen(_good())


def _with_wider_priors() -> Chosen:
    return _chosen(_fitted(prior_widths=dict.fromkeys(_CALIBRATION[2:], 2.0)), _good())


def _with_low_order() -> Chosen:
    return _chosen(_low_order(), _good())


Pair = tuple[Callable[[], Chosen], Callable[[], Chosen]]

ORBITS: Mapping[str, Pair] = {
    "footprint": (_good_chosen, lambda: _chosen(_few_references())),
    "residual-map": (
        lambda: _chosen(_good(), plates=_FIELDS),
        lambda: _chosen(_fitted(order=2), plates=_FIELDS),
    ),
    "binned-residuals": (
        lambda: _chosen(_with_magnitudes(_orbit())),
        lambda: _chosen(_with_magnitudes(_measured(_depending_on_phase))),
    ),
    "mean-residual-map": (_good_chosen, lambda: _chosen(_fitted(_measured(_displaced_columns)))),
    "field-residuals": (_good_chosen, lambda: _chosen(_fitted(_measured(_moved_in_field)))),
    "solution-tests": (_good_chosen, lambda: _chosen(_fitted(_measured(_drifting_detector)))),
    "residual-scatter": (
        lambda: _chosen(_good(), detector=1),
        lambda: _chosen(_fitted(_measured(_moved_detector)), detector=1),
    ),
    "pulls": (_good_chosen, lambda: _chosen(_fitted(_measured(_understated)))),
    "residual-tails": (_good_chosen, lambda: _chosen(_fitted(_measured(_with_tails)))),
    "residual-correlation": (_good_chosen, lambda: _chosen(_fitted(_measured(_deforming)))),
    "largest-residuals": (_good_chosen, lambda: _chosen(_fitted(_measured(_mismatched)))),
    "deviation": (_good_chosen, lambda: _chosen(_overconfident_catalogue())),
    "uncertainty": (_good_chosen, lambda: _chosen(_few_references())),
    "reference-influence": (_good_chosen, lambda: _chosen(_wrong_references())),
    "reference-fields": (_good_chosen, lambda: _chosen(_fitted(_measured(_displaced_stars)))),
    "exposure-chi2": (_good_chosen, lambda: _chosen(_fitted(_measured(_trailed)))),
    "detector-shifts": (_good_chosen, lambda: _chosen(_fitted(_measured(_drifting_detector)))),
    "exposure-tracks": (_good_chosen, lambda: _chosen(_stale_attitude())),
    "distortion": (_good_chosen, lambda: _chosen(_sparse_distortion())),
    "distortion-truth": (
        lambda: replace(_good_chosen(), simulation=_SKY),
        lambda: replace(_chosen(_low_order()), simulation=_SKY),
    ),
    "prior-shares": (_good_chosen, lambda: _chosen(_assumed())),
    "eigenmode-spectrum": (_good_chosen, lambda: _chosen(_one_field())),
    "orders": (_good_chosen, lambda: _chosen(_low_order())),
    "weak-directions": (_good_chosen, lambda: _chosen(_one_field())),
    "eigenmode-groups": (_good_chosen, lambda: _chosen(_one_field())),
    "eigenmode-shifts": (_good_chosen, lambda: _chosen(_few_references())),
    "comparison": (_with_wider_priors, _with_low_order),
    "distortion-comparison": (_with_wider_priors, _with_low_order),
    "convergence": (
        lambda: _chosen(_by_svi(SviSettings())),
        lambda: _chosen(_by_svi(SviSettings(steps=150, max_steps=150))),
    ),
}
