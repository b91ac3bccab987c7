"""Eigenmodes of the calibration: their spectrum, and what constrains the weak directions."""

from collections.abc import Iterator, Mapping
from functools import partial
from types import MappingProxyType

import numpy as np
import pandas as pd

from plateviz.figures.figure import Axis, Figure, Glyphs, framed, message, side_by_side
from plateviz.figures.glyphs import horizontal, points, rectangles, texts
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.style import CLASS_COLOURS, PANEL_WIDTH, SERIES_COLOURS
from plateviz.plots.elements.units import power_text
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.eigenmodes import (
    CALIBRATION,
    DATA,
    DECIDERS,
    REFERENCES,
    SOURCES,
    eigenmode_deciders,
    eigenmode_spectrum,
)
from plateviz.tables.sources import REFERENCE

_PAGE_WIDTH = 860
_NONE = "No eigenmodes in this result"
_NO_WEAK = "No weak directions: the measurements constrain more than half of each"
_SPECTRUM_HOVER = [
    ("eigenmode", "@{mode} @{name}"),
    ("measurements", "@{data_share}{0.0000}"),
    ("reference sources", "@{reference_share}{0.0000}"),
    ("priors of other sources", "@{source_share}{0.0000}"),
    ("priors of the calibration", "@{calibration_share}{0.0000}"),
    ("relative information", "@{relative_text}"),
]
_PART_HOVER = [
    ("weak direction", "@{mode} @{name}"),
    ("constrained by", "@{what}"),
    ("share", "@{share}{0.0000}"),
]
_DECIDER_COLOURS: Mapping[str, str] = MappingProxyType(
    {
        DATA: SERIES_COLOURS[0],
        REFERENCES: CLASS_COLOURS[REFERENCE],
        SOURCES: SERIES_COLOURS[2],
        CALIBRATION: SERIES_COLOURS[3],
    }
)
_WEAK_COLOUR = CLASS_COLOURS[REFERENCE]
_WEAK_BELOW = 0.5
# Parts of a bar that are at least this long are named above it.
_LEAST_NAMED_SHARE = 0.16
_LEAST_VISIBLE_SHARE = 1e-3
_MODE_LABEL, _SHARE_LABEL = "eigenmode, weakest first (number)", "share (0 to 1)"
_PART_LABEL, _DIRECTION_LABEL = "share of the information (0 to 1)", "weak direction (number)"
_MODE_TICKS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)


