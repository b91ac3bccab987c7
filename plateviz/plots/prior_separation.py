"""Separation between catalogue and truth (paper, figure "exp:reference:hist")."""

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.points import steps
from plateviz.plots.style import (
    CLASS_COLOURS,
    PANEL_WIDTH,
    AxisLabels,
    drawn,
    framed,
    message,
    side_by_side,
)
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.theme import theme_of
from plateviz.plots.units import angle_text, angle_unit
from plateviz.tables.prior_separation import EPOCH, prior_separation, prior_separation_histogram
from plateviz.tables.survey_tables import SurveyTables

_TITLE = "Catalogue minus truth"


def plot_prior_separation(
    table: pd.DataFrame, *, epoch: float = EPOCH, theme: str = "light", width: int = PANEL_WIDTH
) -> hv.Layout | hv.Overlay:
    """Draw histograms of the separations of catalogue and truth, a panel per group.

    Parameters
    ----------
    table : `tables.prior_separation`
    epoch : of the separations, Julian year
    theme : "light" or "dark"
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        return message(
            _TITLE,
            "No truth for this survey",
            theme=theme,
            width=width,
            **_labels(epoch, "mas"),
        )
    groups = prior_separation_histogram(table).groupby("group", sort=False)
    panels = [_panel(rows, str(group), epoch, theme, width) for group, rows in groups]
    return side_by_side(panels, columns=2)


def _panel(rows: pd.DataFrame, group: str, epoch: float, theme: str, width: int) -> hv.Overlay:
    first = rows.iloc[0]
    unit, factor = angle_unit(float(first["median_mas"]))
    bins = rows.assign(left=rows["left"] * factor, right=rows["right"] * factor)
    centre = 0.5 * (bins["left"] + bins["right"])
    expected = hv.Curve((centre, bins["expected"]), "edge", "count", label="expected from its σ")
    top = 1.1 * float(np.maximum(bins["count"], bins["expected"]).max())
    return framed(
        [
            steps(bins, f"{group} sources", CLASS_COLOURS[group]),
            drawn(expected, color=theme_of(theme).line, line_width=1.6),
        ],
        title=f"Catalogue minus truth, {group} sources",
        subtitle=_subtitle(first),
        theme=theme,
        width=width,
        height=round(0.7 * width),
        xlim=(0.0, float(bins["right"].max())),
        ylim=(0.0, top),
        legend_columns=2,
        **_labels(epoch, unit),
    )


def _labels(epoch: float, unit: str) -> AxisLabels:
    return {
        "xlabel": f"separation on the sky at J{epoch:.1f} ({unit})",
        "ylabel": "sources per bin",
    }


def _subtitle(first: pd.Series) -> str:
    artificial = f", {first['n_artificial']:,} of them artificial" if first["n_artificial"] else ""
    return (
        f"n = {first['n']:,}{artificial}\n"
        f"median {angle_text(first['median_mas'])}; {first['outside']:,} beyond the frame"
    )


def _draw(tables: SurveyTables, theme: str) -> hv.Layout | hv.Overlay:
    return plot_prior_separation(prior_separation(tables.catalogue, tables.truth), theme=theme)


SURVEY_FIGURES = (
    SurveyFigure(
        "prior-separation",
        "Catalogue minus truth",
        "Separation between catalogue and truth at the epoch of the survey: the errors of the "
        "priors. Good: histograms that follow the catalogue's stated uncertainties.",
        20,
        _draw,
        is_wide=True,
    ),
)
