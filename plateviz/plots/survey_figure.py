"""SurveyFigure and SourceFigure: one figure of a fitted survey, or of one of its sources.

`plateviz.plots.gallery` finds every module of this package that defines `SURVEY_FIGURES` or
`SOURCE_FIGURES`, and the Survey or the Source page shows its figures.
"""

from collections.abc import Callable
from dataclasses import dataclass

from plateviz.figures.figure import Figure
from plateviz.plots.workspace import SourceWorkspace, SurveyWorkspace
from plateviz.tables.survey_tables import SourceTables, SurveyTables

_DOCUMENT = "assets/docs/survey-diagnostics.md"


def _always(_: SurveyTables) -> bool:
    return True


@dataclass(frozen=True)
class SurveyFigure:
    """One figure of a fitted survey.

    Attributes
    ----------
    name : short and unique, used in addresses and file names
    title : displayed title
    caption : what it shows and what a good solution looks like, in a few sentences
    workspace : part of the Survey page that shows the figure
    position : sort key on the page
    plot : function of the tables that returns the figure
    is_wide : whether it takes the whole width of its workspace, or of a report
    equation : what is drawn, as text
    least_height : that it needs on the page, screen pixels; 0 where any card's height is enough
    narrow_height : the same in a window narrower than 1536 pixels; 0 for `least_height`
    column_height : the same where all figures are in one column, in a window narrower than 1200
        pixels; 0 for `narrow_height`
    takes_row : whether it needs a whole row of its workspace
    has_data : whether there is anything to draw, such as another run
    is_of_run : whether it differs between the runs of a survey
    """

    name: str
    title: str
    caption: str
    workspace: SurveyWorkspace
    position: int
    plot: Callable[[SurveyTables], Figure]
    is_wide: bool = False
    equation: str = ""
    least_height: int = 0
    narrow_height: int = 0
    column_height: int = 0
    takes_row: bool = False
    has_data: Callable[[SurveyTables], bool] = _always
    is_of_run: bool = True

    @property
    def document(self) -> str:
        """Where the documents explain the figure."""
        return f"{_DOCUMENT}, “{self.title}”"


@dataclass(frozen=True)
class SourceFigure:
    """One figure of a source of a fitted survey; attributes as in `SurveyFigure`."""

    name: str
    title: str
    caption: str
    workspace: SourceWorkspace
    position: int
    plot: Callable[[SourceTables], Figure]
    is_wide: bool = False
    equation: str = ""
    least_height: int = 0
    narrow_height: int = 0
    column_height: int = 0

    @property
    def document(self) -> str:
        """Where the documents explain the figure."""
        return f"{_DOCUMENT}, “{self.title}”"