def plot_eigenmode_spectrum(table: pd.DataFrame, *, width: int = PANEL_WIDTH) -> Figure:
    """Draw the measurements' share of the information on every eigenmode, and its information.

    Parameters
    ----------
    table : `tables.eigenmode_spectrum`
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        return message(
            "Eigenmodes of the calibration",
            _NONE,
            width=width,
            xlabel=_MODE_LABEL,
            ylabel=_SHARE_LABEL,
        )
    rows = table.assign(
        relative_text=[power_text(value, 2) for value in table["relative_information"]]
    )
    weak = int((rows["data_share"] < _WEAK_BELOW).sum())
    information = rows["relative_information"]
    ticks = [(float(tick), str(tick)) for tick in _MODE_TICKS if tick <= len(rows)]
    panel = partial(
        framed,
        x=Axis(_MODE_LABEL, (0.8, 1.25 * len(rows)), is_log=True, ticks=ticks),
        width=width,
        height=round(0.75 * width),
    )
    return side_by_side(
        [
            panel(
                [horizontal(_WEAK_BELOW, name="weak below"), *_points(rows, "data_share")],
                title="Share that the measurements constrain",
                subtitle=f"{weak} of {len(rows)} eigenmodes are weak: less than half",
                y=Axis("share of the measurements (0 to 1)", (-0.04, 1.04)),
            ),
            panel(
                list(_points(rows, "relative_information")),
                title="Information relative to other parameters fixed",
                subtitle=f"smallest: {power_text(float(information.min()), 2)}",
                y=Axis(
                    "relative information (ratio)",
                    (0.2 * float(information.min()), 5.0 * float(information.max())),
                    is_log=True,
                ),
            ),
        ],
        columns=2,
    )


def plot_eigenmode_deciders(table: pd.DataFrame, *, width: int = _PAGE_WIDTH) -> Figure:
    """Draw a bar for each weak direction, with its name and the shares of what constrains it.

    Parameters
    ----------
    table : `tables.eigenmode_deciders`
    width : of the frame, screen pixels
    """
    title = "What decides the weak directions"
    if table.empty:
        return message(title, _NO_WEAK, width=width, xlabel=_PART_LABEL, ylabel=_DIRECTION_LABEL)
    modes = table.drop_duplicates("mode")
    last = int(modes["mode"].max())
    ticks = [(float(mode), str(mode)) for mode in modes["mode"]]
    return framed(
        [*_bars(table), _names(table)],
        title=title,
        x=Axis(_PART_LABEL, (-0.005, 1.005)),
        y=Axis(_DIRECTION_LABEL, (last + 0.55, 0.35), ticks=ticks),
        width=width,
        height=42 * len(modes) + 10,
        legend_columns=4,
    )


def _points(rows: pd.DataFrame, column: str) -> Iterator[Glyphs]:
    for name, weak, colour, size in (
        ("rest", False, "mark", 4.0),
        ("weak", True, _WEAK_COLOUR, 8.0),
    ):
        yield points(
            rows[rows["is_weak"] == weak],
            "mode",
            column,
            name=name,
            color=colour,
            size=size,
            hover=_SPECTRUM_HOVER,
        )


def _bars(table: pd.DataFrame) -> Iterator[Glyphs]:
    rows = table.assign(bottom=table["mode"] + 0.36, top=table["mode"] + 0.02)
    for decider in DECIDERS:
        # Parts too short to be seen have no entry in the legend.
        parts = rows[rows["decider"] == decider]
        if not (parts["share"] >= _LEAST_VISIBLE_SHARE).any():
            continue
        yield rectangles(
            parts,
            name=decider,
            color=_DECIDER_COLOURS[decider],
            line_color="background",
            line_width=0.7,
            hover=_PART_HOVER,
            label=decider,
        )


def _names(table: pd.DataFrame) -> Glyphs:
    """Return what decides each direction, and its name, above its bar."""
    modes = table.drop_duplicates("mode")
    named = table[table["share"] >= _LEAST_NAMED_SHARE].sort_values("share", ascending=False)
    words = [
        ", ".join(
            f"{what} {100.0 * share:.0f} %"
            for what, share in named.loc[named["mode"] == mode, ["what", "share"]].to_numpy()
        )
        for mode in modes["mode"]
    ]
    return texts(
        np.zeros(len(modes)),
        modes["mode"] - 0.02,
        [f"{of}: {name}" if of else name for of, name in zip(words, modes["name"], strict=True)],
        name="names",
        align="left",
        baseline="bottom",
    )


def _plot_spectrum(chosen: Chosen) -> Figure:
    return plot_eigenmode_spectrum(eigenmode_spectrum(chosen.result))


def _plot_deciders(chosen: Chosen) -> Figure:
    return plot_eigenmode_deciders(eigenmode_deciders(chosen.result))


DIAGNOSTICS = (
    Diagnostic(
        "eigenmode-spectrum",
        "Eigenmodes of the calibration",
        "Every independent combination of calibration parameters, the weakest first: the share of "
        "its information that comes from the measurements, and its information relative to that "
        "with the other parameters fixed. Good: at most a dozen weak ones, clearly apart from "
        "the rest.",
        OrbitWorkspace.WEAK_DIRECTIONS,
        82,
        _plot_spectrum,
        is_wide=True,
        needs_eigenmodes=True,
        equation=(
            "S(data) v = λ S v, with the information S(data) of the measurements in the "
            "information S of all, the sources eliminated; left λ, right vᵀ S v / Σ v² "
            "/ σ²(conditional)"
        ),
    ),
    Diagnostic(
        "weak-directions",
        "What decides the weak directions",
        "The combinations that the measurements do not constrain, and what constrains them "
        "instead. Good: the reference sources constrain what moves the sky, and the calibration's "
        "priors constrain only what moves pointings against detectors. What a prior constrains is "
        "assumed, not measured.",
        OrbitWorkspace.WEAK_DIRECTIONS,
        83,
        _plot_deciders,
        is_wide=True,
        needs_eigenmodes=True,
        least_height=450,
        equation=(
            "shares of vᵀ S v: of measurements, reference sources, other sources and "
            "priors of the calibration; they add up to 1"
        ),
    ),
)
