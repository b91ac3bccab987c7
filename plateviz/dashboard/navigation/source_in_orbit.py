"""What the Orbit view shows of a source that is opened in one of its orbits."""

from typing import Any

import pandas as pd

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.session.shown_part import ShownPart
from plateviz.dashboard.session.solution import Solution
from plateviz.plots.workspace import OrbitWorkspace
from solver.data.subset import Subset


def open_source_in_orbit(navigation: Navigation, source_id: int, orbit: int) -> None:
    """Open an orbit with a source selected, on the residual map where it was measured first.

    If the orbit has to be fitted, the exposure and the detector follow with the solution.
    """
    session = navigation.session
    navigation.open_orbit(orbit)
    navigation.turn_to_workspace(OrbitWorkspace.RESIDUALS)
    session.selection.select(Subset(sources=frozenset({source_id})))

    def show(solution: Solution) -> None:
        if solution.orbit == orbit:
            session.note(_show_measurements(session.shown_part, solution, source_id))

    if session.job is None:
        if session.shown is not None:
            show(session.shown)
        return

    def follow(event: Any) -> None:  # noqa: ANN401 an event of param
        # None while the orbit is on its way.
        if event.new is not None:
            session.param.unwatch(watcher)
            show(event.new)

    watcher = session.param.watch(follow, "shown")


def _show_measurements(part: ShownPart, solution: Solution, source_id: int) -> list[str]:
    """Show the first exposure and detector that measured a source, unless some are shown.

    Returns
    -------
    Why there are none, in words.
    """
    rows = solution.result.residuals
    rows = rows[rows["source_id"] == source_id]
    if rows.empty:
        return [f"this solution of orbit {solution.orbit} has no measurement of {source_id}"]
    if not _is_any_shown(part, solution, rows):
        field, plate, detector = (
            int(value)
            for value in rows.sort_values(["field_id", "plate_id"], kind="stable")[
                ["field_id", "plate_id", "detector_id"]
            ].iloc[0]
        )
        part.param.update(field=str(field), plates=(plate, plate), detector=str(detector))
    return []


def _is_any_shown(part: ShownPart, solution: Solution, rows: pd.DataFrame) -> bool:
    shown = set(part.exposures_of(solution.result))
    is_shown = [pair in shown for pair in zip(rows["field_id"], rows["plate_id"], strict=True)]
    detector = part.detector_id
    is_there = True if detector is None else rows["detector_id"] == detector
    return bool((pd.Series(is_shown, index=rows.index) & is_there).any())
