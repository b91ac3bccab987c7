"""What a cause in the catalogue spoils, or in the times of the exposures, and by how much."""

import numpy as np
import pandas as pd

from plateviz.tables.labels import id_strings
from plateviz.tables.reference_influence import reference_influence
from plateviz.tables.rounded import rounded
from plateviz.verdict.cause_case import Case
from solver.data.result import FitResult
from solver.units import DAYS_PER_JULIAN_YEAR

# Sources with fewer measurements do not say how good a solution is.
_MIN_OBS = 10
# A shift larger than this share of the positions' uncertainty makes it wrong by a tenth.
LARGE_SHARE = 0.5
# Other stars that are wrong, of all, are not few.
_MANY_STARS = 0.02
# Rms deviation of the reference stars over its expected value, beyond which the frame is wrong.
_LARGE_DEVIATION = 1.2


def harm_of_epoch(case: Case) -> tuple[str, bool]:
    """Return what a wrong time of all exposures spoils, in words, and whether that is much."""
    rows = case.result.sources
    motion = rows.loc[rows["is_reference"].astype(bool), ["prior_pmra", "prior_pmdec"]]
    error = (
        abs(case.found.size) / DAYS_PER_JULIAN_YEAR * float(np.sqrt(np.nanmean(motion.var(ddof=0))))
    )
    typical = typical_sigma(case.result)
    spoils = (
        "Each position is that of another time, off by the star's own motion since then, "
        f"{rounded(error)} mas rms for the reference stars, where a typical uncertainty is "
        f"{rounded(typical)} mas."
    )
    return spoils, error > LARGE_SHARE * typical or are_references_off(case.result)


def harm_of_references(case: Case) -> tuple[str, bool]:
    """Return the same for reference stars that are nearer to the catalogue, or further."""
    found = case.found
    if found.test.statistic < found.test.expected:
        return "It spoils the error that all positions share, which is smaller than stated.", False
    spoils = (
        "It spoils the error that all positions share, which is up to "
        f"{rounded(found.size)} times as large as stated."
    )
    return spoils, are_references_off(case.result)


def harm_of_others(case: Case) -> tuple[str, bool]:
    """Return the same for stars other than references that the catalogue has elsewhere.

    A catalogue position counts with the inverse of its variance, against that of the measurements.
    """
    rows, items = case.result.sources, case.found.items
    chosen = rows["source_id"].isin(items) if items else ~rows["is_reference"].astype(bool)
    sigma, prior, offset = (
        rows.loc[chosen, [name.format(axis) for axis in ("ra", "dec")]].to_numpy(dtype=float)
        for name in ("sigma_{}_marginal", "prior_sigma_{}", "offset_{}")
    )
    shift = float(np.sqrt(np.nanmean(np.square(offset * (sigma / prior) ** 2))))
    typical = float(np.nanmedian(sigma))
    frame, shared = _pull_on_frame(rows, offset, prior), shared_error(case.result)
    words = (
        f"these positions by {rounded(shift)} mas rms, where their uncertainty is "
        f"{rounded(typical)} mas, "
        f"and the frame by about {rounded(frame)} mas, where the error that all positions share is "
        f"{rounded(shared)} mas."
    )
    is_large = shift > LARGE_SHARE * typical or frame > LARGE_SHARE * shared
    if not items:
        return f"It shifts {words}", is_large
    is_large |= len(items) > _MANY_STARS * len(rows)
    return (
        "If the identification is wrong, these positions are wrong altogether; if the catalogue "
        f"is, it shifts {words}",
        is_large,
    )


def _pull_on_frame(rows: pd.DataFrame, offset: np.ndarray, prior: np.ndarray) -> float:
    """Return by how much some stars pull the mean of all, against the reference stars, mas."""
    names = ["prior_sigma_ra", "prior_sigma_dec"]
    references = rows.loc[rows["is_reference"].astype(bool), names].to_numpy(dtype=float)
    weight = np.maximum(np.sum(references**-2.0, axis=0), np.finfo(float).tiny)
    return float(np.linalg.norm(np.nansum(offset / prior**2, axis=0) / weight))


def shared_error(result: FitResult) -> float:
    """Return the error that all positions share, mas."""
    return float(np.linalg.norm([result.summary[f"mean_error_{axis}"] for axis in ("ra", "dec")]))


def frame_shift(case: Case) -> float:
    """Return by how much reference stars that are wrong shift the mean of all, mas.

    Each counts with the inverse variance of its catalogue position against the fit without it.
    """
    table = reference_influence(case.result).dropna()
    wrong = table["id"].isin(id_strings(pd.Series(case.found.items, dtype=np.int64)))
    shift = []
    for axis in ("ra", "dec"):
        residual = table[f"residual_{axis}"].to_numpy()
        weight = (table[f"pull_{axis}"].to_numpy() / residual) ** 2
        shift.append(float(np.nansum((weight * residual)[wrong]) / np.nansum(weight)))
    return float(np.linalg.norm(shift))


def are_references_off(result: FitResult) -> bool:
    """Return whether the reference stars deviate from the catalogue by much more than expected."""
    summary = result.summary
    return any(
        float(summary[f"normalised_deviation_{axis}"])
        > _LARGE_DEVIATION * float(summary[f"expected_normalised_deviation_{axis}"])
        for axis in ("ra", "dec")
    )


def typical_sigma(result: FitResult) -> float:
    """Return the median marginal uncertainty of the positions, mas."""
    sources = result.sources
    many = ~sources["is_reference"] & (sources["n_obs"] >= _MIN_OBS)
    rows = sources[many] if many.any() else sources
    return float(np.median(rows[["sigma_ra_marginal", "sigma_dec_marginal"]]))
