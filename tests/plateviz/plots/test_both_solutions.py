"""Two solutions beside each other: the same limits, colours and lengths of arrows."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz.figures.alike import beside
from plateviz.figures.figure import Ramp
from plateviz.plots.comparison.both_solutions import BOTH, comparable_figures, figure_of_both
from plateviz.plots.diagnostic import Chosen
from plateviz.plots.gallery import diagnostics
from plateviz.verdict.solution_changes import solution_changes
from solver.data.settings import FitSettings


@pytest.fixture(scope="module")
def doubled(fit_result):
    """The same solution with residuals of twice the size, under other settings."""
    rows = fit_result.residuals.copy()
    rows[["residual_x", "residual_y"]] *= 2.0
    settings = FitSettings(order=3, aberration=False, prior_widths={"distortion_x": 0.5})
    return replace(fit_result, residuals=rows, settings=settings)


@pytest.fixture(scope="module")
def chosen(fit_result, doubled, instrument):
    return Chosen(doubled, instrument, ((0, 0), (0, 1)), other=fit_result)


def figure_named(name):
    return next(one for one in comparable_figures() if one.name == name)


def shafts(frame):
    glyphs = frame["arrows"]
    # The heads follow, which do not become ever larger.
    x0, y0, x1, y1 = (
        glyphs.values(name)[: len(frame["tails"])] for name in ("x0", "y0", "x1", "y1")
    )
    return np.hypot(x1 - x0, y1 - y0)


def test_arrows_of_both_have_the_same_scale(chosen):
    a, b = figure = figure_of_both(figure_named("residual-map"), chosen)
    assert figure.linked == "xy"
    assert (a.title[:4], b.title[:4]) == ("(A) ", "(B) ")
    assert np.allclose(shafts(b), 2.0 * shafts(a))


@pytest.mark.parametrize("diagnostic", comparable_figures(), ids=lambda one: one.name)
def test_every_figure_stands_beside_itself(diagnostic, fit_result, instrument):
    chosen = Chosen(fit_result, instrument, ((0, 0), (0, 1)), other=fit_result)
    figure = figure_of_both(diagnostic, chosen)
    alone = diagnostic.plot(replace(chosen, other=None))
    assert figure.message is not None or len(figure) == 2 * len(alone)


def test_frames_have_the_limits_and_colours_of_both(chosen):
    diagnostic = figure_named("mean-residual-map")
    figure = figure_of_both(diagnostic, chosen)
    half = len(figure) // 2
    assert half == 2
    for a, b in zip(figure.frames[:half], figure.frames[half:], strict=True):
        assert (a.x.limits, a.y.limits) == (b.x.limits, b.y.limits)
        ramps = [
            look.limits
            for frame in (a, b)
            for glyphs in frame.glyphs
            for look in glyphs.looks.values()
            if isinstance(look, Ramp)
        ]
        assert len(ramps) >= 2
        assert len(set(ramps)) == 1


def test_reversed_axis_stays_reversed(chosen):
    alone = figure_named("footprint").plot(chosen)
    both = beside(alone, alone, ("(A)", "(B)"))
    assert both[1].x.limits == alone[0].x.limits
    assert both[1].x.limits[0] > both[1].x.limits[1]


def test_without_another_solution_it_says_so(chosen):
    figure = figure_of_both(figure_named("residual-map"), replace(chosen, other=None))
    assert figure.message.startswith("The chosen figure of another solution and of this one.")
    assert "Compare with (A)" in figure.message
    assert BOTH not in diagnostics()


def test_table_has_the_settings_that_differ_and_the_figures_of_merit(fit_result, doubled):
    table = solution_changes(fit_result, doubled).set_index("what")
    assert table.loc["Distortion order", ["a", "b"]].tolist() == ["order 5", "order 3"]
    assert table.loc["Stellar aberration", ["a", "b"]].tolist() == ["yes", "no aberration"]
    assert table.loc["Prior widths", "b"] == "distortion_x 0.5 um"
    assert "Leave out" not in table.index
    chi2 = f"{fit_result.summary['chi2_per_dof']:.4f}"
    assert table.loc["χ² per degree of freedom"].tolist() == [chi2, chi2, "+0.0000"]
    assert table.loc["Sources in both", "change"] == f"{len(fit_result.sources):,}"
    assert table.loc["Rms difference of positions in δ (mas)", "change"] == "0.0000"


def test_table_of_different_orbits_names_them(fit_result):
    other = replace(fit_result, summary={**fit_result.summary, "orbit": 7})
    table = solution_changes(fit_result, other)
    assert table.iloc[0].tolist() == ["Orbit", "", "7", ""]


def test_table_without_shared_sources_says_so(fit_result):
    moved = {
        name: table.assign(source_id=table["source_id"] + 10**12)
        for name in ("sources", "residuals")
        for table in [getattr(fit_result, name)]
    }
    table = solution_changes(fit_result, replace(fit_result, **moved)).set_index("what")
    assert table.loc["Sources in both", "change"] == "0"
    assert not any(name.startswith("Rms difference") for name in table.index)


def test_evidences_of_other_data_or_other_flat_priors_are_not_compared(fit_result):
    one = replace(fit_result, summary={**fit_result.summary, "log_evidence": -20.0})

    def change(**tables):
        changes = solution_changes(one, replace(one, **tables)).set_index("what")
        return changes.loc["Log evidence", "change"]

    residuals, calibration = one.residuals, one.calibration
    narrow = calibration.assign(prior_sigma=0.1 * calibration["prior_sigma"])
    assert change(calibration=narrow) == "+0.0"
    assert change(calibration=narrow.assign(prior_sigma=np.inf)) == ""
    assert change(residuals=residuals.iloc[1:]) == ""
    assert change(residuals=residuals.assign(sx=2.0 * residuals["sx"])) == ""


def test_input_files_that_were_changed_between_two_fits_are_named(fit_result):
    one = replace(fit_result, provenance={"obs.fits": "a", "ref.fits": "b"})
    other = replace(fit_result, provenance={"obs.fits": "c", "ref.fits": "b"})
    table = solution_changes(one, other)
    assert table.iloc[0].tolist() == ["Input files with other contents", "", "", "obs.fits"]
    assert not solution_changes(one, one)["what"].str.startswith("Input").any()
