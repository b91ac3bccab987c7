"""Contents of the plots of a survey and of its sources."""

import holoviews as hv
import numpy as np
import pandas as pd
import pytest

from plateviz import plots, tables
from plateviz.plots.gallery import diagnostics, source_figures, survey_figures
from plateviz.plots.style import ROW_LIMIT
from plateviz.tables.survey_tables import SourceTables, SurveyTables
from tests.plateviz.plots.drawn import figures_of, sources_of, subtitle_of


@pytest.mark.parametrize("name", ["reference_scatter", "sky_track", "time_series"])
def test_points_of_a_source_carry_its_id(figures, name):
    marked = [s for figure in figures(name) for s in sources_of(figure) if "id" in s.data]
    assert marked


def test_longitude_increases_to_the_left(figures):
    for figure in figures("sky_distribution"):
        assert figure.x_range.start > figure.x_range.end


def test_right_ascension_increases_to_the_left_in_a_square(figures):
    (figure,) = figures("sky_track")
    assert figure.x_range.start > figure.x_range.end
    assert figure.frame_width == figure.frame_height


def test_crowded_class_is_drawn_as_a_density(drawings):
    draw, table = drawings["sky_distribution"]
    crowd = pd.concat([table] * 20, ignore_index=True)
    _, artificial, other = ({type(element) for element in panel} for panel in draw(crowd))
    assert hv.Image in other
    assert hv.Image not in artificial


def test_prior_separation_uses_a_suitable_unit(figures):
    other, reference = figures("prior_separation")
    assert "(µas)" in reference.xaxis.axis_label
    assert "(mas)" in other.xaxis.axis_label
    assert "12 of them artificial" in subtitle_of(other)


def test_orbit_counts_have_logarithmic_counts_from_below_one(figures):
    (figure,) = figures("orbit_counts")
    assert type(figure.y_scale).__name__ == "LogScale"
    assert 0.1 < figure.y_range.start < 1.0


def test_law_of_the_paper_falls_with_the_square_root_of_n(drawings):
    draw, table = drawings["error_by_count"]
    law = next(e for e in draw(table) if e.label == "4 mas / √(36 N)").dframe()
    assert (law["error_mas"] * np.sqrt(36 * law["n_orbits"])).to_numpy() == pytest.approx(4.0)


def test_prediction_is_drawn_with_its_floor(drawings):
    draw, table = drawings["error_by_count"]
    curves = {e.label: e.dframe() for e in draw(table) if isinstance(e, hv.Curve)}
    prediction = curves["√(noise² / N + floor²)"]
    expected = np.sqrt(0.66**2 / prediction["n_orbits"] + 0.055**2)
    assert prediction["error_mas"].to_numpy() == pytest.approx(expected.to_numpy())
    assert set(curves["floor: references"]["error_mas"]) == {0.055}


def test_labels_of_log_ticks_are_the_ticks(figures):
    (figure,) = figures("error_by_count")
    shown = {float(k): v for k, v in figure.xaxis[0].major_label_overrides.items()}
    assert shown[30.0] == "30"
    assert shown[60.0] == "60"


