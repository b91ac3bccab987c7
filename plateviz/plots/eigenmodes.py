"""Eigenmodes of the calibration: their spectrum, and what constrains the weak directions."""

from collections.abc import Iterator, Mapping
from functools import partial
from types import MappingProxyType

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.style import (
    CLASS_COLOURS,
    PANEL_WIDTH,
    SERIES_COLOURS,
    TICK_SIZE,
    AxisLabels,
    drawn,
    framed,
    message,
    side_by_side,
)
from plateviz.plots.theme import theme_of
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
# Parts of a bar that are at least this long have room for text.
_LEAST_LABELLED_SHARE = 0.16
_LEAST_VISIBLE_SHARE = 1e-3
_LABELS: AxisLabels = {"xlabel": "eigenmode, weakest first (number)", "ylabel": "share (0 to 1)"}


def plot_eigenmode_spectrum(
    table: pd.DataFrame, *, theme: str = "light", width: int = PANEL_WIDTH
) -> hv.Layout | hv.Overlay:
    """Draw the measurements' share of the information on every eigenmode, and its information.

    Parameters
    ----------
    table : `tables.eigenmode_spectrum`
    theme : "light" or "dark"
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        return message("Eigenmodes of the calibration", _NONE, theme=theme, width=width, **_LABELS)
    rows = table.assign(relative_text=[f"{value:.1e}" for value in table["relative_information"]])
    weak = int((rows["data_share"] < _WEAK_BELOW).sum())
    line = drawn(
        hv.HLine(_WEAK_BELOW), color=theme_of(theme).line, line_dash="dashed", line_width=1.2
    )
    information = rows["relative_information"]
    panel = partial(
        framed,
        theme=theme,
        width=width,
        height=round(0.75 * width),
        xlim=(0.8, 1.25 * len(rows)),
        logx=True,
        xticks=[t for t in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000) if t <= len(rows)],
        xlabel=_LABELS["xlabel"],
    )
    return side_by_side(
        [
            panel(
                [line, *_points(rows, "data_share", theme)],
                title="Share that the measurements constrain",
                subtitle=f"{weak} of {len(rows)} eigenmodes are weak: less than half",
                ylim=(-0.04, 1.04),
                ylabel="share of the measurements (0 to 1)",
            ),
            panel(
                list(_points(rows, "relative_information", theme)),
                title="Information relative to other parameters fixed",
                subtitle=f"smallest: {information.min():.1e}",
                ylim=(0.2 * float(information.min()), 5.0 * float(information.max())),
                logy=True,
                ylabel="relative information (ratio)",
            ),
        ],
        columns=2,
    )


def plot_eigenmode_deciders(
    table: pd.DataFrame, *, theme: str = "light", width: int = _PAGE_WIDTH
) -> hv.Overlay:
    """Draw a bar for each weak direction, with its name and the shares of what constrains it.

    Parameters
    ----------
    table : `tables.eigenmode_deciders`
    theme : "light" or "dark"
    width : of the frame, screen pixels
    """
    title = "What decides the weak directions"
    labels: AxisLabels = {
        "xlabel": "share of the information (0 to 1)",
        "ylabel": "weak direction (number)",
    }
    if table.empty:
        return message(title, _NO_WEAK, theme=theme, width=width, **labels)
    modes = table.drop_duplicates("mode")
    last = int(modes["mode"].max())
    return framed(
        [*_bars(table, theme), *_bar_labels(table), *_names(modes, theme)],
        title=title,
        theme=theme,
        width=width,
        height=42 * len(modes) + 10,
        xlim=(-0.005, 1.005),
        ylim=(last + 0.55, 0.35),
        yticks=[(mode, str(mode)) for mode in modes["mode"]],
        legend_columns=4,
        **labels,
    )


def _points(rows: pd.DataFrame, column: str, theme: str) -> Iterator[hv.Points]:
    extra = [c for c in rows.columns if c not in ("mode", column)]
    for weak, colour, size in ((False, theme_of(theme).mark, 4), (True, _WEAK_COLOUR, 8)):
        points = hv.Points(rows[rows["is_weak"] == weak], ["mode", column], extra)
        yield drawn(
            points, color=colour, size=size, tools=["hover"], hover_tooltips=_SPECTRUM_HOVER
        )


def _bars(table: pd.DataFrame, theme: str) -> Iterator[hv.Rectangles]:
    rows = table.assign(bottom=table["mode"] + 0.36, top=table["mode"] + 0.02)
    for decider in DECIDERS:
        # Parts too short to be seen have no entry in the legend.
        parts = rows[rows["decider"] == decider]
        if not (parts["share"] >= _LEAST_VISIBLE_SHARE).any():
            continue
        bars = hv.Rectangles(
            parts,
            ["left", "bottom", "right", "top"],
            ["mode", "name", "what", "share"],
            label=decider,
        )
        yield drawn(
            bars,
            color=_DECIDER_COLOURS[decider],
            line_color=theme_of(theme).background,
            line_width=0.7,
            tools=["hover"],
            hover_tooltips=_PART_HOVER,
        )


def _bar_labels(table: pd.DataFrame) -> Iterator[hv.Labels]:
    rows = table[table["share"] >= _LEAST_LABELLED_SHARE]
    texts = [
        f"{what} {100.0 * s:.0f} %" for what, s in zip(rows["what"], rows["share"], strict=True)
    ]
    middle = 0.5 * (rows["left"] + rows["right"])
    labels = hv.Labels((middle, rows["mode"] + 0.19, texts))
    yield drawn(labels, text_color="#ffffff", text_font_size="10px")


def _names(modes: pd.DataFrame, theme: str) -> Iterator[hv.Labels]:
    labels = hv.Labels((np.zeros(len(modes)), modes["mode"] - 0.02, modes["name"]))
    yield drawn(
        labels,
        text_color=theme_of(theme).text,
        text_font_size=TICK_SIZE,
        text_align="left",
        text_baseline="bottom",
    )


def _draw_spectrum(chosen: Chosen, theme: str) -> hv.Layout | hv.Overlay:
    return plot_eigenmode_spectrum(eigenmode_spectrum(chosen.result), theme=theme)


def _draw_deciders(chosen: Chosen, theme: str) -> hv.Overlay:
    return plot_eigenmode_deciders(eigenmode_deciders(chosen.result), theme=theme)


DIAGNOSTICS = (
    Diagnostic(
        "eigenmode-spectrum",
        "Eigenmodes of the calibration",
        "Every independent combination of calibration parameters, the weakest first: the share of "
        "its information that comes from the measurements, and its information relative to that "
        "with the other parameters fixed. Good: at most a dozen weak ones, clearly apart from "
        "the rest.",
        82,
        _draw_spectrum,
        is_wide=True,
    ),
    Diagnostic(
        "weak-directions",
        "What decides the weak directions",
        "The combinations that the measurements do not constrain, and what constrains them "
        "instead. Good: the reference sources constrain what moves the sky, and the calibration's "
        "priors constrain only what moves pointings against detectors. What a prior constrains is "
        "assumed, not measured.",
        83,
        _draw_deciders,
        is_wide=True,
    ),
)
