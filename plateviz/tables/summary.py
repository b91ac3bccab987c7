"""The summary strip: the numbers by which a fit is judged."""

import math
from collections.abc import Mapping
from typing import Literal, NamedTuple

from scipy.special import chdtrc

from plateviz.tables.rounded import with_minus_signs
from solver.data.plural import plural
from solver.data.result import FitResult

State = Literal["good", "warn", "bad", "neutral"]
_GOOD_SIGMAS = 3.0
_BAD_SHARE = 0.2
# Probability that a normal number is further than three sigmas from its mean.
_UNLIKELY = 2.7e-3
LEAST_OBS = 10
"""Measurements of a source that counts in the pulls against the truth, as in the solver."""


class SummaryItem(NamedTuple):
    """One number.

    Attributes
    ----------
    label : its name
    value : as text
    hint : its meaning
    state : "neutral" if it is not judged
    is_count : whether it says how large the fit is, not how good
    """

    label: str
    value: str
    hint: str
    state: State
    is_count: bool = False


def summary_strip(result: FitResult) -> list[SummaryItem]:
    """Return the numbers by which a fit is judged, the judged ones first.

    A number is "good" within three times its expected scatter of its expected value,
    "warn" beyond that, and "bad" if it also differs by more than 20 %: with many measurements
    the smallest flaw is significant, but only a large one invalidates the uncertainties.

    Parameters
    ----------
    result : the fit

    Returns
    -------
    Items with label, value, hint and state; those on the truth only if there is one
    """
    return [
        _converged(result),
        _chi2(result),
        _normalised_deviation(result, "ra", "α"),
        _normalised_deviation(result, "dec", "δ"),
        *_from_truth(result),
        *_counts(result),
        _iterations(result),
        _seconds(result),
    ]


def _number(result: FitResult, key: str) -> float:
    return float(result.summary[key])  # type: ignore[arg-type]


def state_of(value: float, expected: float, scatter: float) -> State:
    """Return the state of a number by the rule of `summary_strip`; "neutral" if not finite."""
    if not (math.isfinite(value) and math.isfinite(expected) and scatter >= 0):
        return "neutral"
    departure = abs(value - expected)
    if departure <= _GOOD_SIGMAS * scatter:
        return "good"
    return "bad" if departure > _BAD_SHARE * abs(expected) else "warn"


def deviation_state(value: float, expected: float, dof: float) -> State:
    """Return the state of a normalised deviation, by the rule of `summary_strip`.

    Its square is distributed as chi2, which for few degrees of freedom is far from symmetric.

    Parameters
    ----------
    dof : degrees of freedom of the deviation
    """
    if not (math.isfinite(value) and expected > 0.0 and dof > 0.0):
        return "neutral"
    above = float(chdtrc(dof, dof * (value / expected) ** 2))
    if 2.0 * min(above, 1.0 - above) >= _UNLIKELY:
        return "good"
    return "bad" if abs(value - expected) > _BAD_SHARE * expected else "warn"


def rule(expected: float, scatter: float, basis: str) -> str:
    """Return the rule of `state_of` in words.

    Parameters
    ----------
    basis : what the scatter follows from, in words
    """
    return (
        f"Expected {expected:.3f} ± {scatter:.3f} ({basis}). "
        f"Good within {_GOOD_SIGMAS:.0f} times that scatter; bad if beyond it and more than "
        f"{100 * _BAD_SHARE:.0f} % off."
    )


def _converged(result: FitResult) -> SummaryItem:
    converged = bool(result.summary["converged"])
    return SummaryItem(
        "Converged",
        "yes" if converged else "no",
        str(result.summary["reason"]),
        "good" if converged else "bad",
    )


def _chi2(result: FitResult) -> SummaryItem:
    dof = _number(result, "dof")
    value = _number(result, "chi2_per_dof")
    scatter = math.sqrt(2.0 / dof) if dof > 0 else float("nan")
    parameters = _number(result, "effective_parameters")
    basis = f"√(2/dof); dof = {dof:,.0f} after {parameters:,.0f} effective parameters"
    return SummaryItem(
        "χ² per degree of freedom",
        f"{value:.3f}",
        rule(1.0, scatter, basis),
        state_of(value, 1.0, scatter),
    )


