"""Table of the paper's numbers beside ours, with the ratio of the two.

Where a statement of the paper is ambiguous, `reading` gives the interpretation compared.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from solver.units import SECONDS_PER_MINUTE, UAS_PER_MAS

# "Observed for more than 80 orbits", section "Time-series astrometric analysis".
OFTEN = 80
# Minimum number of sources; few artificial sources reach the largest number of orbits.
_ENOUGH_SOURCES = 50
_A100_MINUTES = (50.0, 140.0)

COLUMNS = ["quantity", "reading", "unit", "paper_low", "paper_high", "ours", "ratio"]


@dataclass(frozen=True)
class SurveyFigures:
    """Tables of a fitted survey from which `reproduction` is computed.

    Attributes
    ----------
    orbits : `survey_schema.RUN_ORBITS`
    motions : `survey_schema.MOTIONS`
    errors : `survey_schema.ERRORS_BY_COUNT` of the artificial sources
    classes : a row per class as from `plateviz.runs.run.Run.classes`, by `source_class`
    mas_per_pixel : scale of the detectors
    """

    orbits: pd.DataFrame
    motions: pd.DataFrame
    errors: pd.DataFrame
    classes: pd.DataFrame
    mas_per_pixel: float


def reproduction(figures: SurveyFigures) -> pd.DataFrame:
    """Return the paper's numbers beside ours.

    Returns
    -------
    `quantity`, `reading`, `unit`, `paper_low`, `paper_high` (equal where the paper gives one
    number), `ours`, and `ratio` of ours to the paper's number; for a range, to its nearer
    end, or 1 inside it. NaN where the survey does not provide the number
    """
    rows = [
        *_of_orbits(figures),
        *_of_classes(figures.classes),
        *_of_motions(figures.motions),
        *_of_errors(figures.errors),
        _time(figures.orbits),
    ]
    return pd.DataFrame([_row(*row) for row in rows], columns=COLUMNS)


_Row = tuple[str, str, str, float, float, float]


def _row(
    quantity: str, reading: str, unit: str, low: float, high: float, ours: float
) -> tuple[str, str, str, float, float, float, float]:
    nearest = float(np.clip(ours, low, high))
    return quantity, reading, unit, low, high, ours, ours / nearest


def _of_orbits(figures: SurveyFigures) -> list[_Row]:
    orbits = figures.orbits
    squares = orbits[["residual_rms_x", "residual_rms_y"]].to_numpy() ** 2
    scatter = float(np.sqrt(np.nanmean(squares)))
    deviation, expected = (
        float(np.nanmean(orbits[[f"{p}normalised_deviation_{a}" for a in ("ra", "dec")]]))
        for p in ("", "expected_")
    )
    return [
        ("residual scatter", "one coordinate, all exposures", "pix", 0.01, 0.01, scatter),
        (
            "residual scatter",
            "the same on the sky",
            "mas",
            4.0,
            4.0,
            scatter * figures.mas_per_pixel,
        ),
        (
            "normalised deviation",
            f"of point estimates, for which {expected:.2f} is expected, not 1",
            "",
            1.0,
            1.0,
            deviation,
        ),
    ]


def _of_classes(classes: pd.DataFrame) -> list[_Row]:
    reference, other = (
        classes.loc[name] if name in classes.index else pd.Series(np.nan, classes.columns)
        for name in ("reference", "non-reference")
    )
    return [
        (
            "on-sky deviation, reference",
            "rms in one coordinate over the rms prior sigma",
            "",
            1.0,
            1.0,
            float(reference["rms_deviation"] / reference["rms_prior_sigma"]),
        ),
        (
            "on-sky deviation, non-reference",
            "rms in one coordinate, any number of measurements",
            "mas",
            1.0,
            1.0,
            float(other["rms_deviation"]),
        ),
        (
            "uncertainty times sqrt(N)",
            "conditional sigma, non-reference sources",
            "mas",
            4.0,
            4.0,
            float(other["sigma_single"]),
        ),
        (
            "reported sigma, reference",
            f"marginal, median of those in over {OFTEN} orbits",
            "uas",
            100.0,
            100.0,
            UAS_PER_MAS * float(reference["sigma_often"]),
        ),
    ]


def _of_motions(motions: pd.DataFrame) -> list[_Row]:
    often = motions[motions["n_orbits"] > OFTEN]
    reference = often[often["is_reference"]]
    artificial = often[often["is_artificial"] & ~often["is_reference"]]
    other = often[~often["is_artificial"] & ~often["is_reference"]]
    which = f"median of those in over {OFTEN} orbits"
    scatter = UAS_PER_MAS * _median(reference[["scatter_ra", "scatter_dec"]])
    fewest = motions.loc[motions["is_artificial"], "n_orbits"].min()
    return [
        _separation("reference", (100.0, 500.0), "two-dimensional", reference["rms_truth_2d"]),
        ("scatter, reference", f"one coordinate about the motion, {which}", "uas", 30, 30, scatter),
        # The paper states separations, but explains them in one coordinate: 4 mas / 6.
        _separation("non-reference", (600.0, 800.0), "two-dimensional", other["rms_truth_2d"]),
        _separation("non-reference", (600.0, 800.0), "one coordinate", _one_coordinate(other)),
        _separation("artificial", (750.0, 750.0), "two-dimensional", artificial["rms_truth_2d"]),
        _separation("artificial", (750.0, 750.0), "one coordinate", _one_coordinate(artificial)),
        (
            "orbits per source near the target",
            "smallest of the artificial sources; the paper has over 30",
            "",
            30.0,
            100.0,
            float(fewest),
        ),
    ]


def _separation(
    name: str, paper: tuple[float, float], reading: str, separations: pd.Series
) -> _Row:
    which = f"{reading}, median of those in over {OFTEN} orbits"
    return f"rms separation, {name}", which, "uas", *paper, UAS_PER_MAS * _median(separations)


def _one_coordinate(motions: pd.DataFrame) -> pd.Series:
    return motions["rms_truth_2d"] / np.sqrt(2.0)


def _of_errors(errors: pd.DataFrame) -> list[_Row]:
    """Return the error at the largest orbit count with enough sources, and the paper's values."""
    enough = errors[errors["n_sources"] >= _ENOUGH_SOURCES]
    if enough.empty:
        return []
    last = enough.iloc[-1]
    count = int(last["n_orbits"])
    law = UAS_PER_MAS * 4.0 / np.sqrt(36.0 * count)
    ours = UAS_PER_MAS * float(last["error_mas"])
    expected = UAS_PER_MAS * float(last["expected_mas"])
    return [
        (
            "error of artificial sources",
            f"one coordinate, mean of {count} orbits; {expected:.0f} predicted by noise and floor",
            "uas",
            70.0,
            70.0,
            ours,
        ),
        ("error of artificial sources", f"the law at {count} orbits", "uas", law, law, ours),
    ]


def _time(orbits: pd.DataFrame) -> _Row:
    minutes = float(orbits["seconds"].median()) / SECONDS_PER_MINUTE
    reading = "one core here, one A100 GPU there"
    return "time per orbit", reading, "min", *_A100_MINUTES, minutes


def _median(values: pd.DataFrame | pd.Series) -> float:
    return float(np.nanmedian(values.to_numpy(float))) if len(values) else float("nan")
