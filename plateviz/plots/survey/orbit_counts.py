"""Number of orbits that measured each source (paper, figure "result:ts:orbit")."""

import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, Figure, Ticks, framed, message
from plateviz.plots.elements.points import steps
from plateviz.plots.elements.style import CLASS_COLOURS
from plateviz.plots.elements.ticks import log_ticks
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.tables.orbit_counts import orbit_counts
from plateviz.tables.survey_tables import SurveyTables

_TITLE = "Orbits of each source"
_YLABEL = "sources per bin"
_NONE_YET = "No source is counted before the last orbit of the run is fitted"
# Drawn count of an empty bin, below the frame: zero has no logarithm.
_NONE = 0.1
_LOWEST = 0.7
_ALL_TICKS_UP_TO = 200.0
_FEW = 8


def plot_orbit_counts(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw the histogram of the number of orbits per source for each class, with log counts.

    Parameters
    ----------
    table : `tables.orbit_counts`
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, _NONE_YET, width=width, xlabel=_xlabel(1), ylabel=_YLABEL)
    last = float(table["right"].max())
    top = 1.8 * float(table["count"].max())
    ticks = log_ticks((_LOWEST, top), whole=True, powers_only=top > _ALL_TICKS_UP_TO)
    step = round(float(table["right"].iloc[0] - table["left"].iloc[0]))
    return framed(
        [
            steps(_closed(rows), str(name), CLASS_COLOURS[str(name)])
            for name, rows in table.groupby("source_class", sort=False)
        ],
        title=_TITLE,
        subtitle=_subtitle(table),
        x=Axis(_xlabel(step), (-0.01 * last, 1.02 * last), ticks=_ticks(last)),
        y=Axis(_YLABEL, (_LOWEST, top), is_log=True, ticks=ticks),
        width=width,
        height=round(0.62 * width),
        legend_columns=3,
    )


def _ticks(last: float) -> Ticks | None:
    """Return a tick at each number of orbits where they are few: there is no half an orbit."""
    few = range(1, int(last) + 1)
    return tuple((float(n), str(n)) for n in few) if last < _FEW else None


def _xlabel(step: int) -> str:
    bins = "" if step == 1 else f", in bins of {step}"
    return f"number of orbits N{bins}"


def _closed(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the bins with an empty one at each end, so that the outline is closed."""
    bins = rows[["left", "right", "count"]].astype(float)
    bins["count"] = bins["count"].clip(lower=_NONE)
    low, high = float(bins["left"].iloc[0]), float(bins["right"].iloc[-1])
    ends = [
        pd.DataFrame({"left": [edge], "right": [edge], "count": [_NONE]}) for edge in (low, high)
    ]
    return pd.concat([ends[0], bins, ends[1]], ignore_index=True)


def _subtitle(table: pd.DataFrame) -> str:
    firsts = table.drop_duplicates("source_class")
    parts = [
        f"{row.source_class}: n = {row.n:,}, median {row.median:g}"
        for row in firsts.itertuples(index=False)
    ]
    return "\n".join(parts)


def _plot(tables: SurveyTables) -> Figure:
    return plot_orbit_counts(orbit_counts(tables.motions))


SURVEY_FIGURES = (
    SurveyFigure(
        "orbit-counts",
        "Orbits of each source",
        "Number of orbits that measured each source, by class. Sources near the target are "
        "measured most often. Good: similar histograms for classes in the same part of the sky.",
        SurveyWorkspace.CATALOGUE,
        30,
        _plot,
        equation="N of a source = number of orbits with a measurement of it",
    ),
)
