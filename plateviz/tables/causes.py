"""The causes of a solution's flaws in words: what, how certain, what it spoils, what to do."""

from typing import NamedTuple

import numpy as np

from plateviz.tables.cause_case import Case
from plateviz.tables.cause_words import said_of
from plateviz.tables.remedy import remedied
from solver.data.result import FitResult
from solver.results.diagnosis.causes import Causes, wrong_identifications
from solver.results.diagnosis.table import Diagnosis

# Sources with fewer measurements do not say how good a solution is.
_MIN_OBS = 10
# A pattern larger than this share of the positions' uncertainty makes it wrong by a tenth.
_LARGE_SHARE = 0.5
# Beyond this, chi2 per degree of freedom is not noise of any kind.
_WILD_CHI2 = 30.0
# Uncertainties wrong by more than this share of chi2.
_LARGE_CHI2 = 0.2
# Outliers of so many of the sources, and so many of the exposures, are not few.
_LARGE_PARTS = {"outliers": 0.02, "swapped": 0.02, "swing": 0.1}
# Rms deviation of the reference stars over its expected value, beyond which the frame is wrong.
_LARGE_DEVIATION = 1.2


class Cause(NamedTuple):
    """A likely cause of a flaw.

    Attributes
    ----------
    name : short and unique, for programs
    title : the cause as a clause, without a full stop
    words : the evidence, in sentences
    significance : in sigmas
    spoils : which numbers it spoils, and by how much
    action : what to do
    options : options of `plateviz fit` that do it; empty if there are none
    is_large : whether the solution should not be trusted because of it
    """

    name: str
    title: str
    words: str
    significance: float
    spoils: str
    action: str
    options: tuple[str, ...]
    is_large: bool

    def sentence(self) -> str:
        """Return all of it as text."""
        title = self.title[0].upper() + self.title[1:]
        options = f" ({' '.join(self.options)})" if self.options else ""
        return (
            f"{title}, {self.significance:.0f} sigma. {self.words} {self.spoils} "
            f"What to do: {self.action}{options}."
        )


def causes_in_words(result: FitResult, diagnosis: Diagnosis, causes: Causes) -> list[Cause]:
    """Return the causes of a solution's flaws in words, the most likely first."""
    if not result.summary["converged"]:
        return [_stuck(result, diagnosis, causes)]
    return [_in_words(Case(one, causes, diagnosis, result)) for one in causes.found]


def _stuck(result: FitResult, diagnosis: Diagnosis, causes: Causes) -> Cause:
    """Return what keeps a fit from converging: patterns about a wrong point say nothing."""
    spoils = "It spoils everything: these numbers are those of the last iteration."
    swapped = wrong_identifications(diagnosis)
    if swapped and not result.settings.robust:
        cause = _in_words(Case(swapped[0], causes, diagnosis, result))
        return cause._replace(spoils=spoils, is_large=True)
    far, total = int(diagnosis.rows.is_far.sum()), diagnosis.rows.n
    noise = diagnosis.tests[0]
    is_wild = noise.statistic > _WILD_CHI2 and not result.settings.robust
    words = (
        f"{far:,} of {total:,} residuals are more than six times as large as is usual in their "
        f"exposures, and χ² per degree of freedom is {noise.statistic:.3g}."
    )
    if is_wild:
        title = "measurements that are far off keep the fit from converging"
        words += (
            " Stars with a wrong identification do this, few as they may be: they bend the fit "
            "towards them, and many good ones away."
        )
        action = "let the fit find, list and leave out the measurements that are far off"
        options = ("--robust",)
    else:
        title = "the fit came to no solution"
        action = "check the start values, and allow more iterations"
        options = ()
    name = "wild-measurements" if is_wild else "not-converged"
    return Cause(name, title, words, float(noise.sigma), spoils, action, options, True)


def _in_words(case: Case) -> Cause:
    said = said_of(case)
    spoils, is_large = _harm(case)
    words = said.words
    if np.isfinite(case.found.test.size_um) and abs(case.causes.left.value - 1.0) < 0.02:
        words += (
            f" It is not noise: with the patterns named here in the model, χ² per degree of "
            f"freedom would be {case.causes.left.value:.3f}."
        )
    action, options = said.action, said.options
    if options and remedied(case.result.settings, options) is None:
        action = f"the fit has {' '.join(options)} already; look at what remains in the residuals"
        options = ()
    sigma = float(case.found.test.sigma)
    return Cause(said.name, said.title, words, sigma, spoils, action, options, bool(is_large))


def _harm(case: Case) -> tuple[str, bool]:
    """Return what a cause spoils, in words, and whether that is much."""
    found, subject = case.found, case.found.test.subject
    of_parts = {
        "outliers": len(case.result.sources),
        "swapped": len(case.result.sources),
        "swing": len(case.result.exposures),
        "reference": len(case.diagnosis.references.chi2),
    }
    size = found.test.size_um if np.isfinite(found.test.size_um) else _rms(case)
    if np.isfinite(size):
        # On the sky, along one axis.
        error = size / case.diagnosis.camera.um_per_mas / np.sqrt(2.0)
        typical = _typical_sigma(case.result)
        spoils = (
            f"It spoils the positions, by up to {error:.2g} mas rms where their uncertainty is "
            f"{typical:.2g} mas, and the calibration."
        )
        return spoils, error > _LARGE_SHARE * typical
    if subject in of_parts:
        count = len(found.items) or int(found.size)
        spoils = f"It spoils the positions of sources among {of_parts[subject]:,} that it concerns."
        if subject == "reference":
            spoils = "It spoils all positions alike: the frame follows the reference stars."
            return spoils, _references_off(case.result)
        if subject == "swing":
            spoils = "It spoils the positions of the sources in these exposures."
        if subject in ("outliers", "swapped"):
            spoils = f"It spoils the positions of up to {count:,} sources."
        return spoils, count > _LARGE_PARTS[subject] * of_parts[subject]
    if subject == "references":
        spoils = "It spoils the error that all positions share, which is larger than stated."
        return spoils, _references_off(case.result)
    chi2 = abs(case.diagnosis.scale - 1.0) if subject != "noise" else abs(found.test.statistic - 1)
    return (
        f"It spoils the uncertainties, by about {50 * chi2:.0f} %, and the weights.",
        chi2 > _LARGE_CHI2,
    )


def _references_off(result: FitResult) -> bool:
    """Return whether the reference stars deviate from the catalogue by much more than expected."""
    summary = result.summary
    return any(
        float(summary[f"normalised_deviation_{axis}"])
        > _LARGE_DEVIATION * float(summary[f"expected_normalised_deviation_{axis}"])
        for axis in ("ra", "dec")
    )


def _rms(case: Case) -> float:
    """Return the rms displacement of patterns that each exposure has of its own, um, or NaN."""
    test = case.found.test
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
