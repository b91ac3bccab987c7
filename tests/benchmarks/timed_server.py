"""Serve a dashboard, and note when stages of its work begin and end.

    python tests/benchmarks/timed_server.py FILE serve DIR [options of `plateviz serve`]

Each line that is added to FILE is a JSON list: the stage, its begin and its end, milliseconds since
1970. `bench_browser.py --stages` reads it.
"""

import json
import sys
import time
from collections.abc import Callable
from functools import wraps
from pathlib import Path

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from plateviz.cli.main import main
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.views.cards.figure import FigureView
from plateviz.dashboard.views.cards.figure_grid import FigureGrid
from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.solving.job import Job
from plateviz.solving.solution_store import SolutionStore

_METHODS = (
    (Session, "_request", "request"),
    (SolutionStore, "result", "read"),
    (Session, "_put_on_screen", "words"),
    (FigureGrid, "draw_due", "draw"),
    (FigureView, "_plot_figure", "describe"),
    (BokehFigure, "follow", "follow"),
)
"""Class, method, and the name of the stage."""


def note_stages(file: Path) -> None:
    """Let methods of the server write to `file` when they begin and end."""

    def note(stage: str, begin: float) -> None:
        with file.open("a", encoding="utf-8") as lines:
            lines.write(json.dumps([stage, 1e3 * begin, 1e3 * time.time()]) + "\n")

    def timed(work: Callable, stage: str) -> Callable:
        @wraps(work)
        def call(*arguments, **options):
            begin = time.time()
            try:
                return work(*arguments, **options)
            finally:
                note(stage, begin)

        return call

    for owner, name, stage in _METHODS:
        if stage != "describe":
            setattr(owner, name, timed(getattr(owner, name), stage))
    draw_new, take = FigureView._draw, Job.take

    def draw(view):
        if not getattr(view, "is_timed", False):
            view.is_timed, view._plot_figure = True, timed(view._plot_figure, "describe")
        draw_new(view)

    def take_event(job, event):
        note(f"solver: {event.get('stage', event['event'])}", time.time())
        take(job, event)

    FigureView._draw, Job.take = draw, take_event


if __name__ == "__main__":
    note_stages(Path(sys.argv[1]))
    sys.argv[1:] = sys.argv[2:]
    main()