def _normalised_deviation(result: FitResult, coordinate: str, symbol: str) -> SummaryItem:
    value = _number(result, f"normalised_deviation_{coordinate}")
    expected = _number(result, f"expected_normalised_deviation_{coordinate}")
    count = int(_number(result, "n_reference"))
    # Older results lack it.
    dof = float(result.summary.get(f"normalised_deviation_dof_{coordinate}", count))
    scatter = expected / math.sqrt(2.0 * dof) if dof > 0.0 else float("nan")
    basis = (
        f"{count} reference {plural(count, 'source')} with common errors, "
        f"which scatter like {dof:.1f} independent ones"
    )
    return SummaryItem(
        f"Reference sources, {symbol}",
        f"{value:.3f} (expected {expected:.3f})",
        "Rms of estimate minus catalogue over the catalogue's sigma. "
        + rule(expected, scatter, basis),
        deviation_state(value, expected, dof),
    )


def _from_truth(result: FitResult) -> list[SummaryItem]:
    truth: Mapping[str, Mapping[str, float]] = result.summary.get("truth", {})
    return [
        SummaryItem(
            f"Pulls against truth, {name}, N ≥ {LEAST_OBS}",
            f"{_pull(figures, 'ra'):.2f}, {_pull(figures, 'dec'):.2f} "
            f"({_rms(figures):.2f} mas rms)",
            f"Rms of deviation over marginal sigma in α, δ of {figures['n']} "
            f"{plural(figures['n'], 'source')} with {LEAST_OBS} or more measurements and a "
            "simulated truth; expected 1. The figure of the deviations has all sources. It is not "
            "judged, because the sources of one orbit share the calibration's error; about their "
            "mean it is "
            f"{figures['pull_sd_ra']:.2f}, {figures['pull_sd_dec']:.2f}. Mean deviation "
            f"{_pair(figures, 'mean')} mas, of which {_pair(figures, 'induced')} mas come from "
            "the reference sources' errors.",
            "neutral",
        )
        for name, figures in truth.items()
    ]


def _pull(figures: Mapping[str, float], axis: str) -> float:
    # Older results lack the first.
    return figures.get(f"pull_rms_{axis}", figures[f"pull_sd_{axis}"])


def _pair(figures: Mapping[str, float], name: str) -> str:
    pair = (figures[f"{name}_{axis}"] for axis in ("ra", "dec"))
    return ", ".join(with_minus_signs(f"{value:.3f}") for value in pair)


def _rms(figures: Mapping[str, float]) -> float:
    return math.hypot(figures["rms_ra"], figures["rms_dec"]) / math.sqrt(2.0)


def _counts(result: FitResult) -> list[SummaryItem]:
    names = {
        "n_measurements": ("Measurements", "positions of a source on an exposure"),
        "n_sources": ("Sources", "sources solved for"),
        "n_reference": ("Reference sources", "sources with a precise catalogue position"),
        "n_exposures": ("Exposures", "exposures of the orbit, each with all detectors"),
    }
    items = [
        SummaryItem(label, f"{_number(result, key):,.0f}", hint, "neutral", is_count=True)
        for key, (label, hint) in names.items()
    ]
    if _number(result, "n_reference") == 0:
        hint = "Without reference sources nothing ties the solution to the sky."
        items[2] = SummaryItem("Reference sources", "0", hint, "bad")
    return items


def _iterations(result: FitResult) -> SummaryItem:
    engine, order = result.summary["engine"], result.summary["order"]
    return SummaryItem(
        "Iterations",
        f"{_number(result, 'iterations'):.0f}",
        f"Engine {engine}, distortion order {order}, at most {result.settings.max_iterations}",
        "neutral",
        is_count=True,
    )


def _seconds(result: FitResult) -> SummaryItem:
    seconds: Mapping[str, float] = result.summary["seconds"]  # type: ignore[assignment]
    parts = {name: float(value) for name, value in seconds.items()}
    hint = ", ".join(f"{name} {value:.2f} s" for name, value in parts.items())
    return SummaryItem("Time", f"{sum(parts.values()):.1f} s", hint, "neutral", is_count=True)
