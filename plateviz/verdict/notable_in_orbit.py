"""What stands out in the solution of an orbit, in sentences."""

import numpy as np
from scipy.special import chdtrc

from plateviz.tables.labels import id_strings
from plateviz.tables.outliers import outlier_sentences
from plateviz.tables.pulls import exposure_chi2
from solver.data.result import FitResult

# Probability that a good orbit has any exposure, or any source, reported as far off.
_BY_CHANCE = 0.01
_MOST_NAMED = 3


def notable_sentences(result: FitResult) -> list[str]:
    """Return sentences on exposures, sources and outliers far off, and on a truth not known."""
    return [
        *_far_exposures(result),
        *_far_sources(result),
        *outlier_sentences(result),
        *_unknown_truth(result),
    ]


def _far_exposures(result: FitResult) -> list[str]:
    dof, chi2 = (result.exposures[name].to_numpy(dtype=float) for name in ("dof", "chi2"))
    above = chdtrc(dof, chi2)
    is_far = 2.0 * np.minimum(above, 1.0 - above) < _BY_CHANCE / max(len(dof), 1)
    if not is_far.any():
        return []
    far = exposure_chi2(result)[is_far].sort_values("z", key=np.abs, ascending=False)
    named = "; ".join(
        f"{row.exposure} (χ²/dof {row.chi2_per_dof:.3f} ± {row.expected_sd:.3f})"
        for row in far.head(_MOST_NAMED).itertuples()
    )
    return [f"Exposures with a χ² too high or too low to be chance: {len(far):,}. {named}."]


def _far_sources(result: FitResult) -> list[str]:
    dof, chi2 = (result.sources[name].to_numpy(dtype=float) for name in ("dof", "chi2"))
    # Of the others, so many good ones are larger that none is far.
    above = np.ones(len(dof))
    might = (dof > 0.0) & (chi2 > dof + 2.0 * np.sqrt(2.0 * np.maximum(dof, 0.0)))
    above[might] = chdtrc(dof[might], chi2[might])
    is_far = above < _BY_CHANCE / max(np.count_nonzero(dof > 0.0), 1)
    if not is_far.any():
        return []
    far = result.sources[is_far].assign(above=above[is_far]).sort_values("above")
    worst_ids = id_strings(far["source_id"].head(_MOST_NAMED))
    named = "; ".join(
        f"{name} (χ² {row.chi2:.0f}, expected {row.dof:.0f})"
        for name, row in zip(worst_ids, far.head(_MOST_NAMED).itertuples(), strict=True)
    )
    return [f"Sources that scatter by more than their errors: {len(far):,}. {named}."]


def _unknown_truth(result: FitResult) -> list[str]:
    if result.true_places is not None:
        return []
    return ["There is no truth to compare with; the figures and numbers that need one are absent."]