@pytest.mark.parametrize(
    ("copies", "is_dense"), [(1, False), (ROW_LIMIT // 20, True)], ids=["few", "many"]
)
def test_many_reference_sources_are_counted_in_cells(drawings, copies, is_dense):
    draw, table = drawings["reference_scatter"]
    panel = next(iter(draw(pd.concat([table] * copies, ignore_index=True))))
    assert any(isinstance(element, hv.Rectangles) for element in panel) == is_dense


def test_reference_scatter_without_truth_has_no_panel_of_deviations(drawings):
    draw, table = drawings["reference_scatter"]
    assert len(draw(table)) == 3
    assert len(draw(table.assign(pull=np.nan))) == 2


def test_pulls_are_drawn_against_a_unit_normal_of_the_same_area(drawings):
    draw, table = drawings["motion_pulls"]
    normal = next(e for e in next(iter(draw(table))) if e.label == "unit normal").dframe()
    first = table.iloc[0]
    area = np.trapezoid(normal["count"], normal["x"])
    assert area == pytest.approx(first["n"] * (first["right"] - first["left"]), rel=1e-3)


def test_pulls_state_their_standard_deviation(figures, drawings):
    _, table = drawings["motion_pulls"]
    stated = {subtitle_of(figure).split(",")[0] for figure in figures("motion_pulls")}
    assert stated == {f"sd {sd:.3f}" for sd in table["sd"]}


def test_failed_orbits_are_marked(drawings, survey):
    draw, table = drawings["orbit_health"]
    panel = next(iter(draw(table)))
    marked = next(e for e in panel if e.label.startswith("failed"))
    assert (
        marked["orbit_id"].tolist()
        == survey.orbits.query("status == 'failed'")["orbit_id"].tolist()
    )


def test_orbits_are_linked_in_time(figures):
    first, second = figures("orbit_health")
    assert first.x_range is second.x_range
    assert first.y_range is not second.y_range


def test_time_series_is_linked_in_time_only(figures):
    panels = figures("time_series")
    assert len(panels) == 4
    assert len({id(panel.x_range) for panel in panels}) == 1
    assert len({id(panel.y_range) for panel in panels}) == 4


def test_time_series_without_a_fit_has_no_residuals(survey):
    history, _ = survey.source("reference")
    assert len(plots.plot_time_series(tables.time_series(history, None))) == 2


@pytest.mark.parametrize("kind", ["reference", "artificial", "other"])
def test_sky_track_states_each_rms_by_name(survey, kind):
    history, motion = survey.source(kind)
    (figure,) = figures_of(plots.plot_sky_track(tables.sky_track(history, motion)))
    assert str(motion["source_id"]) in figure.title.text
    assert f"{motion['n_orbits']} orbits" in subtitle_of(figure)
    assert all(word in subtitle_of(figure) for word in ("(α)", "(δ)", "(2-D)"))
    assert ("catalogue left out" in subtitle_of(figure)) == (kind != "reference")


def test_sky_track_draws_error_bars_of_one_sigma(survey):
    table = tables.sky_track(*survey.source("artificial"))
    across, along = (e.dframe() for e in plots.plot_sky_track(table) if isinstance(e, hv.Segments))
    orbits = table[table["kind"] == "orbit"]
    assert 0.5 * (across["x1"] - across["x0"]).to_numpy() == pytest.approx(
        orbits["sigma_ra_mas"].to_numpy()
    )
    assert 0.5 * (along["y1"] - along["y0"]).to_numpy() == pytest.approx(
        orbits["sigma_dec_mas"].to_numpy()
    )


@pytest.mark.parametrize("number", [-1, -2], ids=["one orbit", "few orbits"])
def test_source_of_few_orbits_is_drawn(survey, number):
    source = survey.source("other", number)
    for figure in source_figures():
        assert figures_of(figure.draw(SourceTables(*source), "light"))


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_gallery_draws_every_figure_of_a_survey(survey, errors_by_count, theme):
    full = SurveyTables(
        survey.orbits, survey.motions, survey.catalogue, survey.truth, errors_by_count
    )
    bare = SurveyTables(survey.orbits, survey.motions.head(0), survey.catalogue)
    for figure in survey_figures():
        assert figures_of(figure.draw(full, theme))
        assert figures_of(figure.draw(bare, theme))


def test_gallery_separates_the_pages_and_sorts_their_figures():
    orders = [[f.order for f in page()] for page in (diagnostics, survey_figures, source_figures)]
    assert [len(page) > 1 for page in orders] == [True, True, True]
    assert all(page == sorted(page) for page in orders)
    names = [f.name for page in (diagnostics, survey_figures, source_figures) for f in page()]
    assert len(names) == len(set(names))
