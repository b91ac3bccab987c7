"""True catalogue of a survey, and the reference catalogue resampled from it.

Paper, sections "Ground truth catalog" and "Reference catalog".
"""

import numpy as np
import pandas as pd
from astropy.table import Table as RawTable
from jaxtyping import Float

from solver.data.columns import numpy_dtype
from solver.data.plural import plural
from solver.data.schema import CATALOGUE, TRUTH
from solver.errors import InputError
from solver.model.correlation import ASTROMETRY, CORRELATIONS, correlation_matrices, square_roots
from solver.simulate.gaia import gaia_magnitudes, gaia_stars
from solver.simulate.magnitudes import draw_magnitudes
from solver.simulate.population import Stars, draw_stars, satisfies_cuts
from solver.simulate.settings import SurveySettings
from solver.simulate.sky import galactic_to_icrs, icrs_to_galactic
from solver.simulate.streams import Stream
from solver.units import MAS_PER_DEG

# Gaia's ids in this part of the sky are near 4e18 and always below 6.9e18, so they cannot
# collide with the ids of artificial sources, which the paper assigns by hand.
FIRST_STAR_ID = 4_040_000_000_000_000_000
FIRST_ARTIFICIAL_ID = 9_000_000_000_000_000_000
_MAX_ID_STEP = 2**33

_ERRORS = ("ra", "dec", "pmra", "pmdec", "parallax")
# Rounding correlations to three digits may make an eigenvalue negative by this much.
_EIGENVALUE_TOLERANCE = 5e-3


def truth_catalogue(settings: SurveySettings) -> pd.DataFrame:
    """Return a synthetic true catalogue: stars as observed by Gaia, and artificial sources.

    Returns
    -------
    `schema.TRUTH`, sorted by id: exactly `n_stars` stars, of which exactly `n_reference`
    satisfy the paper's cuts, and `n_artificial` sources without motion. Magnitudes are NaN
    unless the settings ask for them
    """
    rng = settings.rng(Stream.TRUTH)
    references, others = draw_stars(settings, rng)
    stars = pd.concat(
        [_star_table(references, True, settings), _star_table(others, False, settings)]
    )
    stars = stars.iloc[rng.permutation(len(stars))]
    stars["source_id"] = FIRST_STAR_ID + np.cumsum(rng.integers(1, _MAX_ID_STEP, len(stars)))
    truth = _canonical([stars, _artificial(settings, rng)])
    return truth if settings.has_magnitudes else truth.assign(magnitude=np.nan)


def truth_from_gaia(
    table: RawTable | pd.DataFrame, settings: SurveySettings, name: str = "Gaia table"
) -> pd.DataFrame:
    """Select the true catalogue from a table of the Gaia archive, as the paper does.

    Stars are kept if they are in the extended science field and their parallax is well
    measured; `n_stars` and `n_reference` are not used. Artificial sources are added.

    Parameters
    ----------
    table : columns named as in the archive: source_id, ra, dec (deg), parallax (mas), pmra,
        pmdec (mas/yr), their `_error`, ref_epoch (yr) and optionally their correlations;
        in the units that the table specifies, or else in those of the archive
    name : name of the table in messages

    Returns
    -------
    `schema.TRUTH`, sorted by id, with the additional columns `CORRELATIONS`. Only
    `reference_catalogue` uses these: the truth itself is exact

    Raises
    ------
    InputError
        If a column is missing or invalid, or no reference star remains.
    """
    stars = gaia_stars(table, name)
    stars["magnitude"] = np.nan
    if settings.has_magnitudes:
        stars["magnitude"] = gaia_magnitudes(table, stars["source_id"], name)
    _check_ids(stars, name)
    l_deg, b_deg = icrs_to_galactic(stars["ra"].to_numpy(), stars["dec"].to_numpy())
    inside = stars["parallax"] > settings.parallax_over_error * stars["parallax_error"]
    for value, (low, high) in ((l_deg, settings.field_l_deg), (b_deg, settings.field_b_deg)):
        margin = settings.field_margin_deg
        inside &= (value >= low - margin) & (value <= high + margin)
    stars = stars[inside]
    errors = {item: stars[f"{item}_error"].to_numpy() for item in _ERRORS}
    stars = stars.assign(is_reference=satisfies_cuts(errors, settings), is_artificial=False)
    if not stars["is_reference"].any():
        raise InputError(
            f"{name}: expected stars that satisfy the cuts for reference stars in the field, "
            f"found none among {len(table)} {plural(len(table), 'row')}, {len(stars)} of them "
            f"in the field with a parallax over {settings.parallax_over_error:g} times its error"
        )
    _check_correlations(stars[stars["is_reference"]], name)
    artificial = _artificial(settings, settings.rng(Stream.TRUTH)).assign(
        **dict.fromkeys(CORRELATIONS, 0.0)
    )
    if not settings.has_magnitudes:
        artificial["magnitude"] = np.nan
    return _canonical([stars, artificial], CORRELATIONS)


