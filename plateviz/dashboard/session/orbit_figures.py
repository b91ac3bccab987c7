"""The figures of the Orbit page, and the part of the solution on the screen that they show."""

from collections import OrderedDict
from typing import NamedTuple
from weakref import ref

from plateviz.dashboard.session.session import Session
from plateviz.figures.figure import Figure
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.gallery import diagnostics
from plateviz.plots.workspace import OrbitWorkspace
from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.io.result_instrument import instrument_of
from solver.simulate.settings import SurveySettings

_FIGURES = "figures"
# Figures that are kept with a solution: those of a workspace or two.
_MOST = 16


class _Made(NamedTuple):
    """A figure, and what it was made from beside the solution that keeps it."""

    figure: Figure
    instrument: Instrument
    simulation: SurveySettings | None
    # No solution keeps another one in memory.
    other: "ref[FitResult] | None"

    def is_of(self, chosen: Chosen) -> bool:
        other = None if self.other is None else self.other()
        return (
            self.instrument is chosen.instrument
            and self.simulation is chosen.simulation
            and (self.other is None) == (chosen.other is None)
            and other is chosen.other
        )


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
    return _chosen(session, shown.result, session.other.result if session.other else None)


def chosen_next(session: Session, result: FitResult) -> Chosen:
    """Return what `chosen_of` will be with a what-if of the solution on the screen."""
    other = session.chosen_other or session.fitted
    return _chosen(session, result, other.result if other else None)


def _chosen(session: Session, result: FitResult, other: FitResult | None) -> Chosen:
    return Chosen(
        result=result,
        instrument=instrument_of(result, otherwise=session.store.instrument),
        exposures=tuple(session.shown_part.exposures_of(result)),
        detector=session.shown_part.detector_id,
        other=other,
        simulation=session.store.simulation,
    )


def figure_of(diagnostic: Diagnostic, chosen: Chosen) -> Figure:
    """Return a figure, which is made once for all pages that show the same.

    Errors are those of its plot function.
    """
    made: OrderedDict[tuple, _Made] = chosen.result.derived.setdefault(_FIGURES, OrderedDict())
    key = diagnostic.name, chosen.exposures, chosen.detector
    found = made.pop(key, None)
    if found is None or not found.is_of(chosen):
        other = None if chosen.other is None else ref(chosen.other)
        found = _Made(diagnostic.plot(chosen), chosen.instrument, chosen.simulation, other)
    made[key] = found
    while len(made) > _MOST:
        made.popitem(last=False)
    return found.figure
