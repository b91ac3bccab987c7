"""The true catalogue of a survey, and the reference catalogue resampled from it.

Paper, sections "Ground truth catalog" and "Reference catalog".
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from jaxtyping import Float

from solver.columns import numpy_dtype
from solver.errors import InputError
from solver.schema import CATALOGUE, TRUTH
from solver.simulate.population import Stars, draw_stars, satisfies_cuts
from solver.simulate.settings import Stream, SurveySettings
from solver.simulate.sky import galactic_to_icrs, icrs_to_galactic
from solver.units import MAS_PER_DEG

# Gaia's ids of this part of the sky lie near 4e18 and stay below 6.9e18, so that the ids
# of artificial sources, which the paper assigns by hand, cannot be a star's.
FIRST_STAR_ID = 4_040_000_000_000_000_000
FIRST_ARTIFICIAL_ID = 9_000_000_000_000_000_000
_LONGEST_ID_STEP = 2**33

_ERRORS = ("ra", "dec", "pmra", "pmdec", "parallax")
_GAIA_COLUMNS = ("source_id", *_ERRORS, *(f"{name}_error" for name in _ERRORS), "ref_epoch")


def truth_catalogue(settings: SurveySettings) -> pd.DataFrame:
    """Return a synthetic true catalogue: stars as Gaia sees them, and artificial sources.

    Returns
    -------
    `schema.TRUTH`, in order of id: exactly `n_stars` stars, of which exactly `n_reference`
    satisfy the paper's cuts, and `n_artificial` sources that do not move
    """
    rng = settings.rng(Stream.TRUTH)
    references, others = draw_stars(settings, rng)
    stars = pd.concat(
        [_star_table(references, True, settings), _star_table(others, False, settings)]
    )
    stars = stars.iloc[rng.permutation(len(stars))]
    stars["source_id"] = FIRST_STAR_ID + np.cumsum(rng.integers(1, _LONGEST_ID_STEP, len(stars)))
    return _canonical([stars, _artificial(settings, rng)])


def truth_from_gaia(
    table: pd.DataFrame, settings: SurveySettings, name: str = "Gaia table"
) -> pd.DataFrame:
    """Select the true catalogue from a table of the Gaia archive, as the paper does.

    Stars are kept that lie in the extended science field and whose parallax is well
    measured; `n_stars` and `n_reference` play no part. Artificial sources are added.

    Parameters
    ----------
    table : columns named and in units as in the archive: source_id, ra, dec (deg),
        parallax (mas), pmra, pmdec (mas/yr), their `_error` and ref_epoch (yr)
    name : what messages call the table

    Returns
    -------
    `schema.TRUTH`, in order of id

    Raises
    ------
    InputError
        If a column is missing or not numbers, or no reference star is left.
    """
    _check_gaia(table, name)
    stars = table.loc[:, list(_GAIA_COLUMNS)]
    stars = stars[np.isfinite(stars.to_numpy(dtype=np.float64, na_value=np.nan)).all(axis=1)]
    stars = stars.astype({name: numpy_dtype(TRUTH[name]) for name in _GAIA_COLUMNS})
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
            f"found none among {len(table)} rows, {len(stars)} of them in the field with a "
            f"parallax over {settings.parallax_over_error:g} times its error"
        )
    return _canonical([stars, _artificial(settings, settings.rng(Stream.TRUTH))])


def reference_catalogue(truth: pd.DataFrame, settings: SurveySettings) -> pd.DataFrame:
    """Resample a true catalogue by Table (exp:resampling).

    Reference stars scatter by their own uncertainties; all other sources by the vague ones
    of the settings, which replace their uncertainties.

    Returns
    -------
    `schema.CATALOGUE`, in the order of `truth`
    """
    rng = settings.rng(Stream.REFERENCE)
    catalogue = truth.copy()
    is_reference = truth["is_reference"].to_numpy()
    for name, vague in _vague_errors(settings).items():
        sigma = np.where(is_reference, truth[f"{name}_error"].to_numpy(), vague)
        catalogue[f"{name}_error"] = sigma
        catalogue[name] += sigma * rng.standard_normal(len(truth)) * _per_mas(name, truth)
    for column in CATALOGUE:
        if column.name not in catalogue:
            catalogue[column.name] = column.default
    return catalogue[CATALOGUE.names]


def _vague_errors(settings: SurveySettings) -> dict[str, float]:
    return {
        "ra": settings.vague_position_mas,
        "dec": settings.vague_position_mas,
        "pmra": settings.vague_motion_mas_yr,
        "pmdec": settings.vague_motion_mas_yr,
        "parallax": settings.vague_parallax_mas,
    }


def _per_mas(name: str, truth: pd.DataFrame) -> Float[np.ndarray, " src"] | float:
    """Return what 1 mas of alpha*, delta or anything else is in the column's unit."""
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
        }
    )


def _artificial(settings: SurveySettings, rng: np.random.Generator) -> pd.DataFrame:
    """Return sources without motion or parallax about the target, exactly known."""
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
        }
    )


def _canonical(parts: list[pd.DataFrame]) -> pd.DataFrame:
    types = {column.name: numpy_dtype(column) for column in TRUTH}
    whole = pd.concat([part[TRUTH.names].astype(types) for part in parts if len(part)])
    return whole.sort_values("source_id", ignore_index=True)


def _check_gaia(table: pd.DataFrame, name: str) -> None:
    if missing := [column for column in _GAIA_COLUMNS if column not in table]:
        raise InputError(
            f"{name}: expected the columns {', '.join(_GAIA_COLUMNS)}, "
            f"found no {', '.join(missing)}"
        )
    kinds: Mapping[str, str] = {column: table[column].dtype.kind for column in _GAIA_COLUMNS}
    if wrong := [column for column, kind in kinds.items() if kind not in "iuf"]:
        raise InputError(f"{name}: expected numbers, found other values in {', '.join(wrong)}")
    if kinds["source_id"] == "f":
        raise InputError(
            f"{name}, column source_id: expected integers, found floating-point numbers, "
            f"which cannot hold the ids of Gaia"
        )
    if table["source_id"].duplicated().any():
        raise InputError(f"{name}, column source_id: expected each source once, found repeats")
    if (table["source_id"] >= FIRST_ARTIFICIAL_ID).any():
        raise InputError(
            f"{name}, column source_id: expected ids below {FIRST_ARTIFICIAL_ID}, which are "
            f"kept for artificial sources, found {table['source_id'].max()}"
        )
