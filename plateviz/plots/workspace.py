"""The workspaces of each page of the dashboard: parts that fit a screen, in page order.

Every figure of a page names its workspace; reports and notebooks show the figures in page order.
"""

from enum import StrEnum


class OrbitWorkspace(StrEnum):
    """Workspaces of the Orbit page.

    `VERDICT` shows the key figures of the others small; `EXPLORE` has one figure, of columns that a
    person chooses.
    """

    VERDICT = "verdict"
    RESIDUALS = "residuals"
    PATTERNS = "patterns"
    TRENDS = "trends"
    SKY = "sky"
    CALIBRATION = "calibration"
    WEAK_DIRECTIONS = "weak-directions"
    ORDERS = "orders-and-comparison"
    EXPLORE = "explore"


class SurveyWorkspace(StrEnum):
    """Workspaces of the Survey page; `EXPLORE` as in `OrbitWorkspace`.

    `COMPARE` shows two runs.
    """

    VERDICT = "verdict"
    ACCURACY = "accuracy"
    CATALOGUE = "catalogue"
    COMPARE = "compare-runs"
    EXPLORE = "explore"


class SourceWorkspace(StrEnum):
    """Workspaces of the Source page."""

    MOTION = "motion"
    ORBITS = "orbits-and-numbers"


Workspace = OrbitWorkspace | SurveyWorkspace | SourceWorkspace


def title_of(workspace: Workspace) -> str:
    """Return the displayed title of a workspace."""
    return workspace.value.replace("-", " ").capitalize()