def reference_catalogue(truth: pd.DataFrame, settings: SurveySettings) -> pd.DataFrame:
    """Resample a true catalogue by Table (exp:resampling).

    Reference stars are drawn with their own uncertainties, and with their correlations if
    `truth` has the columns `CORRELATIONS`. The other sources are drawn with the large
    uncertainties of the settings (`vague_*`), which replace their own and are uncorrelated.

    Returns
    -------
    `schema.CATALOGUE`, in the order of `truth`
    """
    rng = settings.rng(Stream.REFERENCE)
    catalogue = truth.copy()
    is_reference = truth["is_reference"].to_numpy()
    vague_errors = _vague_errors(settings)
    pulls = {name: rng.standard_normal(len(truth)) for name in vague_errors}
    if set(CORRELATIONS) <= set(truth):
        catalogue.loc[~is_reference, list(CORRELATIONS)] = 0.0
        pulls = _correlated(pulls, catalogue)
    for name, vague in vague_errors.items():
        sigma = np.where(is_reference, truth[f"{name}_error"].to_numpy(), vague)
        catalogue[f"{name}_error"] = sigma
        catalogue[name] += sigma * pulls[name] * _per_mas(name, truth)
    # An error may lead across 0h.
    catalogue["ra"] %= 360.0
    for column in CATALOGUE:
        if column.name not in catalogue:
            catalogue[column.name] = column.default
    return catalogue[CATALOGUE.names]


def _correlated(
    pulls: dict[str, Float[np.ndarray, " src"]], catalogue: pd.DataFrame
) -> dict[str, Float[np.ndarray, " src"]]:
    """Correlate independent normal deviates as the catalogue specifies."""
    # Rows without correlations are skipped, so that their deviates remain bit-identical.
    chosen = (catalogue[list(CORRELATIONS)] != 0.0).any(axis=1).to_numpy()
    roots = square_roots(correlation_matrices(catalogue[chosen]))
    independent = np.stack([pulls[name][chosen] for name in ASTROMETRY], axis=-1)
    mixed = (roots @ independent[:, :, None])[:, :, 0]
    result = {name: values.copy() for name, values in pulls.items()}
    for index, name in enumerate(ASTROMETRY):
        result[name][chosen] = mixed[:, index]
    return result


def _vague_errors(settings: SurveySettings) -> dict[str, float]:
    return {
        "ra": settings.vague_position_mas,
        "dec": settings.vague_position_mas,
        "pmra": settings.vague_motion_mas_yr,
        "pmdec": settings.vague_motion_mas_yr,
        "parallax": settings.vague_parallax_mas,
    }


def _per_mas(name: str, truth: pd.DataFrame) -> Float[np.ndarray, " src"] | float:
    """Return 1 mas (of alpha* for ra) in the unit of column `name`; 1 for other units."""
    if name == "ra":
        return 1.0 / (MAS_PER_DEG * np.cos(np.radians(truth["dec"].to_numpy())))
    return 1.0 / MAS_PER_DEG if name == "dec" else 1.0


def _star_table(stars: Stars, is_reference: bool, settings: SurveySettings) -> pd.DataFrame:
    ra, dec = galactic_to_icrs(stars.l_deg, stars.b_deg)
    return pd.DataFrame(
        {
            "ra": ra,
            "dec": dec,
            "pmra": stars.pmra,
            "pmdec": stars.pmdec,
            "parallax": stars.parallax,
            **{f"{name}_error": stars.error_of(name) for name in _ERRORS},
            "ref_epoch": settings.reference_epoch_yr,
            "is_reference": is_reference,
            "is_artificial": False,
            "magnitude": stars.magnitude,
        }
    )


def _artificial(settings: SurveySettings, rng: np.random.Generator) -> pd.DataFrame:
    """Return exactly known sources without motion or parallax around the target."""
    number, spread = settings.n_artificial, settings.artificial_spread_deg
    l_deg, b_deg = (centre + rng.uniform(-spread, spread, number) for centre in settings.target_deg)
    ra, dec = galactic_to_icrs(l_deg, b_deg)
    zeros = (*(f"{name}_error" for name in _ERRORS), "pmra", "pmdec", "parallax")
    return pd.DataFrame(
        {
            "source_id": FIRST_ARTIFICIAL_ID + np.arange(number),
            "ra": ra,
            "dec": dec,
            **dict.fromkeys(zeros, 0.0),
            "ref_epoch": settings.reference_epoch_yr,
            "is_reference": False,
            "is_artificial": True,
            "magnitude": draw_magnitudes(settings.rng(Stream.MAGNITUDES), number),
        }
    )


def _canonical(parts: list[pd.DataFrame], extra: tuple[str, ...] = ()) -> pd.DataFrame:
    types = {column.name: numpy_dtype(column) for column in TRUTH}
    names = [*TRUTH.names, *extra]
    whole = pd.concat([part[names].astype(types) for part in parts if len(part)])
    return whole.sort_values("source_id", ignore_index=True)


def _check_ids(stars: pd.DataFrame, name: str) -> None:
    if (stars["source_id"] >= FIRST_ARTIFICIAL_ID).any():
        raise InputError(
            f"{name}, column source_id: expected ids below {FIRST_ARTIFICIAL_ID}, the "
            f"first id of artificial sources, found {stars['source_id'].max()}"
        )


def _check_correlations(stars: pd.DataFrame, name: str) -> None:
    lowest = np.linalg.eigvalsh(correlation_matrices(stars))[:, 0]
    if (bad := lowest < -_EIGENVALUE_TOLERANCE).any():
        raise InputError(
            f"{name}, columns *_corr: expected correlations that form a positive semidefinite "
            f"matrix, found others in {int(bad.sum())} reference stars, "
            f"the first is {stars['source_id'].to_numpy()[np.argmax(bad)]}"
        )
