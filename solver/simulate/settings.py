"""SurveySettings: all numbers of the mini-mock survey, with their sources.

Sections, tables and equations named below are those of the paper. "Chosen" marks a
number that the paper does not give.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from itertools import pairwise

import numpy as np

from solver.data.settings import MAX_ORDER
from solver.errors import InputError
from solver.simulate.defects.table import BY_NAME
from solver.simulate.defects.text import format_defect, parse_defects
from solver.simulate.seasons import SEASONS, Season, read_season
from solver.simulate.streams import Stream, generator
from solver.units import SECONDS_PER_DAY

# Eq. (exp:distortion) as rows k, l, A_kl, B_kl, um.
_DISTORTION_UM = (
    (1, 1, 0.2, 0.3),
    (3, 0, 3.0, 0.0),
    (0, 3, 0.0, -3.0),
    (5, 0, 0.3, 0.0),
    (0, 5, 0.0, 0.5),
)

# Chosen: an orbit covers 7 % of the field, and the density of stars is lower towards the
# target; with 1,250 reference stars in the field an orbit has about 40.
_MIN_REFERENCES = 1_250
_MIN_ARTIFICIAL = 10

# Settings that are not written at their defaults: surveys of older versions lack them.
_LATER = ("magnitudes", "noise_by_magnitude", "defects")


@dataclass(frozen=True)
class SurveySettings:
    """Settings of one simulated survey; the defaults are the paper's."""

    # Size of the survey.
    orbits: int = 100  # section "Survey Design"
    seed: int = 0  # chosen
    n_stars: int = 132_651  # section "Ground truth catalog"
    n_reference: int = 10_888  # section "Ground truth catalog"; part of n_stars
    n_artificial: int = 1_000  # section "Ground truth catalog"; in addition to n_stars

    # Time: section "Survey Design", Table (exp:epoch), below Eq. (exp:pointing:succeed).
    seasons: tuple[Season, ...] = SEASONS
    exposures_per_field: int = 24
    exposure_s: float = 20.0
    field_change_s: float = 90.0

    # Sky: section "Survey Design", Galactic coordinates.
    target_deg: tuple[float, float] = (-0.3, 0.1)
    field_l_deg: tuple[float, float] = (-1.4, 0.7)
    field_b_deg: tuple[float, float] = (-0.6, 0.6)
    field_margin_deg: float = 0.55
    field_width_deg: float = 0.48
    pair_axes: tuple[str, ...] = ("b", "l")  # the fields of a pair overlap by half along it
    # Chosen: half width of the square around the target in which the centre of each pair is
    # drawn, equal to that of the artificial sources. The centre of the square is then observed
    # in over 80 of 100 orbits and its corners in over 30, as in section "Time-series".
    pair_spread_deg: float = 0.3

    # Attitude and focal length: Eqs. (exp:pointing, exp:pointing:succeed, exp:efl).
    pointing_start_arcsec: float = 1.0
    pointing_walk_arcsec: float = 1.0
    focal_length_start: float = 1e-3  # fraction of the nominal one
    focal_length_walk: float = 1e-4
    # Chosen: the errors of the environment's estimates equal those of the pointing.
    estimate_arcsec: float = 1.0

    # Optics and detectors: Eq. (exp:distortion); section "Survey Design".
    distortion_um: tuple[tuple[int, int, float, float], ...] = _DISTORTION_UM
    # In the paper the detectors are at their nominal positions, which the fit does not know.
    # The standard deviations below displace them once for the whole mission.
    detector_offset_um: float = 0.0
    detector_rotation_deg: float = 0.0
    pitch_relative: float = 0.0

    # Measurements: section "Mock measurements".
    measurement_mas: float = 4.0

    # Reference stars: section "Ground truth catalog", Eq. (exp:error).
    parallax_over_error: float = 5.0  # every star's parallax exceeds this times its error
    reference_parallax_error_mas: float = 0.025
    reference_position_error_mas: float = 0.5
    reference_span_yr: float = 13.0
    reference_epoch_yr: float = 2016.0
    artificial_spread_deg: float = 0.3

    # Catalogue uncertainties of the other sources: Table (exp:resampling).
    vague_position_mas: float = 1_000.0
    vague_motion_mas_yr: float = 1.0
    vague_parallax_mas: float = 1.0

    # Beyond the paper: magnitudes in all tables, and noise that depends on them.
    magnitudes: bool = False
    noise_by_magnitude: bool = False
    # NAME=AMPLITUDE each, as in the table of `solver.simulate.defects`.
    defects: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check all settings; raise `InputError` that names an invalid one."""
        for item in fields(self):
            _check_kind(item.name, getattr(self, item.name), item.default)
        self._check_counts()
        self._check_sky()
        self._check_time()
        self._check_distortion()
        parsed = parse_defects(self.defects).items()
        object.__setattr__(self, "defects", tuple(format_defect(*one) for one in parsed))

    def _check_counts(self) -> None:
        for name in ("orbits", "n_stars", "n_reference", "exposures_per_field"):
            if getattr(self, name) < 1:
                raise InputError(f"expected {name} of at least 1, found {getattr(self, name)}")
        if self.n_reference > self.n_stars:
            raise InputError(
                f"expected n_reference of at most n_stars, {self.n_stars}, found {self.n_reference}"
            )
        for name in ("measurement_mas", "field_width_deg", "exposure_s"):
            if not getattr(self, name) > 0:
                raise InputError(f"expected a positive {name}, found {getattr(self, name)}")

    def _check_sky(self) -> None:
        for name in ("target_deg", "field_l_deg", "field_b_deg"):
            value = getattr(self, name)
            if len(value) != 2 or not all(_is_number(v) for v in value):
                raise InputError(f"expected two numbers in {name}, found {value!r}")
        for name in ("field_l_deg", "field_b_deg"):
            low, high = getattr(self, name)
            if not low < high:
                raise InputError(f"expected {name} from low to high, found {low} to {high}")
        if unknown := [axis for axis in self.pair_axes if axis not in ("l", "b")]:
            raise InputError(f"expected pair_axes out of 'l' and 'b', found {unknown}")
        if not self.pair_axes:
            raise InputError("expected at least one pair of fields in pair_axes, found none")

    def _check_time(self) -> None:
        edges = [edge for season in self.seasons for edge in (season.start_mjd, season.end_mjd)]
        if not edges or any(a >= b for a, b in pairwise(edges)):
            raise InputError("expected at least one season, each after the one before")
        if self.orbits * self.orbit_days > self.season_days:
            raise InputError(
                f"expected at most {int(self.season_days / self.orbit_days)} orbits, one after "
                f"another within the seasons, found {self.orbits}"
            )

    def _check_distortion(self) -> None:
        for row in self.distortion_um:
            if not isinstance(row, tuple) or len(row) != 4 or not all(map(_is_number, row)):
                raise InputError(f"expected rows k, l, A_kl, B_kl in distortion_um, found {row!r}")
            if not all(isinstance(v, int) and v >= 0 for v in row[:2]) or not (
                2 <= row[0] + row[1] <= MAX_ORDER
            ):
                raise InputError(
                    f"expected degrees k, l from 0 with a sum from 2 to {MAX_ORDER} in "
                    f"distortion_um, found {row[:2]}"
                )
        if len({row[:2] for row in self.distortion_um}) < len(self.distortion_um):
            raise InputError("expected each k, l once in distortion_um, found one repeated")

    @property
    def n_fields(self) -> int:
        """Number of fields of an orbit, two per pair."""
        return 2 * len(self.pair_axes)

    @property
    def orbit_days(self) -> float:
        """Time from the first exposure's start to the last one's end, days."""
        exposures = self.n_fields * self.exposures_per_field * self.exposure_s
        return (exposures + (self.n_fields - 1) * self.field_change_s) / SECONDS_PER_DAY

    @property
    def season_days(self) -> float:
        """Length of all seasons together, days."""
        return sum(season.end_mjd - season.start_mjd for season in self.seasons)

    @property
    def amplitudes(self) -> dict[str, float]:
        """Name -> amplitude of each defect, in its unit, in the order of the table of defects."""
        return parse_defects(self.defects)

    @property
    def has_magnitudes(self) -> bool:
        """Whether the tables have magnitudes."""
        needed = any(BY_NAME[name].needs_magnitudes for name in self.amplitudes)
        return self.magnitudes or self.noise_by_magnitude or needed

    def rng(self, stream: Stream, *key: int) -> np.random.Generator:
        """Return the generator of a stream; different keys (such as orbits) are independent."""
        return generator(self.seed, stream, *key)

    def scaled(self, stars: int) -> "SurveySettings":
        """Return the same survey with `stars` stars and the other sources in proportion.

        At least 1,250 reference stars are kept (all stars if there are fewer), so that an
        orbit has about 40 of them, which the solution needs whatever the number of stars. At
        least 10 artificial sources are kept.
        """
        if stars < 1:
            raise InputError(f"expected at least 1 star, found {stars}")
        share = stars / self.n_stars
        references = max(round(share * self.n_reference), min(_MIN_REFERENCES, self.n_reference))
        artificial = max(round(share * self.n_artificial), min(_MIN_ARTIFICIAL, self.n_artificial))
        return replace(
            self,
            n_stars=stars,
            n_reference=min(references, stars),
            n_artificial=artificial,
        )

    def to_dict(self) -> dict[str, object]:
        """Return the settings as numbers, text, lists and dicts; `from_dict` reads them back."""
        values = {name: _plain(value) for name, value in asdict(self).items()}
        return {name: value for name, value in values.items() if value or name not in _LATER}

    @staticmethod
    def from_dict(values: Mapping[str, object]) -> "SurveySettings":
        """Return the settings that `to_dict` wrote.

        Raises
        ------
        InputError
            If a setting is unknown or a value is invalid.
        """
        if unknown := sorted(set(values) - {item.name for item in fields(SurveySettings)}):
            raise InputError(f"expected settings of a survey, found {', '.join(unknown)}")
        given = {name: _frozen(value) for name, value in values.items()}
        if isinstance(seasons := given.get("seasons"), tuple):
            given["seasons"] = tuple(read_season(season) for season in seasons)
        return SurveySettings(**given)  # type: ignore[arg-type]


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _check_kind(name: str, value: object, default: object) -> None:
    """Reject a value of another type than the default, and negative numbers."""
    if isinstance(default, bool):
        valid, expected = isinstance(value, bool), "true or false"
    elif isinstance(default, tuple):
        valid, expected = isinstance(value, tuple), "a sequence"
    else:
        valid = _is_number(value) and value >= 0  # type: ignore[operator]
        expected = "a number of at least 0"
    if isinstance(default, int) and not isinstance(default, bool):
        valid, expected = valid and isinstance(value, int), "an integer of at least 0"
    if not valid:
        raise InputError(f"expected {name} to be {expected}, found {value!r}")


def _plain(value: object) -> object:
    return [_plain(item) for item in value] if isinstance(value, tuple | list) else value


def _frozen(value: object) -> object:
    return tuple(_frozen(item) for item in value) if isinstance(value, list | tuple) else value
