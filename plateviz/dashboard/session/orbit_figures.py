"""The figures of the Orbit page, and the part of the solution on the screen that they show."""

from plateviz.dashboard.session.session import Session
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.gallery import diagnostics
from plateviz.plots.workspace import OrbitWorkspace
from solver.io.result_instrument import instrument_of


def figures_of(session: Session, workspace: OrbitWorkspace) -> list[Diagnostic]:
    """Return the figures of a workspace in page order; of Verdict, the key figures of all."""
    is_first = workspace is OrbitWorkspace.VERDICT
    return [
        one
        for one in diagnostics()
        if (one.is_key if is_first else one.workspace is workspace)
        and (session.store.simulation is not None or not one.is_of_simulation)
    ]


def chosen_of(session: Session) -> Chosen | None:
    """Return the solution on the screen with what is shown of it; None if there is none."""
    shown = session.shown
    if shown is None:
        return None
    return Chosen(
        result=shown.result,
        instrument=instrument_of(shown.result, otherwise=session.store.instrument),
        exposures=tuple(session.selection.exposures_of(shown.result)),
        detector=session.selection.detector_id,
        other=session.other.result if session.other else None,
        simulation=session.store.simulation,
    )
