"""What a cause spoils, by how much, and whether that is so much that nobody should trust it."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from plateviz.tables.rounded import rounded
from plateviz.verdict.cause_case import Case
from plateviz.verdict.star_cause_harm import (
    LARGE_SHARE,
    are_references_off,
    frame_shift,
    harm_of_epoch,
    harm_of_others,
    harm_of_references,
    shared_error,
    typical_sigma,
)
from solver.results.diagnosis.exposures import WAVES
from solver.results.diagnosis.scatter import FEWEST
from solver.results.diagnosis.table import BAD_RATE

# Uncertainties wrong by more than this share.
_LARGE_ERROR = 0.1
# Outliers of so many of the sources are not few.
_LARGE_PARTS = {"outliers": 0.02, "swapped": 0.02}
# The positions follow a pattern with all else that is fitted: in 105 sparse orbits with eight kinds
# of defects, they were off by 0.3 to 1.7 times its size (tests/campaigns/harms.py).
_AT_MOST = 2.0
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
        typical = typical_sigma(case.result)
        spoils = (
            f"It spoils the positions, by about {rounded(error)} and at most "
            f"{rounded(_AT_MOST * error)} mas rms where their uncertainty is {rounded(typical)} "
            "mas, and the calibration."
        )
        return spoils, error > LARGE_SHARE * typical
    if subject in of_parts:
        return _harm_of_parts(case, of_parts[subject])
    return _HARM.get(subject, _harm_of_noise)(case)


def _harm_of_tails(case: Case) -> tuple[str, bool]:
    """Return the same for noise that is not normal."""
    spoils = (
        "It spoils no uncertainty as a root mean square, but a position that rests on few "
        f"measurements is {'more' if case.found.test.statistic > 0.0 else 'less'} often far off "
        "than its uncertainty says."
    )
    return spoils, False


def _harm_of_noise(case: Case) -> tuple[str, bool]:
    """Return the same for noise that is not as stated, everywhere or in groups."""
    if case.found.test.subject == "noise":
        error, extent = abs(float(np.sqrt(case.found.test.statistic)) - 1.0), ""
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
    error, typical = _shift_by_swings(case), typical_sigma(case.result)
    spoils = (
        f"It spoils the positions of the sources in these exposures, by {rounded(error)} mas rms "
        f"where a typical uncertainty is {rounded(typical)} mas."
    )
    return spoils, error > LARGE_SHARE * typical


def _harm_of_parts(case: Case, total: int) -> tuple[str, bool]:
    """Return the same for a cause that concerns some of the sources."""
    found, subject = case.found, case.found.test.subject
    count = len(found.items) or int(found.size)
    is_large = count > _LARGE_PARTS.get(subject, 0.0) * total
    if subject == "reference":
        shared = shared_error(case.result)
        return (
            f"It spoils all positions alike, by about {rounded(frame_shift(case))} mas where "
            "the error "
            f"that they share is {rounded(shared)} mas: the frame follows the reference stars.",
            are_references_off(case.result),
        )
    return (
        f"It spoils the positions of up to {count:,} sources, by at most "
        f"{rounded(_largest_shift_of_one(case))} mas, where a typical uncertainty is "
        f"{rounded(typical_sigma(case.result))} mas.",
        is_large,
    )


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
    """Return how far the measurements that are far off move their source at most, mas on one axis.

    The residual is what is left of the error; the rest is what the fit has followed.
    """
    rows = case.diagnosis.rows
    residual = np.sqrt(rows.chi2[rows.is_far] / rows.weight[rows.is_far])
    left = np.maximum(rows.left[rows.is_far], 1e-3)
    shift = np.bincount(rows.source[rows.is_far], residual * (1.0 - left) / left)
    return case.diagnosis.camera.on_sky(float(shift.max(initial=0.0)))


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


_HARM: dict[str, Callable[[Case], tuple[str, bool]]] = {
    "swing": _harm_of_swings,
    "others": harm_of_others,
    "other": harm_of_others,
    "epoch": harm_of_epoch,
    "references": harm_of_references,
    "kurtosis": _harm_of_tails,
    "prior": _harm_of_prior,
}
