"""FigureView: drawn for who comes near it, and faded while it shows what no longer is."""

import holoviews as hv
import pytest

from plateviz.dashboard.views.figure import FigureGrid, FigureView
from plateviz.plots.gallery import diagnostics


@pytest.fixture
def drawings():
    return []


@pytest.fixture
def view(drawings):
    def picture(theme):
        drawings.append(theme)
        return hv.Curve([1, 2, 3])

    return FigureView(diagnostics()[0], picture, waiting="Nothing yet.")


def opacity(view):
    return view._body.styles["opacity"]


def words(view):
    return view._body[0].object


def test_nothing_is_due_that_nobody_is_near(view):
    assert not view.is_due
    view.visibility.is_near = True
    assert view.is_due
    view.draw()
    assert not view.is_due


def test_a_change_out_of_sight_waits_and_fades_the_figure(view, drawings):
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
    assert drawings == ["light", "dark"]


def test_a_figure_is_faded_while_another_is_made(view):
    view.draw()
    view.mark_stale(True)
    assert opacity(view) != "1"
    view.mark_stale(False)
    assert opacity(view) == "1"


def test_the_words_say_what_is_waited_for():
    view = FigureView(diagnostics()[0], lambda theme: None, waiting="Nothing yet.")
    assert "Being drawn." in words(view)
    view.draw()
    assert "Nothing yet." in words(view)


def test_a_figure_that_fails_says_why_and_is_not_tried_again():
    def picture(theme):
        raise ValueError("no sources")

    view = FigureView(diagnostics()[0], picture)
    view.visibility.is_near = True
    view.draw()
    assert "This figure cannot be drawn: no sources" in words(view)
    assert not view.is_due


def test_the_grid_draws_a_few_that_are_near_and_tells_who_comes_near():
    drawn = []
    views = [
        FigureView(diagnostic, lambda theme, name=diagnostic.name: drawn.append(name))
        for diagnostic in diagnostics()[:6]
    ]
    grid, calls = FigureGrid(views), []
    grid.on_sight(calls.append)
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
