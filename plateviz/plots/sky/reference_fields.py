"""Scatter of each reference star between the fields of an orbit, measured and expected."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, By, Figure, Glyphs, framed, message
from plateviz.figures.glyphs import line, points
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.style import SERIES_COLOURS
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.reference_fields import reference_fields, reference_fields_statistics
from solver.data.plural import plural

_TITLE = "Scatter of the reference stars between fields"
_XLABEL, _YLABEL = "expected scatter (mas)", "measured scatter (mas)"
_NAMES = {"ra": "α cos δ", "dec": "δ"}
_MARKERS = {"ra": "circle", "dec": "triangle"}
_HOVER = [
    ("source", "@{id}"),
    ("coordinate", "@{name}"),
    ("fields", "@{n_fields}"),
    ("measurements", "@{n}"),
    ("measured", "@{scatter_mas}{0.000} mas"),
    ("expected", "@{expected_mas}{0.000} mas"),
    ("χ²", "@{chi2}{0.0}, expected @{dof}"),
    ("both coordinates", "@{sigmas}{0.0} σ"),
]
_STRENGTH = {"expected": 0.6, "beyond": 1.0}
_SIZES = {"expected": 5.0, "beyond": 10.0}


def plot_reference_fields(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw the measured against the expected scatter of each reference star between fields.

    Parameters
    ----------
    table : `tables.reference_fields`
    width : of the frame, screen pixels
    """
    if table.empty:
        text = "No reference star in two fields or more"
        return message(_TITLE, text, width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    right = 1.08 * float(table["expected_mas"].max())
    top = 1.08 * max(right, float(table["scatter_mas"].max()))
    return framed(
        [
            line(
                [0.0, right],
                [0.0, right],
                name="identity",
                color="line",
                dash="dashed",
                label="measured = expected",
            ),
            *(_points(rows, str(axis)) for axis, rows in table.groupby("coordinate", sort=False)),
        ],
        title=_TITLE,
        subtitle=_subtitle(table),
        x=Axis(_XLABEL, (0.0, right)),
        y=Axis(_YLABEL, (0.0, top)),
        width=width,
        height=round(0.62 * width),
        legend_columns=3,
    )


def _points(rows: pd.DataFrame, axis: str) -> Glyphs:
    strength = np.where(rows["is_beyond"], "beyond", "expected").astype(object)
    return points(
        rows.assign(strength=strength, name=_NAMES[axis]),
        "expected_mas",
        "scatter_mas",
        name=axis,
        color=SERIES_COLOURS[list(_NAMES).index(axis)],
        marker=_MARKERS[axis],
        size=By("strength", _SIZES),
        line_width=0.0,
        alpha=By("strength", _STRENGTH),
        hover=_HOVER,
        label=_NAMES[axis],
        keep=["id"],
    )


def _subtitle(table: pd.DataFrame) -> str:
    found = reference_fields_statistics(table)
    return (
        f"{found.n:,} reference {plural(found.n, 'star')} in two fields or more; "
        f"χ² {found.chi2:,.0f}, expected {found.dof:,.0f} ± {found.scatter:,.0f}\n"
        f"{found.n_beyond:,} beyond {found.limit:.1f}σ, which the largest exceeds by chance in "
        f"1 %; largest {found.largest:.1f}σ"
    )


def _plot(chosen: Chosen) -> Figure:
    return plot_reference_fields(reference_fields(chosen.result, chosen.instrument))


DIAGNOSTICS = (
    Diagnostic(
        "reference-fields",
        _TITLE,
        "The mean position of each reference star in each field of the orbit: the weighted rms "
        "about the mean of all fields, against what noise makes. Good: χ² within three times its "
        "scatter by chance, and no large point. The points scatter widely about the line, because "
        "a star is in few fields: with two, one in three is above it. A large point is a star "
        "that is elsewhere in one field: another star, a double one, or wrong measurements. Many "
        "points above the line mean that distortion or detectors change between fields.",
        OrbitWorkspace.TRENDS,
        76,
        _plot,
        equation=(
            "scatter² = Σ W (p − p̄)² / Σ W over the fields, with the mean position p of a field "
            "and its weight W = Σ 1/s²; expected: (k − 1) / Σ W with k fields, times the share "
            "that the calibration leaves"
        ),
    ),
)
