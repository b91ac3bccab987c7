"""View: the views of the page, and where each keeps its workspace."""

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType


class View(StrEnum):
    """The views of the page, from the widest to the narrowest."""

    SURVEY = "survey"
    ORBIT = "orbit"
    SOURCE = "source"


# Each view keeps its own workspace while others are on the screen.
WORKSPACES: Mapping[View, str] = MappingProxyType(
    {
        View.SURVEY: "survey_workspace",
        View.ORBIT: "orbit_workspace",
        View.SOURCE: "source_workspace",
    }
)
