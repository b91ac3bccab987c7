"""What a cause spoils, by how much, and whether that is so much that nobody should trust it."""

import numpy as np
import pandas as pd

from plateviz.tables.labels import id_strings
from plateviz.tables.reference_influence import reference_influence
from plateviz.tables.rounded import rounded
from plateviz.verdict.cause_case import Case
from solver.data.result import FitResult
from solver.results.diagnosis.exposures import WAVES
from solver.results.diagnosis.scatter import FEWEST
from solver.results.diagnosis.table import BAD_RATE

# Sources with fewer measurements do not say how good a solution is.
_MIN_OBS = 10
# A pattern larger than this share of the positions' uncertainty makes it wrong by a tenth.
_LARGE_SHARE = 0.5
# Uncertainties wrong by more than this share.
_LARGE_ERROR = 0.1
# Outliers of so many of the sources are not few.
_LARGE_PARTS = {"outliers": 0.02, "swapped": 0.02}
# Rms deviation of the reference stars over its expected value, beyond which the frame is wrong.
_LARGE_DEVIATION = 1.2
# Groups of sources of similar magnitudes.
_MAGNITUDE_GROUPS = 8


def harm(case: Case) -> tuple[str, bool]:
    """Return what a cause spoils, in words, and whether that is much."""
    found, subject = case.found, case.found.test.subject
    of_parts = {
        "outliers": len(case.result.sources),
        "swapped": len(case.result.sources),
        "reference": len(case.diagnosis.references.chi2),
    }
    size = found.test.size_um if np.isfinite(found.test.size_um) else _rms(case)
    if np.isfinite(size):
        # On the sky, along one axis.
        error = case.diagnosis.camera.on_sky(size)
        typical = _typical_sigma(case.result)
        spoils = (
            f"It spoils the positions, by up to {rounded(error)} mas rms where their "
            f"uncertainty is {rounded(typical)} mas, and the calibration."
        )
        return spoils, error > _LARGE_SHARE * typical
    if subject in of_parts:
        return _harm_of_parts(case, of_parts[subject])
    if subject == "swing":
        return _harm_of_swings(case)
    if subject in ("others", "other"):
        return _harm_of_others(case)
    if subject == "references" and found.test.statistic < found.test.expected:
        return "It spoils the error that all positions share, which is smaller than stated.", False
    if subject == "references":
        spoils = (
            "It spoils the error that all positions share, which is up to "
            f"{rounded(found.size)} times as large as stated."
        )
        return spoils, _references_off(case.result)
    if subject == "kurtosis":
        spoils = (
            "It spoils no uncertainty as a root mean square, but a position that rests on few "
            f"measurements is {'more' if found.test.statistic > 0.0 else 'less'} often far off "
            "than its uncertainty says."
        )
        return spoils, False
    if subject == "prior":
        return _harm_of_prior(case)
    if subject == "noise":
        error, extent = abs(float(np.sqrt(found.test.statistic)) - 1.0), ""
    else:
        error, extent = _noise_error(case)
    return (
        f"It spoils the uncertainties, by about {100 * error:.0f} %{extent}, and the weights.",
        bool(error > _LARGE_ERROR),
    )


def _harm_of_prior(case: Case) -> tuple[str, bool]:
    """Return the same for a prior that contradicts the measurements."""
    if any(one.subject != "prior" for one in case.diagnosis.found(BAD_RATE)):
        return (
            "It spoils the calibration, and the positions with it: the residuals show what it "
            "keeps the fit from following.",
            True,
        )
    return (
        "It spoils little: the measurements decide the values, and the residuals show nothing.",
        False,
    )


def _harm_of_swings(case: Case) -> tuple[str, bool]:
    """Return the same for exposures whose pointing jittered."""
    error, typical = _shift_by_swings(case), _typical_sigma(case.result)
    spoils = (
        f"It spoils the positions of the sources in these exposures, by {rounded(error)} mas rms "
        f"where a typical uncertainty is {rounded(typical)} mas."
    )
    return spoils, error > _LARGE_SHARE * typical


def _harm_of_parts(case: Case, total: int) -> tuple[str, bool]:
    """Return the same for a cause that concerns some of the sources."""
    found, subject = case.found, case.found.test.subject
    count = len(found.items) or int(found.size)
    is_large = count > _LARGE_PARTS.get(subject, 0.0) * total
    if subject == "reference":
        shared = _shared_error(case.result)
        return (
            f"It spoils all positions alike, by about {rounded(_frame_shift(case))} mas where "
            "the error "
            f"that they share is {rounded(shared)} mas: the frame follows the reference stars.",
            _references_off(case.result),
        )
    return (
        f"It spoils the positions of up to {count:,} sources, by at most "
        f"{rounded(_largest_shift_of_one(case))} mas, where a typical uncertainty is "
        f"{rounded(_typical_sigma(case.result))} mas.",
        is_large,
    )


