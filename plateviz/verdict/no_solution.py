"""The verdict on a fit that ended without uncertainties: no tests, but a likely cause."""

from typing import Any

from plateviz.verdict.causes import Cause
from plateviz.verdict.prior_words import usual_priors, widened_priors
from plateviz.verdict.verdict import Verdict, as_plain
from solver.data.settings import FitSettings
from solver.errors import NoSolutionError
from solver.results.diagnosis.rate import log_chance, sigmas

_COORDINATES = 2
# Causes that priors of usual widths may be a remedy of.
_OF_PRIORS = ("open-direction", "outweighed-priors")


def no_solution_summary(error: NoSolutionError, settings: FitSettings) -> dict[str, Any]:
    """Return the summary of a fit without a solution, as far as it is known, with its verdict."""
    return {**error.summary, "verdict": as_plain(no_solution_verdict(error, settings))}


def no_solution_verdict(error: NoSolutionError, settings: FitSettings) -> Verdict:
    """Return the verdict on a fit without a solution.

    Parameters
    ----------
    settings : of the fit
    """
    cause = _cause(error, settings)
    converged = f"The fit has not converged: {error.summary['reason']}."
    options = f" ({' '.join(cause.options)})" if cause.options else ""
    said = f"{cause.words} {cause.spoils} What to do: {cause.action}{options}."
    headline = f"This orbit has no solution: {cause.title}."
    faults = [converged, f"{cause.heading()}."]
    return Verdict("bad", headline, [converged, said], [], faults, [cause])


def _cause(error: NoSolutionError, settings: FitSettings) -> Cause:
    likely = error.cause
    words, action, options = f"{likely.words}.", likely.action, ()
    widened = widened_priors(settings) if likely.name in _OF_PRIORS else []
    if widened:
        words += f" Priors that are wider than usual: {', '.join(widened)}."
        action, options = "give priors their usual widths", usual_priors(widened)
    spoils = "It spoils everything: there are no positions and no uncertainties."
    # All that is known of the residuals is how large they are at the last point.
    significance = 0.0
    if likely.is_misfit:
        dof = float(_COORDINATES * error.summary["n_measurements"])
        significance = sigmas(log_chance(error.chi2, dof))
    return Cause(likely.name, likely.title, words, significance, spoils, action, options, True)
