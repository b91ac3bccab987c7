"""Two runs beside each other, and the differences of their motions."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from plateviz import plots
from plateviz.plots.comparison.both_runs import comparable_survey_figures, figure_of_both_runs
from plateviz.plots.elements.style import ROW_LIMIT
from plateviz.plots.gallery import survey_figures
from plateviz.tables import motion_differences, shared_motions
from plateviz.tables.run_diagnosis import no_tests
from plateviz.tables.survey_tables import SurveyTables
from tests.plateviz.plots.drawn import plots_of, subtitle_of
from tests.plateviz.run_tables import calibrations, zonal

(DIFFERENCES,) = (one for one in survey_figures() if one.name == "motion-differences")


@pytest.fixture(scope="module")
def tables(survey, errors_by_count):
    """Two runs, of which the second has larger chi2 and other motions."""
    tests = replace(no_tests(), calibrations=calibrations(0.2), zonal=zonal(30.0))
    a = SurveyTables(
        survey.orbits, survey.motions, survey.catalogue, survey.truth, errors_by_count, tests=tests
    )
    orbits = survey.orbits.assign(chi2_per_dof=1.3 * survey.orbits["chi2_per_dof"])
    motions = survey.motions.assign(
        fit_parallax=survey.motions["fit_parallax"] + 0.4 * survey.motions["sigma_parallax"]
    )
    return replace(a, orbits=orbits, motions=motions, other=a)


@pytest.mark.parametrize("figure", comparable_survey_figures(), ids=lambda one: one.name)
def test_every_figure_of_a_run_stands_beside_that_of_the_other(figure, tables):
    both, alone = figure_of_both_runs(figure, tables), figure.plot(replace(tables, other=None))
    assert both.message is None
    assert len(both) == 2 * len(alone)
    half = len(alone)
    for a, b in zip(both.frames[:half], both.frames[half:], strict=True):
        assert (a.x.limits, a.y.limits) == (b.x.limits, b.y.limits)
        assert (a.title[:4], b.title[:4]) == ("(A) ", "(B) ")
    assert plots_of(both)


def test_arrows_of_both_runs_have_one_scale(tables):
    field = tables.tests.zonal
    larger = field.assign(coefficient=5.0 * field["coefficient"], rms=5.0 * field["rms"])
    other = replace(tables.other, tests=replace(tables.other.tests, zonal=larger))
    (figure,) = (one for one in comparable_survey_figures() if one.name == "zonal-errors")
    a, b = figure_of_both_runs(figure, replace(tables, other=other)).frames
    assert a["key text"].columns["text"] == b["key text"].columns["text"]
    np.testing.assert_allclose(largest_arrow(a), 5.0 * largest_arrow(b))
    # Alone, the smaller field is drawn to a scale of its own.
    (alone,) = figure.plot(replace(tables, other=None))
    assert largest_arrow(alone) > 2.0 * largest_arrow(b)


def largest_arrow(frame):
    """Return the largest extent of a stroke; the first stroke of an arrow is its shaft."""
    drawn = frame["arrows"]
    x0, y0, x1, y1 = (drawn.values(name) for name in ("x0", "y0", "x1", "y1"))
    return np.hypot(x1 - x0, y1 - y0).max()


def test_catalogue_that_runs_share_is_not_compared():
    names = [one.name for one in comparable_survey_figures()]
    assert "orbit-health" in names
    assert not {"sky-distribution", "prior-separation", "motion-differences"} & set(names)


def test_without_another_run_there_is_a_message_and_no_figure_in_a_report(tables):
    alone = replace(tables, other=None)
    assert not DIFFERENCES.has_data(alone)
    assert DIFFERENCES.has_data(tables)
    assert "no run to compare" in DIFFERENCES.plot(alone).message
    assert "no run to compare" in figure_of_both_runs(survey_figures()[0], alone).message


def test_run_without_motions_is_told(tables):
    growing = replace(tables, motions=tables.motions.head(0))
    assert "after the last orbit" in DIFFERENCES.plot(growing).message


def test_panels_show_each_parameter_and_the_ratio_of_the_sigmas(tables):
    frames = DIFFERENCES.plot(tables).frames
    assert len(frames) == 6
    parallax, ratio = frames[0], frames[-1]
    assert parallax.title == "Parallax: rms 0.40 σ"
    assert np.allclose(parallax["sources"].values("y"), 0.4)
    assert np.allclose(ratio["sources"].values("y"), 1.0)
    fitted = int(tables.motions["fit_pmra"].notna().sum())
    assert subtitle_of(ratio) == f"{fitted} in both runs, 0 only in A, 0 only in B"
    # Points of one number of orbits are spread within its strip.
    x = parallax["sources"].values("x")
    assert (np.abs(x - parallax["sources"].columns["n_orbits"]) < 0.5).all()


def test_far_outlier_leaves_the_others_their_room(tables):
    motions = tables.motions.copy()
    motions.loc[0, "fit_pmra"] += 1e4 * motions.loc[0, "sigma_pmra"]
    frame = DIFFERENCES.plot(replace(tables, motions=motions))[1]
    assert "1 beyond the frame" in subtitle_of(frame)
    assert max(frame.y.limits) < 1e4


def test_many_sources_are_counted_in_cells(tables):
    table = motion_differences(shared_motions(tables.other.motions, tables.motions))
    many = pd.concat([table] * (ROW_LIMIT // len(table) // 6 + 1), ignore_index=True)
    for frame in plots.plot_motion_differences(many):
        assert "sources" not in frame.names
        (cells,) = frame["counts"].values("image")
        assert np.nansum(cells) == len(many)
        # A column of cells is a number of orbits.
        (x,), (dw,) = frame["counts"].values("x"), frame["counts"].values("dw")
        assert (x % 1.0, dw) == (0.5, cells.shape[1])
    assert plots_of(plots.plot_motion_differences(many))
