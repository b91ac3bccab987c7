"""Any figure of a run, of two runs of a survey beside each other."""

from dataclasses import replace

from plateviz.figures.figure import Figure, message
from plateviz.plots.comparison.both_solutions import with_same_limits
from plateviz.plots.gallery import survey_figures
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.tables.survey_tables import SurveyTables

_TITLE = "Both runs"


BOTH_RUNS = SurveyFigure(
    "both-runs",
    _TITLE,
    "A figure of the run that is compared with (A) and of the run on the screen (B), with the "
    "same limits and colours. Frames with the same axes zoom and move together. The key b "
    "exchanges the runs.",
    SurveyWorkspace.COMPARE,
    64,
    lambda tables: figure_of_both_runs(comparable_survey_figures()[0], tables),
    is_wide=True,
    equation="the figure of each run, as in its own workspace",
    narrow_height=520,
)
"""The card of the Survey page, which chooses the figure; a report has none."""


def comparable_survey_figures() -> tuple[SurveyFigure, ...]:
    """Return the figures that differ between the runs of a survey, in page order."""
    known = survey_figures()
    return tuple(
        one for one in known if one.is_of_run and one.workspace is not SurveyWorkspace.COMPARE
    )


def of_both_runs(figure: SurveyFigure) -> SurveyFigure:
    """Return a figure that is drawn of both runs."""
    return replace(
        figure,
        title=f"{_TITLE}: {figure.title}",
        plot=lambda tables: figure_of_both_runs(figure, tables),
        is_wide=True,
    )


def figure_of_both_runs(figure: SurveyFigure, tables: SurveyTables) -> Figure:
    """Draw a figure of the run that is compared with (A), and of the run (B).

    Limits and colours are the same for both.
    """
    if tables.other is None:
        return message(_TITLE, "There is no run to compare with.")
    # Each knows of the other, so that arrows have one scale.
    a = replace(tables.other, other=replace(tables, other=None))
    b = replace(tables, other=replace(tables.other, other=None))
    return with_same_limits(figure.title, figure.plot(a), figure.plot(b))
