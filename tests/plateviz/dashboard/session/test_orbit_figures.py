"""Figures of the Orbit page that are made once for all pages that show the same."""

import gc
from dataclasses import replace
from weakref import ref

import pytest

from plateviz.dashboard.session.orbit_figures import figure_of
from plateviz.figures.figure import message
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.workspace import OrbitWorkspace
from solver.errors import InputError
from solver.simulate.settings import SurveySettings


@pytest.fixture
def plotted():
    """The parts of solutions that the figure has been made of."""
    return []


@pytest.fixture
def figure(plotted):
    """A figure that notes what it is made of."""

    def plot(chosen):
        plotted.append(chosen)
        return message("A figure", f"number {len(plotted)}")

    return Diagnostic("one", "A figure", "", OrbitWorkspace.SKY, 0, plot)


@pytest.fixture
def chosen(fit_result, instrument):
    """A part of a solution that no other test has shown."""
    return Chosen(replace(fit_result), instrument, ((0, 0), (0, 1)), detector=1)


def test_a_figure_is_made_once_for_all_pages_that_show_the_same(figure, chosen, plotted):
    first = figure_of(figure, chosen)
    assert figure_of(figure, replace(chosen)) is first
    assert plotted == [chosen]


@pytest.mark.parametrize(
    "change",
    [
        lambda one: {"exposures": ((0, 1),)},
        lambda one: {"detector": None},
        lambda one: {"other": replace(one.result)},
        lambda one: {"simulation": SurveySettings()},
        lambda one: {"instrument": replace(one.instrument)},
        lambda one: {"result": replace(one.result)},
    ],
    ids=["exposures", "detector", "other", "simulation", "instrument", "result"],
)
def test_whatever_is_chosen_otherwise_makes_another_figure(figure, chosen, plotted, change):
    changed = replace(chosen, **change(chosen))
    assert figure_of(figure, chosen) is not figure_of(figure, changed)
    assert len(plotted) == 2
    assert plotted[1] is changed


def test_another_figure_of_the_same_is_not_taken_for_it(figure, chosen):
    assert figure_of(figure, chosen) is not figure_of(replace(figure, name="two"), chosen)


def test_a_figure_compared_with_a_solution_that_is_gone_is_made_anew(figure, chosen, plotted):
    other = replace(chosen.result)
    is_there = ref(other)
    figure_of(figure, replace(chosen, other=other))
    plotted.clear()
    del other
    gc.collect()
    assert is_there() is None
    figure_of(figure, chosen)
    assert len(plotted) == 1


def test_figures_of_long_ago_are_forgotten(figure, chosen, plotted):
    parts = [replace(chosen, exposures=((0, plate),)) for plate in range(40)]
    for part in parts:
        figure_of(figure, part)
    assert len(chosen.result.derived["figures"]) < 20
    figure_of(figure, parts[-1])
    assert len(plotted) == 40
    figure_of(figure, parts[0])
    assert len(plotted) == 41


def test_a_figure_that_cannot_be_made_is_tried_again(figure, chosen):
    reasons = iter(("first", "second"))

    def fail(_):
        raise InputError(next(reasons))

    failing = replace(figure, plot=fail)
    for reason in ("first", "second"):
        with pytest.raises(InputError, match=reason):
            figure_of(failing, chosen)
