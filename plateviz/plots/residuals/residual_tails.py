"""Tails of the residuals: how many are large, and the kurtosis of each exposure, against chance."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import (
    FRAME_WIDTH,
    Axis,
    Figure,
    Glyphs,
    Limits,
    framed,
    message,
    side_by_side,
)
from plateviz.figures.glyphs import band, horizontal, line, points
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.style import SERIES_COLOURS
from plateviz.plots.elements.ticks import log_ticks
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.residual_tails import (
    AXIS,
    DETECTOR,
    EXPOSURE,
    kurtosis_by_group,
    residual_tails,
)
from plateviz.tables.rounded import with_error, with_minus_signs
from plateviz.verdict.tests_in_words import TestInWords
from plateviz.verdict.verdict import orbit_verdict

_TITLE = "Tails of the residuals"
_NUMBERS, _KURTOSIS = "Residuals beyond a threshold", "Excess kurtosis by exposure"
_XLABEL, _YLABEL = "threshold of |z| (σ)", "found / expected (number)"
_EXPOSURES_X, _KURTOSIS_Y = "exposure, in order", "excess kurtosis (normal: 0)"
_MARKERS = {"x": "circle", "y": "triangle"}
# Sideways, so that the marks of both axes are seen where they are equal.
_ASIDE = {"x": -0.04, "y": 0.04}
# Of which the number is said in words: from there on most good orbits have few.
_IN_WORDS = 4.0
_LEAST_RATIO, _LEAST_TOP = 0.2, 30.0
_BAND_SIGMAS, _SHARE_BEYOND = 2.0, 0.0455
_NUMBERS_HOVER = [
    ("residuals in @{axis}", "beyond @{threshold}{0.0} σ"),
    ("found", "@{found}{0,0}"),
    ("expected", "@{expected}{0,0.0000} ± @{scatter}{0,0.0000}"),
    ("normal, of the measured width", "@{of_width}{0,0.0000}"),
]
_KURTOSIS_HOVER = [
    ("exposure", "@{exposure}"),
    ("measurements", "@{n}"),
    ("excess kurtosis", "@{kurtosis}{0.000} ± @{scatter}{0.000}"),
    ("departure", "@{sigmas}{0.0} σ"),
]


def plot_residual_tails(
    table: pd.DataFrame,
    groups: pd.DataFrame,
    *,
    test: TestInWords | None = None,
    width: int = FRAME_WIDTH,
) -> Figure:
    """Draw the residuals beyond each threshold over the number expected, and the kurtosis.

    Parameters
    ----------
    table : `tables.residual_tails`
    groups : `tables.kurtosis_by_group`
    test : of the kurtosis of all residuals, from the verdict
    width : of each panel's frame, screen pixels
    """
    if table.empty or not table["n"].any():
        return message(_TITLE, "No residuals", width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    panels = [_numbers(table, width), _by_exposure(groups, test, width)]
    return side_by_side(panels, columns=2)


def _numbers(table: pd.DataFrame, width: int) -> Figure:
    one = table[table["axis"] == table["axis"].iloc[0]]
    at, expected = one["threshold"], one["expected"]
    limits = _limits(table)
    low, high, of_width = (
        np.clip(one[name] / expected, *limits) for name in ("low", "high", "of_width")
    )
    return framed(
        [
            band(at, low, high, name="band", label="by chance, ± 2σ"),
            horizontal(1.0, name="expected", dash="solid", width=1.0),
            line(
                at,
                of_width,
                name="width",
                color="line",
                dash="dashed",
                label="normal, measured width",
            ),
            *(
                glyphs
                for number, (axis, rows) in enumerate(table.groupby("axis", sort=False))
                for glyphs in _marks(rows, str(axis), SERIES_COLOURS[number], limits[0])
            ),
        ],
        title=_NUMBERS,
        subtitle=_numbers_subtitle(table),
        x=Axis(_XLABEL, (float(at.min()) - 0.15, float(at.max()) + 0.15)),
        y=Axis(_YLABEL, limits, is_log=True, ticks=_ticks(limits)),
        width=width,
        height=round(0.62 * width),
        legend_columns=2,
    )


def _limits(table: pd.DataFrame) -> Limits:
    """Return limits with all numbers that were found, and the width of the distribution."""
    found = table.loc[table["found"] > 0, "ratio"]
    least, most = (found.min(), found.max()) if len(found) else (1.0, 1.0)
    return min(_LEAST_RATIO, 0.5 * float(least)), max(_LEAST_TOP, 2.0 * float(most))


def _ticks(limits: Limits) -> list[tuple[float, str]]:
    return log_ticks(limits, powers_only=limits[1] > 1e3 * limits[0])


def _marks(rows: pd.DataFrame, axis: str, colour: str, bottom: float) -> list[Glyphs]:
    """Return the marks of one axis: those where none was found are open, at the bottom."""
    is_none = rows["found"] == 0
    # Half a mark above the edge of the frame.
    drawn = rows.assign(at=rows["threshold"] + _ASIDE[axis], drawn=rows["ratio"])
    drawn.loc[is_none, "drawn"] = 1.12 * bottom
    looks = {"color": colour, "marker": _MARKERS[axis], "size": 7.0, "hover": _NUMBERS_HOVER}
    return [
        points(drawn[~is_none], "at", "drawn", name=axis, label=f"residual {axis}", **looks),
        points(drawn[is_none], "at", "drawn", name=f"none in {axis}", fill_alpha=0.0, **looks),
    ]


def _numbers_subtitle(table: pd.DataFrame) -> str:
    rows = table[table["threshold"] == _IN_WORDS]
    words = ", ".join(f"{row.axis} {row.found:,}" for row in rows.itertuples())
    expected = with_error(float(rows["expected"].mean()), float(rows["scatter"].mean()))
    return (
        f"beyond {_IN_WORDS:g}σ of {int(rows['n'].iloc[0]):,}: {words}, expected {expected} each\n"
        f"measured width {rows['width'].iloc[0]:.3f}; open marks at the bottom: none found"
    )


def _by_exposure(groups: pd.DataFrame, test: TestInWords | None, width: int) -> Figure:
    rows = groups[groups["kind"] == EXPOSURE]
    if rows.empty:
        text = "Too few measurements of each exposure"
        return message(_KURTOSIS, text, width=width, xlabel=_EXPOSURES_X, ylabel=_KURTOSIS_Y)
    # A step per exposure, because the band differs between exposures.
    edges = np.repeat(rows["index"].to_numpy(float), 2) + np.tile([-0.5, 0.5], len(rows))
    ends = rows[["kurtosis", "low", "high"]].to_numpy()
    reach = 1.15 * float(np.abs(ends).max())
    bottom = max(-reach, 1.6 * float(ends.min()))
    return framed(
        [
            band(
                edges,
                np.repeat(rows["low"], 2),
                np.repeat(rows["high"], 2),
                name="band",
                label="by chance, ± 2σ",
            ),
            horizontal(0.0, name="expected", dash="solid", width=1.0),
            points(
                rows,
                "index",
                "kurtosis",
                name="exposures",
                color="mark",
                size=6.0,
                hover=_KURTOSIS_HOVER,
            ),
        ],
        title=_KURTOSIS,
        subtitle=_kurtosis_subtitle(groups, test),
        x=Axis(_EXPOSURES_X, (float(edges[0]), float(edges[-1]))),
        y=Axis(_KURTOSIS_Y, (bottom, reach)),
        width=width,
        height=round(0.62 * width),
        legend_columns=2,
    )


def _kurtosis_subtitle(groups: pd.DataFrame, test: TestInWords | None) -> str:
    axes, exposures, detectors = (
        groups[groups["kind"] == kind] for kind in (AXIS, EXPOSURE, DETECTOR)
    )
    values = axes[["name", "kurtosis", "scatter"]].itertuples(index=False, name=None)
    parts = [f"{name} {with_error(value, scatter, 1)}" for name, value, scatter in values]
    if test:
        parts.insert(0, f"all {with_error(test.statistic, test.scatter, 1)} ({test.sigma:.1f}σ)")
    count, outside = len(exposures), int((exposures["sigmas"].abs() > _BAND_SIGMAS).sum())
    of_detectors = f", of detectors {_largest(detectors)}" if len(detectors) else ""
    return (
        f"{'; '.join(parts)}\n"
        f"{outside} of {count} beyond ± 2σ, {_SHARE_BEYOND * count:.1f} expected; "
        f"largest {_largest(exposures)}{of_detectors}"
    )


def _largest(groups: pd.DataFrame) -> str:
    largest = groups["sigmas"].iloc[int(groups["sigmas"].abs().argmax())]
    return with_minus_signs(f"{largest:.1f}σ")


def _plot(chosen: Chosen) -> Figure:
    tests = orbit_verdict(chosen.result).tests
    return plot_residual_tails(
        residual_tails(chosen.result),
        kurtosis_by_group(chosen.result),
        test=next((one for one in tests if one.name == "kurtosis"), None),
    )


DIAGNOSTICS = (
    Diagnostic(
        "residual-tails",
        _TITLE,
        "How many standardised residuals are beyond each threshold, over the number that a normal "
        "distribution has, and the excess kurtosis of each exposure. Good: in the bands, and one "
        "exposure in twenty outside. Numbers on the dashed line: all errors are misstated by one "
        "factor. Above it, with a kurtosis of zero: the noise differs between exposures. A "
        "kurtosis above zero in a few exposures: these were disturbed; in all of them: the noise "
        "of every measurement has tails. Only numbers beyond 6σ above the band: single outliers, "
        "which the kurtosis leaves out.",
        OrbitWorkspace.RESIDUALS,
        41,
        _plot,
        is_wide=True,
        needs_verdict=True,
        equation=(
            "expected: n (1 − erf(t / √2)); kurtosis: 3 ⟨u²/2 − 2u + 1⟩, with u = (z(x)² + z(y)²) "
            "/ 2 over its mean in the exposure, scatter 3 / √n; of one axis ⟨z⁴ − 6 z² + 3⟩, "
            "√(24 / n)"
        ),
    ),
)
