"""Synthetic stars towards the Galactic centre, for a survey without a Gaia catalogue.

The paper's true catalogue is Gaia DR3. Without a copy of it, stars are drawn from a simple
population that reproduces three of its properties: the number of stars with parallaxes above
five times their errors, the number of reference stars among them, and the lower density of
both in the Galactic plane.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from solver.errors import InputError
from solver.simulate.magnitudes import draw_magnitudes
from solver.simulate.settings import SurveySettings
from solver.simulate.sky import motion_to_icrs

# Exponentially decreasing space density (Bailer-Jones et al. 2021), scale length, kpc.
_SCALE_LENGTH_KPC = 1.5
# Dust: a star at distance d (kpc) is seen with probability exp(-k d), where k decreases with
# latitude. The values give 6,000 to 8,000 sources per orbit of the full survey and over 100
# reference stars per exposure (sections "Parameter inference" and "Discussion").
_DUST_PER_KPC = 0.6
_DUST_HEIGHT_DEG = 0.45

# Velocities across the line of sight: that of the Sun (Schonrich et al. 2010), the dispersion
# of the old disc, and Galactic rotation at l = 0, A + B (Bovy 2017).
_SUN_KM_S = (12.24, 7.25)
_DISPERSION_KM_S = (35.0, 20.0)
_ROTATION_KM_S_KPC = 3.4
_KM_S_PER_MAS_YR_KPC = 4.740470464

# DR3's uncertainties against G: the parallax follows the mission's performance model, which
# agrees with the medians of Lindegren et al. (2021); position and motion are proportional to
# it. Stars of equal magnitude scatter by 10 %.
_ERROR_RATIO = {"ra": 0.80, "dec": 0.70, "pmra": 1.03, "pmdec": 0.89, "parallax": 1.0}
_ERROR_SCATTER = 0.1

_MAX_DRAWS = 400


class Stars(NamedTuple):
    """Stars of a population: Galactic coordinates (deg), motions, parallaxes and errors.

    Motions are in right ascension (times cos dec) and declination, mas/yr; `parallax` and
    `parallax_error` are in mas. `error_of` derives the other errors from `parallax_error`, and
    `magnitude` is G.
    """

    l_deg: Float[np.ndarray, " n"]
    b_deg: Float[np.ndarray, " n"]
    pmra: Float[np.ndarray, " n"]
    pmdec: Float[np.ndarray, " n"]
    parallax: Float[np.ndarray, " n"]
    parallax_error: Float[np.ndarray, " n"]
    magnitude: Float[np.ndarray, " n"]

    def error_of(self, name: str) -> Float[np.ndarray, " n"]:
        """Return the uncertainty of `name`, mas or mas/yr."""
        return _ERROR_RATIO[name] * self.parallax_error


def draw_stars(settings: SurveySettings, rng: np.random.Generator) -> tuple[Stars, Stars]:
    """Draw exactly `n_reference` reference stars and `n_stars` - `n_reference` other stars.

    Raises
    ------
    InputError
        If the cuts of the settings leave too few stars of either kind.
    """
    wanted = (settings.n_reference, settings.n_stars - settings.n_reference)
    found: tuple[list[Stars], list[Stars]] = ([], [])
    counts = [0, 0]
    size = 3 * settings.n_stars + 1000
    for _ in range(_MAX_DRAWS):
        stars = _draw(settings, rng, size)
        stars = _select(stars, stars.parallax > settings.parallax_over_error * stars.parallax_error)
        is_reference = satisfies_cuts(
            {name: stars.error_of(name) for name in _ERROR_RATIO}, settings
        )
        for kind, chosen in enumerate((is_reference, ~is_reference)):
            found[kind].append(_select(stars, chosen))
            counts[kind] += int(chosen.sum())
        if all(count >= number for count, number in zip(counts, wanted, strict=True)):
            first, second = (
                _first(kind, number) for kind, number in zip(found, wanted, strict=True)
            )
            return first, second
    raise InputError(
        f"expected cuts that {wanted[0]} reference stars satisfy and {wanted[1]} stars fail, "
        f"found {counts[0]} and {counts[1]} among {size * _MAX_DRAWS} stars drawn"
    )


def satisfies_cuts(
    errors: dict[str, Float[np.ndarray, " n"]], settings: SurveySettings
) -> Bool[np.ndarray, " n"]:
    """Return which stars satisfy the cuts for reference stars, Eq. (exp:error).

    Parameters
    ----------
    errors : uncertainties of ra, dec, parallax (mas), pmra and pmdec (mas/yr)
    """
    span = settings.reference_span_yr
    position = np.sqrt(
        errors["ra"] ** 2
        + errors["dec"] ** 2
        + (span * errors["pmra"]) ** 2
        + (span * errors["pmdec"]) ** 2
    )
    return (errors["parallax"] < settings.reference_parallax_error_mas) & (
        position < settings.reference_position_error_mas
    )


def _draw(settings: SurveySettings, rng: np.random.Generator, size: int) -> Stars:
    magnitude = draw_magnitudes(rng, size)
    distance = rng.gamma(3.0, _SCALE_LENGTH_KPC, size)
    margin = settings.field_margin_deg
    l_deg, b_deg = (
        rng.uniform(low - margin, high + margin, size)
        for low, high in (settings.field_l_deg, settings.field_b_deg)
    )
    pmra, pmdec = motion_to_icrs(l_deg, b_deg, *_motions(distance, rng))
    scatter = np.exp(_ERROR_SCATTER * rng.standard_normal(size))
    error = _parallax_error(magnitude) * scatter
    stars = Stars(l_deg, b_deg, pmra, pmdec, 1.0 / distance, error, magnitude)
    dust = _DUST_PER_KPC * distance * np.exp(-0.5 * (b_deg / _DUST_HEIGHT_DEG) ** 2)
    return _select(stars, rng.random(size) < np.exp(-dust))


def _motions(
    distance: Float[np.ndarray, " n"], rng: np.random.Generator
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return motions in l cos(b) and b, mas/yr, for distances in kpc."""
    along_l, along_b = (
        (spread * rng.standard_normal(distance.size) - sun) / (_KM_S_PER_MAS_YR_KPC * distance)
        for spread, sun in zip(_DISPERSION_KM_S, _SUN_KM_S, strict=True)
    )
    return along_l + _ROTATION_KM_S_KPC / _KM_S_PER_MAS_YR_KPC, along_b


def _parallax_error(magnitude: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Return DR3's parallax uncertainty, mas; it is constant for G < 13."""
    z = 10.0 ** (0.4 * (np.maximum(magnitude, 13.0) - 15.0))
    return 1e-3 * np.sqrt(40.0 + 800.0 * z + 30.0 * z**2)


def _select(stars: Stars, chosen: Bool[np.ndarray, " n"] | slice) -> Stars:
    return Stars(*(column[chosen] for column in stars))


def _first(parts: list[Stars], number: int) -> Stars:
    return _select(
        Stars(*(np.concatenate(columns) for columns in zip(*parts, strict=True))), slice(number)
    )
