"""Separation between catalogue and truth (paper, figure "exp:reference:hist")."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import Axis, Figure, framed, message, side_by_side
from plateviz.figures.glyphs import line
from plateviz.plots.elements.points import steps
from plateviz.plots.elements.style import CLASS_COLOURS, PANEL_WIDTH
from plateviz.plots.elements.units import angle_text, angle_unit
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.tables.prior_separation import EPOCH, prior_separation, prior_separation_histogram
from plateviz.tables.survey_tables import SurveyTables

_TITLE = "Catalogue minus truth"
_YLABEL = "sources per bin"


def plot_prior_separation(
    table: pd.DataFrame, *, epoch: float = EPOCH, width: int = PANEL_WIDTH
) -> Figure:
    """Draw histograms of the separations of catalogue and truth, a panel per group.

    Parameters
    ----------
    table : `tables.prior_separation`
    epoch : of the separations, Julian year
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        return message(
            _TITLE,
            "No truth for this survey",
            width=width,
            xlabel=_xlabel(epoch, "mas"),
            ylabel=_YLABEL,
        )
    groups = prior_separation_histogram(table).groupby("group", sort=False)
    panels = [_panel(rows, str(group), epoch, width) for group, rows in groups]
    return side_by_side(panels, columns=2)


def _panel(rows: pd.DataFrame, group: str, epoch: float, width: int) -> Figure:
    first = rows.iloc[0]
    unit, factor = angle_unit(float(first["median_mas"]))
    bins = rows.assign(left=rows["left"] * factor, right=rows["right"] * factor)
    centre = 0.5 * (bins["left"] + bins["right"])
    label = "expected from its σ"
    top = 1.1 * float(np.maximum(bins["count"], bins["expected"]).max())
    return framed(
        [
            steps(bins, f"{group} sources", CLASS_COLOURS[group]),
            line(centre, bins["expected"], name="expected", color="line", label=label),
        ],
        title=f"Catalogue minus truth, {group} sources",
        subtitle=_subtitle(first),
        x=Axis(_xlabel(epoch, unit), (0.0, float(bins["right"].max()))),
        y=Axis(_YLABEL, (0.0, top)),
        width=width,
        height=round(0.7 * width),
        legend_columns=2,
    )


def _xlabel(epoch: float, unit: str) -> str:
    return f"separation on the sky at J{epoch:.1f} ({unit})"


def _subtitle(first: pd.Series) -> str:
    artificial = f", {first['n_artificial']:,} of them artificial" if first["n_artificial"] else ""
    return (
        f"n = {first['n']:,}{artificial}\n"
        f"median {angle_text(first['median_mas'])}; {first['outside']:,} beyond the frame"
    )


def _plot(tables: SurveyTables) -> Figure:
    return plot_prior_separation(prior_separation(tables.catalogue, tables.truth))


SURVEY_FIGURES = (
    SurveyFigure(
        "prior-separation",
        "Catalogue minus truth",
        "Separation between catalogue and truth at the epoch of the survey: the errors of the "
        "priors. Good: histograms that follow the catalogue's stated uncertainties.",
        SurveyWorkspace.CATALOGUE,
        20,
        _plot,
        is_wide=True,
        equation="separation = √((Δα cos δ)² + (Δδ)²), catalogue − truth at the epoch",
        is_of_run=False,
    ),
)
