"""What no test of one orbit can see, and how large it could be."""

from typing import NamedTuple

import numpy as np

from plateviz.tables.rounded import rounded
from solver.data.result import FitResult
from solver.results.diagnosis.epoch import EpochOffset
from solver.units import RAD_PER_MAS

# Sigmas beyond which a deviation of the reference stars is a discovery among all tests.
_NOTICED = 3.0
# Share of reference stars that are left out from which the others are in doubt, too.
_MANY = 0.1
# Measurements that represent the places of all, within a per cent.
_MOST_PLACES = 50_000


def unseen_sentences(result: FitResult, epoch: EpochOffset, are_noticed: bool = False) -> list[str]:
    """Return sentences on the errors of the reference catalogue that a solution cannot show.

    Parameters
    ----------
    epoch : how much later the stars are measured than the times of the exposures say
    are_noticed : whether the reference stars are known to be further off than stated
    """
    sentences = [
        "No test of one orbit shows smooth errors of the reference catalogue. Those that shift, "
        "turn or stretch the field are taken for pointing, and move all positions by as much as "
        "they are large."
    ]
    quadratic = quadratic_mas(result)
    if np.isfinite(quadratic):
        sentences.append(
            "Those that are quadratic in the field are taken for distortion: they could be as "
            f"large as all of the fitted quadratic distortion, {rounded(quadratic)} mas rms. Only "
            "orbits at other position angles tell them apart."
        )
    if epoch.sigma > 0.0 and not abs(epoch.days) > _NOTICED * epoch.sigma:
        sentences.append(
            "A time that is wrong in all exposures alike, by less than "
            f"{rounded(_NOTICED * epoch.sigma)} days, is not noticed: it moves each star against "
            "the reference stars by its own motion in that time."
        )
    elif not epoch.sigma > 0.0:
        sentences.append(
            "A time that is wrong in all exposures alike is not tested: that takes the proper "
            "motions of at least ten reference stars, and measurements that determine where they "
            "are."
        )
    factor = unnoticed_factor(result)
    if np.isfinite(factor) and not are_noticed:
        taken = "the fit takes them" if result.settings.reference_scale else "stated"
        sentences.append(
            f"The errors of all reference stars could be {factor:.1f} times as large as {taken} "
            "before they are noticed: the catalogue decides their positions, not the measurements."
        )
    return sentences


class ReferencesLeftOut(NamedTuple):
    """Many reference stars are left out of a solution.

    Attributes
    ----------
    title : of few words
    sentences : what it means for the others
    """

    title: str
    sentences: str


def references_left_out(result: FitResult) -> ReferencesLeftOut | None:
    """Return that many reference stars are left out; None if few are."""
    summary = result.summary
    # Results of older versions lack it.
    left_out = int(summary.get("n_reference_excluded", 0))
    total = left_out + int(summary["n_reference"])
    if left_out < _MANY * max(total, 1):
        return None
    return ReferencesLeftOut(
        f"{left_out} of its {total} reference stars are left out",
        f"Where {left_out} of {total} reference stars are left out because they are wrong, others "
        "are likely to be off by less than a test can see: all positions may be wrong by more "
        "than the error that they share. Use another catalogue, or state larger errors "
        "(`--prior sources=2`).",
    )


def quadratic_mas(result: FitResult) -> float:
    """Return the rms displacement by the fitted quadratic terms, mas; NaN if there are none.

    A common shift is left out, which the pointing takes up.
    """
    scale = float(result.summary.get("distortion_scale_um", np.nan))
    if "distortion_x" not in result.group_rows or not scale > 0.0:
        return float("nan")
    coefficients = np.stack(
        [result.values_of(f"distortion_{axis}", "offset")[:3] for axis in "xy"], axis=1
    )
    # Every so many measurements: the places on the focal plane are known well enough from these.
    stride = -(-len(result.residuals) // _MOST_PLACES)
    x, y = (
        result.residuals[f"focal_{axis}"].to_numpy(dtype=float)[:: max(stride, 1)] / scale
        for axis in "xy"
    )
    covariance = np.cov(np.stack([1.5 * x * x, x * y, 1.5 * y * y]), bias=True)
    variance = float(np.sum(coefficients * (covariance @ coefficients)))
    focal_length = float(result.values_of("focal_length").mean())
    return float(np.sqrt(variance)) / (focal_length * RAD_PER_MAS)


def unnoticed_factor(result: FitResult) -> float:
    """Return the least factor on the errors of the reference stars that a solution shows.

    With the stated covariance P and that of the measurements M, the deviation of an estimate from
    the catalogue has the variance (f^2 P + M) / (P + M) times the expected one, whose square is the
    share P / (P + M). NaN if there are no reference stars that the measurements determine.
    """
    factors = []
    for axis in ("ra", "dec"):
        expected = float(result.summary[f"expected_normalised_deviation_{axis}"])
        name = f"normalised_deviation_dof_{axis}"
        freedom = float(result.summary.get(name, result.summary["n_reference"]))
        if expected > 0.0 and freedom > 0.0:
            noticed = (1.0 + _NOTICED / np.sqrt(2.0 * freedom)) ** 2 - 1.0
            factors.append(np.sqrt(1.0 + noticed / expected**2))
    return float(np.mean(factors)) if factors else float("nan")
