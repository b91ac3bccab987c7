"""FigureView: drawn when near the screen, and faded while out of date."""

import holoviews as hv
import pytest

from plateviz.dashboard.views.figure import FigureGrid, FigureView
from plateviz.plots.gallery import diagnostics


@pytest.fixture
def themes():
    return []


@pytest.fixture
def view(themes):
    def draw(theme):
        themes.append(theme)
        return hv.Curve([1, 2, 3])

    return FigureView(diagnostics()[0], draw, waiting="Nothing yet.")


def opacity(view):
    return view._body.styles["opacity"]


def text(view):
    return view._body[0].object


def test_figure_is_due_only_near_the_screen(view):
    assert not view.is_due
    view.visibility.is_near = True
    assert view.is_due
    view.draw()
    assert not view.is_due


def test_change_away_from_the_screen_waits_and_fades_the_figure(view, themes):
    view.visibility.is_near = True
    view.draw()
    assert opacity(view) == "1"
    view.visibility.is_near = False
    view.change("dark")
    assert not view.is_due
    assert opacity(view) != "1"
    view.visibility.is_near = True
    view.draw()
    assert opacity(view) == "1"
    assert themes == ["light", "dark"]


def test_stale_figure_is_faded(view):
    view.draw()
    view.mark_stale(True)
    assert opacity(view) != "1"
    view.mark_stale(False)
    assert opacity(view) == "1"


def test_empty_card_has_the_waiting_text():
    view = FigureView(diagnostics()[0], lambda theme: None, waiting="Nothing yet.")
    assert "Being drawn." in text(view)
    view.draw()
    assert "Nothing yet." in text(view)


def test_figure_that_fails_shows_the_reason_and_is_not_drawn_again():
    def draw(theme):
        raise ValueError("no sources")

    view = FigureView(diagnostics()[0], draw)
    view.visibility.is_near = True
    view.draw()
    assert "This figure cannot be drawn: no sources" in text(view)
    assert not view.is_due


def test_grid_draws_a_few_figures_near_the_screen_at_a_time():
    drawn = []
    views = [
        FigureView(diagnostic, lambda theme, name=diagnostic.name: drawn.append(name))
        for diagnostic in diagnostics()[:6]
    ]
    grid, calls = FigureGrid(views), []
    grid.on_visibility(calls.append)
    assert not grid.is_due
    for view in views[1:]:
        view.visibility.is_near = True
    assert len(calls) == 5
    grid.draw_due()
    assert grid.is_due
    assert drawn == [d.name for d in diagnostics()[1 : 1 + len(drawn)]]
    for _ in views:
        grid.draw_due()
    assert not grid.is_due
    assert sorted(drawn) == sorted(d.name for d in diagnostics()[1:6])