def _harm_of_others(case: Case) -> tuple[str, bool]:
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
    frame, shared = _pull_on_frame(rows, offset, prior), _shared_error(case.result)
    words = (
        f"these positions by {rounded(shift)} mas rms, where their uncertainty is "
        f"{rounded(typical)} mas, "
        f"and the frame by about {rounded(frame)} mas, where the error that all positions share is "
        f"{rounded(shared)} mas."
    )
    is_large = shift > _LARGE_SHARE * typical or frame > _LARGE_SHARE * shared
    if not items:
        return f"It shifts {words}", is_large
    is_large |= len(items) > _LARGE_PARTS["outliers"] * len(rows)
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


def _shared_error(result: FitResult) -> float:
    """Return the error that all positions share, mas."""
    return float(np.linalg.norm([result.summary[f"mean_error_{axis}"] for axis in ("ra", "dec")]))


def _noise_error(case: Case) -> tuple[float, str]:
    """Return the error of the uncertainties of groups, rms beyond chance, and how far it reaches.

    The error is a share of the stated uncertainties.
    """
    rows, subject = case.diagnosis.rows, case.found.test.subject
    groups = {
        "exposures": rows.exposure,
        "detectors": rows.detector,
        "sources": rows.source,
        "magnitudes": _magnitude_group(case)[rows.source],
    }[subject]
    used = ~rows.is_far & (groups >= 0) & ~np.isin(rows.exposure, case.diagnosis.swinging)
    chi2 = np.bincount(groups[used], rows.chi2[used])
    dof = np.bincount(groups[used], 2.0 * rows.left[used])
    known = dof > FEWEST
    if not known.any():
        return 0.0, ""
    ratio, by_chance = np.sqrt(chi2[known] / dof[known]), 0.5 / dof[known]
    error = float(np.sqrt(max(np.mean((ratio - 1.0) ** 2 - by_chance), 0.0)))
    if subject == "sources":  # of which the most extreme are so by chance
        return error, " rms"
    low, high = (100.0 * (float(one) - 1.0) for one in (ratio.min(), ratio.max()))
    return error, f" rms, from {low:+.0f} to {high:+.0f} % between {subject}"


def _magnitude_group(case: Case) -> np.ndarray:
    """Return for each source the number of its group of similar magnitudes, -1 if unknown."""
    magnitude = pd.Series(case.diagnosis.magnitude)
    groups = pd.qcut(magnitude, _MAGNITUDE_GROUPS, labels=False, duplicates="drop")
    return groups.fillna(-1).to_numpy(dtype=int)


def _largest_shift_of_one(case: Case) -> float:
    """Return how far a measurement that is far off moves its source at most, mas along one axis.

    The residual is what is left of the error; the rest is what the fit has followed.
    """
    rows = case.diagnosis.rows
    residual = np.sqrt(rows.chi2[rows.is_far] / rows.weight[rows.is_far])
    left = np.maximum(rows.left[rows.is_far], 1e-3)
    return case.diagnosis.camera.on_sky(float((residual * (1.0 - left) / left).max(initial=0.0)))


def _shift_by_swings(case: Case) -> float:
    """Return the rms shift of the sources in the exposures that swing, mas along one axis.

    A source is at the mean of its measurements, and exposures swing independently.
    """
    found, rows, which = case.diagnosis.exposures, case.diagnosis.rows, list(case.found.items)
    weight = np.bincount(rows.exposure, rows.weight, len(found.swing))
    excess = np.maximum((found.swing * found.scale)[which] - 4.0 * WAVES, 0.0)
    size = np.zeros(len(weight))
    size[which] = np.sqrt(excess / weight[which])
    moved = np.bincount(rows.source, (rows.weight * size[rows.exposure]) ** 2)
    shift = np.sqrt(moved) / np.bincount(rows.source, rows.weight)
    of_these = shift[moved > 0.0]
    return (
        case.diagnosis.camera.on_sky(float(np.sqrt(np.mean(of_these**2)))) if len(of_these) else 0.0
    )


def _frame_shift(case: Case) -> float:
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


def _references_off(result: FitResult) -> bool:
    """Return whether the reference stars deviate from the catalogue by much more than expected."""
    summary = result.summary
    return any(
        float(summary[f"normalised_deviation_{axis}"])
        > _LARGE_DEVIATION * float(summary[f"expected_normalised_deviation_{axis}"])
        for axis in ("ra", "dec")
    )


def _rms(case: Case) -> float:
    """Return the rms displacement, um, of patterns that each exposure has of its own, or NaN.

    Of a prior it is that of the largest pattern that the residuals have.
    """
    test = case.found.test
    if test.subject == "prior":
        sizes = [one.size_um for one in case.diagnosis.found(BAD_RATE)]
        return max(filter(np.isfinite, sizes), default=float("nan"))
    if test.subject not in ("stretch", "shear", "quadratic"):
        return float("nan")
    excess = max(test.statistic - test.expected, 0.0)
    return float(np.sqrt(excess / case.diagnosis.rows.weight.sum()))


def _typical_sigma(result: FitResult) -> float:
    """Return the median marginal uncertainty of the positions, mas."""
    sources = result.sources
    many = ~sources["is_reference"] & (sources["n_obs"] >= _MIN_OBS)
    rows = sources[many] if many.any() else sources
    return float(np.median(rows[["sigma_ra_marginal", "sigma_dec_marginal"]]))
