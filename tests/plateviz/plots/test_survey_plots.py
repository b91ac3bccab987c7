"""Contents of the plots of a survey and of its sources."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from plateviz import plots, tables
from plateviz.plots.elements.style import ROW_LIMIT
from plateviz.plots.gallery import diagnostics, source_figures, survey_figures
from plateviz.tables.labels import short_id
from plateviz.tables.run_diagnosis import no_tests
from plateviz.tables.survey_tables import SourceTables, SurveyTables
from tests.plateviz.plots.drawn import plots_of, subtitle_of
from tests.plateviz.run_tables import calibrations, zonal


@pytest.mark.parametrize("name", ["reference_scatter", "sky_track", "time_series"])
def test_points_of_a_source_carry_its_id(figures, name):
    marked = [g for frame in figures(name) for g in frame.glyphs if "id" in g.columns]
    assert marked
    assert all(glyphs.kind == "points" and len(glyphs) for glyphs in marked)


@pytest.mark.parametrize("name", ["sky_track", "time_series"])
def test_points_of_an_orbit_carry_its_whole_number(figures, survey, name):
    known = {str(orbit) for orbit in survey.orbits["orbit_id"]}
    for frame in figures(name):
        orbits = frame["estimates"].columns["orbit_id"]
        assert len(orbits) > 0
        assert {str(orbit) for orbit in orbits} <= known


def test_longitude_increases_to_the_left(figures, drawings):
    for frame in figures("sky_distribution"):
        assert frame.x.limits[0] > frame.x.limits[1]
    draw, table = drawings["sky_distribution"]
    for plot in plots_of(draw(table)):
        assert plot.x_range.start > plot.x_range.end


def test_classes_share_one_view_of_the_sky(drawings):
    draw, table = drawings["sky_distribution"]
    panels = plots_of(draw(table))
    assert len(panels) == 3
    assert len({id(panel.x_range) for panel in panels}) == 1
    assert len({id(panel.y_range) for panel in panels}) == 1


def test_fields_and_target_are_drawn_above_the_sources(figures):
    for frame in figures("sky_distribution"):
        assert frame.names == ["sources", "area", "target"]
        (x,), (y,) = frame["area"].values("xs"), frame["area"].values("ys")
        assert (min(x), max(x), min(y), max(y)) == (-1.4, 0.7, -0.6, 0.6)
        assert [*frame["target"].values("x"), *frame["target"].values("y")] == [-0.3, 0.1]


def test_right_ascension_increases_to_the_left_in_a_square(figures):
    (frame,) = figures("sky_track")
    assert frame.x.limits[0] > frame.x.limits[1]
    assert frame.width == frame.frame_height


def test_crowded_class_is_drawn_as_a_density(drawings):
    draw, table = drawings["sky_distribution"]
    crowd = pd.concat([table] * 20, ignore_index=True)
    _, artificial, other = ({g.kind for g in frame.glyphs} for frame in draw(crowd))
    assert "image" in other
    assert "image" not in artificial


def test_density_covers_its_sources_with_cells_of_the_stated_values(drawings):
    draw, table = drawings["sky_distribution"]
    rows = pd.concat([table[table["source_class"] == "non-reference"]] * 20, ignore_index=True)
    density = draw(rows)[0]["density"]
    (x,), (y,), (dw,), (dh,) = (density.values(name) for name in ("x", "y", "dw", "dh"))
    for start, length, column in ((x, dw, "l_deg"), (y, dh, "b_deg")):
        ends = [rows[column].min(), rows[column].max()]
        assert [start, start + length] == pytest.approx(ends)
    (cells,) = density.values("image")
    area = dw * dh * 60.0**2 / cells.size
    # Cells are smaller by the cosine of the latitude, here within a degree of zero.
    assert np.nansum(cells) * area == pytest.approx(len(rows), rel=1e-3)
    assert density.looks["color"].limits == (0.0, np.nanmax(cells))


def test_prior_separation_uses_a_suitable_unit(figures):
    other, reference = figures("prior_separation")
    assert "(µas)" in reference.x.label
    assert "(mas)" in other.x.label
    assert "12 of them artificial" in subtitle_of(other)


def test_few_orbits_have_a_tick_each_and_none_between(survey):
    few = survey.motions.assign(n_orbits=np.arange(len(survey.motions)) % 3 + 1)
    (frame,) = plots.plot_orbit_counts(tables.orbit_counts(few))
    assert [label for _, label in frame.x.ticks] == ["1", "2", "3"]


def test_orbit_counts_have_logarithmic_counts_from_below_one(figures):
    (frame,) = figures("orbit_counts")
    assert frame.y.is_log
    assert 0.1 < frame.y.limits[0] < 1.0


def test_law_of_the_paper_falls_with_the_square_root_of_n(figures):
    (frame,) = figures("error_by_count")
    law = frame["law"]
    assert law.label == "4 mas / √(36 N)"
    assert law.values("y") * np.sqrt(36 * law.values("x")) == pytest.approx(4.0)


def test_prediction_is_drawn_with_its_floor(figures):
    (frame,) = figures("error_by_count")
    prediction, floor = frame["prediction"], frame["floor"]
    assert [prediction.label, floor.label] == ["√(noise² / N + floor²)", "floor: references"]
    expected = np.sqrt(0.66**2 / prediction.values("x") + 0.055**2)
    assert prediction.values("y") == pytest.approx(expected)
    assert set(floor.values("y")) == {0.055}


def test_labels_of_log_ticks_are_the_ticks(figures):
    (frame,) = figures("error_by_count")
    shown = dict(frame.x.ticks)
    assert shown[30.0] == "30"
    assert shown[60.0] == "60"


@pytest.mark.parametrize(
    ("copies", "is_dense"), [(1, False), (ROW_LIMIT // 20, True)], ids=["few", "many"]
)
def test_many_reference_sources_are_counted_in_cells(drawings, copies, is_dense):
    draw, table = drawings["reference_scatter"]
    frame = draw(pd.concat([table] * copies, ignore_index=True))[0]
    assert any(glyphs.kind == "rectangles" for glyphs in frame.glyphs) == is_dense


def test_reference_scatter_without_truth_has_no_panel_of_deviations(drawings):
    draw, table = drawings["reference_scatter"]
    assert len(draw(table)) == 3
    assert len(draw(table.assign(pull=np.nan))) == 2


def test_pulls_are_drawn_against_a_unit_normal_of_the_same_area(drawings):
    draw, table = drawings["motion_pulls"]
    normal = draw(table)[0]["unit normal"]
    first = table.iloc[0]
    area = np.trapezoid(normal.values("y"), normal.values("x"))
    assert area == pytest.approx(first["n"] * (first["right"] - first["left"]), rel=1e-3)


def test_pulls_state_their_standard_deviation(figures, drawings):
    _, table = drawings["motion_pulls"]
    stated = {subtitle_of(frame).split(",")[0] for frame in figures("motion_pulls")}
    assert stated == {f"sd {sd:.3f}" for sd in table["sd"]}


def test_failed_orbits_are_marked(drawings, survey):
    draw, table = drawings["orbit_health"]
    frame = draw(table)[0]
    marked = frame["failed"]
    assert marked.label.startswith("failed")
    assert (
        marked.columns["orbit_id"].tolist()
        == survey.orbits.query("status == 'failed'")["orbit_id"].tolist()
    )


@pytest.mark.parametrize(("largest", "starts_at_zero"), [(1.4, False), (4.0, True)])
def test_axis_of_chi2_is_not_negative_and_contains_failed_orbits(drawings, largest, starts_at_zero):
    draw, table = drawings["orbit_health"]
    chi2 = table["chi2_per_dof"]
    frame = draw(table.assign(chi2_per_dof=chi2.where(chi2 < chi2.max(), largest)))[0]
    low, high = frame.y.limits
    assert (low == 0.0) == starts_at_zero
    assert starts_at_zero or 1.0 - low == pytest.approx(high - 1.0)
    for name in ("failed", "orbits"):
        heights = frame[name].values("y")
        assert len(heights) > 0
        assert np.all((low < heights) & (heights < high))


def test_orbits_are_linked_in_time(drawings):
    draw, table = drawings["orbit_health"]
    first, second = plots_of(draw(table))
    assert first.x_range is second.x_range
    assert first.y_range is not second.y_range


def test_time_series_is_linked_in_time_only(drawings):
    draw, table = drawings["time_series"]
    panels = plots_of(draw(table))
    assert len(panels) == 4
    assert len({id(panel.x_range) for panel in panels}) == 1
    assert len({id(panel.y_range) for panel in panels}) == 4


def test_time_series_without_a_fit_has_no_residuals(survey):
    history, _ = survey.source("reference")
    assert len(plots.plot_time_series(tables.time_series(history, None))) == 2


@pytest.mark.parametrize("kind", ["reference", "artificial", "other"])
def test_sky_track_states_each_rms_by_name(survey, kind):
    history, motion = survey.source(kind)
    (frame,) = plots.plot_sky_track(tables.sky_track(history, motion))
    assert str(motion["source_id"]) in frame.title
    assert f"{motion['n_orbits']} orbits" in subtitle_of(frame)
    assert all(word in subtitle_of(frame) for word in ("(α)", "(δ)", "(2-D)"))
    assert ("catalogue left out" in subtitle_of(frame)) == (kind != "reference")


def test_sky_track_draws_error_bars_of_one_sigma(survey):
    table = tables.sky_track(*survey.source("artificial"))
    (frame,) = plots.plot_sky_track(table)
    across, along = (glyphs for glyphs in frame.glyphs if glyphs.kind == "segments")
    orbits = table[table["kind"] == "orbit"]
    assert 0.5 * (across.values("x1") - across.values("x0")) == pytest.approx(
        orbits["sigma_ra_mas"].to_numpy()
    )
    assert 0.5 * (along.values("y1") - along.values("y0")) == pytest.approx(
        orbits["sigma_dec_mas"].to_numpy()
    )


@pytest.mark.parametrize("number", [-1, -2], ids=["one orbit", "few orbits"])
def test_source_of_few_orbits_is_drawn(survey, number):
    source = survey.source("other", number)
    for figure in source_figures():
        drawn = figure.plot(SourceTables(*source))
        assert drawn.message is None
        assert plots_of(drawn)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_gallery_draws_every_figure_of_a_survey(survey, errors_by_count, theme):
    tests = replace(no_tests(), calibrations=calibrations(0.2), zonal=zonal(30.0))
    full = SurveyTables(
        survey.orbits, survey.motions, survey.catalogue, survey.truth, errors_by_count, tests=tests
    )
    full = replace(full, other=full)
    bare = SurveyTables(survey.orbits, survey.motions.head(0), survey.catalogue)
    for figure in survey_figures():
        assert figure.plot(full).message is None
        assert plots_of(figure.plot(full), theme)
        assert plots_of(figure.plot(bare), theme)


def test_gallery_separates_the_pages_and_sorts_their_figures():
    pages = (diagnostics, survey_figures, source_figures)
    positions = [[f.position for f in page()] for page in pages]
    assert [len(page) > 1 for page in positions] == [True, True, True]
    assert all(page == sorted(page) for page in positions)
    names = [f.name for page in pages for f in page()]
    assert len(names) == len(set(names))


def test_long_id_is_short_in_a_narrow_title_and_whole_in_the_hover():
    assert short_id("4040356967235058635") == "…058635"
    assert short_id("1234567890") == "1234567890"


@pytest.mark.parametrize(
    ("unit", "factor", "shown", "limit"),
    [("µm", 1e-5, "pm", 50.0), ("µm", 1.0, "µm", 5.0), ("deg", 1e-4, "arcsec", 2.0)],
)
def test_trends_are_in_units_that_suit_their_values(drawings, unit, factor, shown, limit):
    draw, table = drawings["calibration_trends"]
    parts = ("offset", "trend", "change", "scatter")
    scaled = table.assign(unit=unit, **{name: factor * table[name] for name in parts})
    (frame,) = draw(scaled)
    assert frame.y.label == f"value minus mean ({shown})"
    assert max(frame.y.limits) == pytest.approx(limit, rel=0.3)
    assert f"{shown}\n" in frame.subtitle
    assert set(frame["angle of the first orbit"].columns["unit"]) == {shown}


@pytest.mark.parametrize(("chi2", "words"), [(30.0, "12 ± 5: rms 400 µas"), (20.0, "as by chance")])
def test_smooth_errors_have_a_size_if_chance_does_not_explain_them(chi2, words):
    (frame,) = plots.plot_zonal_errors(zonal(chi2))
    assert f"χ² {chi2:.0f}, expected 12 ± 5" in subtitle_of(frame)
    assert words in subtitle_of(frame)
    assert len(frame["tails"]) == len(tables.zonal_errors(zonal(chi2)))
    assert frame.x.limits[0] > frame.x.limits[1]


def test_smooth_errors_that_are_not_tested_say_when_they_are():
    figure = plots.plot_zonal_errors(zonal(30.0).head(0))
    assert "eight or more orbits" in figure.message


@pytest.mark.parametrize(
    ("draw", "table", "what"),
    [
        (plots.plot_motion_pulls, pd.DataFrame(), "parallax and proper motion over σ"),
        (plots.plot_calibration_trends, pd.DataFrame(), "what changes most from orbit to orbit"),
        (
            plots.plot_reference_scatter,
            pd.DataFrame({"scatter_mas": [], "expected_mas": []}),
            "of each between orbits",
        ),
    ],
)
def test_an_empty_card_says_what_it_will_show_and_from_when(draw, table, what):
    message = draw(table).message
    assert what in message
    assert "orbits or more" in message
