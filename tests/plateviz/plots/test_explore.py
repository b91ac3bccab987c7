"""Any column against any other: what is drawn of how many rows, and between which limits."""

import numpy as np
import pandas as pd
import pytest

from plateviz.figures.figure import Ramp
from plateviz.plots.elements.style import ROW_LIMIT, SERIES_COLOURS
from plateviz.plots.explore.explore import explored_figure
from plateviz.plots.explore.explored_rows import ExploredColumns
from plateviz.tables.explore import EXPLORABLE, ExplorableTable, explorable
from solver.data import schema
from solver.data.columns import Column


def table_of(**columns):
    size = len(next(iter(columns.values())))
    named = {name: Column(name, "float64", "mas", f"meaning of {name}") for name in columns}
    values = {"source_id": np.arange(size), **columns}
    return ExplorableTable("stars", size, named, values.__getitem__, True, False)


@pytest.fixture(scope="module")
def many():
    random = np.random.default_rng(1)
    size = ROW_LIMIT + 5_000
    return table_of(x=random.uniform(1.0, 9.0, size), y=random.normal(5.0, 1.0, size))


def test_few_rows_are_points_with_the_ids_of_their_sources(fit_result):
    table = EXPLORABLE["sources"](fit_result)
    (frame,) = explored_figure(table, ExploredColumns("n_obs", "sigma_ra_marginal"))
    marks = frame["rows by class"]
    np.testing.assert_array_equal(marks.values("x"), table.numbers("n_obs"))
    assert marks.columns["id"].tolist() == [str(one) for one in table.read("source_id")]
    assert "mas" in frame.y.label
    assert frame.subtitle == f"{table.size:,} sources"


@pytest.mark.parametrize("name", EXPLORABLE)
@pytest.mark.parametrize("switch", [False, True])
def test_every_column_can_be_drawn_against_every_other(name, switch, fit_result):
    table = EXPLORABLE[name](fit_result)
    names = list(table.columns)
    for x, y in zip(names, names[1:] + names[:1], strict=True):
        chosen = ExploredColumns(
            x, y, colour=y, is_log_x=switch, is_log_y=switch, has_median=switch
        )
        figure = explored_figure(table, chosen)
        assert figure.message is not None or len(figure[0].glyphs) > 2


def test_many_rows_are_counted_in_cells(many):
    (frame,) = explored_figure(many, ExploredColumns("x", "y"))
    cells = frame["cells by number"].values("image")[0]
    assert np.nansum(cells) == many.size
    assert frame.subtitle == f"{many.size:,} stars"
    assert ("stars per cell", "@count{0,0}") in frame["cells by number"].hover


def test_numbers_have_the_units_of_their_columns(many, fit_result):
    (frame,) = explored_figure(many, ExploredColumns("x", "y", colour="x", has_median=True))
    cells = frame["cells by value"]
    assert ("x", "$x{0.0000} mas") in cells.hover
    assert ("mean x per cell", "@{value}{0.0000} mas") in cells.hover
    assert cells.looks["color"].label == "mean x per cell (mas)"
    assert frame.subtitle.endswith(" mas")
    table = EXPLORABLE["sources"](fit_result)
    (frame,) = explored_figure(table, ExploredColumns("n_obs", "sigma_ra_marginal", colour="chi2"))
    marks = frame["rows by value"]
    assert ("n_obs", "@{x}{0}") in marks.hover
    assert ("sigma_ra_marginal", "@{y}{0.0000} mas") in marks.hover
    assert [look.label for look in marks.looks.values() if isinstance(look, Ramp)][0] == "chi2"


def test_zoom_counts_what_is_between_the_limits(many):
    limits = ((1.1, 9.0), (2.0, 8.0))
    (frame,) = explored_figure(many, ExploredColumns("x", "y", limits=limits))
    x, y = many.numbers("x"), many.numbers("y")
    expected = np.sum((x >= 1.1) & (x < 9.0) & (y >= 2.0) & (y < 8.0))
    assert np.nansum(frame["cells by number"].values("image")[0]) == expected
    assert frame.subtitle == f"{many.size:,} stars; {expected:,} in the frame"
    assert (frame.x.limits, frame.y.limits) == limits


def test_zoom_on_few_rows_shows_these_as_points(many):
    limits = ((2.0, 3.0), (4.0, 6.0))
    (frame,) = explored_figure(many, ExploredColumns("x", "y", limits=limits))
    x, y = many.numbers("x"), many.numbers("y")
    expected = np.flatnonzero((x >= 2.0) & (x <= 3.0) & (y >= 4.0) & (y <= 6.0))
    assert frame["rows"].columns["id"].tolist() == list(map(str, expected))
    assert frame.subtitle == f"{many.size:,} stars; {len(expected):,} in the frame"


@pytest.mark.parametrize("is_log", [False, True])
def test_zoom_out_ends_near_the_rows(many, is_log):
    limits = ((1e-300 if is_log else -1e17, 1e17), (-4e14, 4e14))
    (frame,) = explored_figure(many, ExploredColumns("x", "y", is_log_x=is_log, limits=limits))
    (whole,) = explored_figure(many, ExploredColumns("x", "y", is_log_x=is_log))
    assert frame.y.length == pytest.approx(11.0 * whole.y.length)
    (low, high), (first, last) = (
        np.log10([frame.x.limits, whole.x.limits])
        if is_log
        else (
            frame.x.limits,
            whole.x.limits,
        )
    )
    assert high - low == pytest.approx(11.0 * (last - first))
    beside = ((1e9, 2e9), (4.0, 6.0))
    (frame,) = explored_figure(many, ExploredColumns("x", "y", limits=beside))
    assert frame.x.limits[1] < 1e3


def test_zoom_beside_all_rows_is_an_empty_frame(many):
    (frame,) = explored_figure(many, ExploredColumns("x", "y", limits=((50.0, 60.0), (4.0, 6.0))))
    assert len(frame["rows"]) == 0
    assert frame.subtitle.endswith("; 0 in the frame")


@pytest.mark.parametrize("limits", [((1.0, 1.0), (2.0, 3.0)), ((-1.0, 2.0), (2.0, 3.0))])
def test_limits_that_an_axis_cannot_have_are_replaced(many, limits):
    (frame,) = explored_figure(many, ExploredColumns("x", "y", is_log_x=True, limits=limits))
    low, high = frame.x.limits
    assert 0.0 < low < 1.1
    assert high > 8.9
    assert frame.y.limits == limits[1]


def test_cells_show_the_mean_of_the_column_that_gives_the_colour(many):
    (frame,) = explored_figure(many, ExploredColumns("x", "y", colour="x"))
    means = frame["cells by value"].values("image")[0]
    edges = np.linspace(*frame.x.limits, means.shape[1] + 1)
    is_filled = np.isfinite(means)
    assert is_filled.sum() > 1000
    assert np.all((means >= edges[:-1])[is_filled])
    assert np.all((means <= edges[1:])[is_filled])


def test_cells_show_the_most_frequent_detector_and_no_mean_of_ids():
    size = ROW_LIMIT + 5_000
    # At the same place, detector 1 twice as often as detector 5, and detector 3 elsewhere.
    place = np.repeat([1.0, 2.0], [size - 100, 100])
    detectors = np.where(place == 2.0, 3, np.where(np.arange(size) % 3, 1, 5))
    rows = pd.DataFrame({"detector_id": detectors, "nx": place})
    table = explorable("measurements", rows, schema.RESIDUALS)
    (frame,) = explored_figure(table, ExploredColumns("nx", "nx", colour="detector_id"))
    drawn = frame["cells by name"]
    found = drawn.values("image")[0]
    assert sorted(found[np.isfinite(found)].tolist()) == [1.0, 3.0]
    ramp = drawn.looks["color"]
    assert (ramp.limits, ramp.label) == ((0.5, 5.5), "most frequent detector per cell")
    # A colour for each whole number, among them those of points of the same detectors.
    assert [ramp.palette[n] for n in (0, 2, 4)] == list(SERIES_COLOURS[:3])


def test_cells_count_no_more_names_than_can_be_told_apart():
    rows = pd.DataFrame({"field_id": np.arange(ROW_LIMIT + 5_000) % 800, "nx": 1.0})
    table = explorable("measurements", rows, schema.RESIDUALS)
    (frame,) = explored_figure(table, ExploredColumns("nx", "nx", colour="field_id"))
    assert "cells by value" in [drawn.name for drawn in frame.glyphs]


def test_zoom_does_not_change_the_colour_of_a_detector():
    keys = {"field_id": 0, "plate_id": 1, "detector_id": [0, 1, 2]}
    rows = pd.DataFrame({**keys, "nx": [1.0, 2.0, 3.0]})
    table = explorable("measurements", rows, schema.RESIDUALS)
    chosen = ExploredColumns("nx", "nx", colour="detector_id", only="nx", lowest=2.5)
    (frame,) = explored_figure(table, chosen)
    colours = frame["rows by detector"].looks["fill_color"].looks
    assert colours["detector 2"] == SERIES_COLOURS[2]


def test_selected_sources_are_marked_among_cells(many):
    (frame,) = explored_figure(many, ExploredColumns("x", "y"), selected=frozenset([3, 5, -1]))
    marks = frame["selected sources"]
    assert marks.columns["source"].tolist() == ["3", "5"]
    assert "id" not in marks.columns
    assert marks.values("x").tolist() == many.numbers("x")[[3, 5]].tolist()


def test_selected_rows_that_are_too_many_are_counted(many):
    (frame,) = explored_figure(
        many, ExploredColumns("x", "y"), selected=frozenset(range(ROW_LIMIT + 1))
    )
    assert "selected sources" not in frame.names
    assert frame.subtitle.endswith(
        f"; {ROW_LIMIT + 1:,} of selected sources, too many to be marked"
    )


def test_words_of_rows_are_shown_by_a_hover_and_kept_for_a_tap():
    table = table_of(x=np.arange(3.0), y=np.ones(3))._replace(
        has_sources=False, words={"orbit_id": np.array(["4", "5", "6"]).__getitem__}, note="of some"
    )
    (frame,) = explored_figure(table, ExploredColumns("x", "y"))
    assert frame["rows"].columns["orbit_id"].tolist() == ["4", "5", "6"]
    assert ("orbit_id", "@{orbit_id}") in frame["rows"].hover
    assert frame.subtitle == "3 stars; of some"


def test_rows_are_limited_by_a_column():
    table = table_of(x=np.arange(10.0), y=np.ones(10), z=np.arange(10.0))
    chosen = ExploredColumns("x", "y", only="z", lowest=2.0, highest=5.0)
    (frame,) = explored_figure(table, chosen)
    assert frame["rows"].values("x").tolist() == [2.0, 3.0, 4.0, 5.0]
    assert frame.subtitle == "4 of 10 stars; 6 not between the limits of z"


def test_rows_without_a_value_are_counted():
    table = table_of(x=np.array([1.0, np.nan, -1.0, 2.0]), y=np.ones(4))
    (frame,) = explored_figure(table, ExploredColumns("x", "y", is_log_x=True))
    assert frame["rows"].values("x").tolist() == [1.0, 2.0]
    assert frame.subtitle == "2 of 4 stars; 2 without a positive value on these axes"


def test_nothing_to_draw_is_said():
    table = table_of(x=np.full(3, np.nan), y=np.ones(3))
    assert explored_figure(table, ExploredColumns("x", "y")).message == "No stars to draw"


def test_unknown_column_is_refused():
    with pytest.raises(KeyError, match="nothing"):
        explored_figure(table_of(x=np.ones(3)), ExploredColumns("x", "nothing"))


def test_right_ascension_increases_to_the_left(fit_result):
    (frame,) = explored_figure(EXPLORABLE["sources"](fit_result), ExploredColumns("ra", "dec"))
    assert frame.x.limits[0] > frame.x.limits[1]
    assert frame.y.limits[0] < frame.y.limits[1]
    heights = frame["histogram of y"].columns["left"], frame["histogram of y"].columns["right"]
    assert np.all(heights[1] <= heights[0])


def test_histograms_have_all_rows_and_reach_a_tenth_of_the_frame():
    values = np.array([1.0, 1.0, 2.0, 8.0])
    (frame,) = explored_figure(table_of(x=values, y=values[::-1].copy()), ExploredColumns("x", "y"))
    bars = frame["histogram of x"]
    reach = (bars.columns["top"] - frame.y.limits[0]) / frame.y.length
    assert reach.max() == pytest.approx(0.1)
    assert reach.sum() == pytest.approx(0.2)
    assert len(bars.columns["left"]) == len(bars.columns["right"])


def test_median_and_its_range_follow_the_data():
    random = np.random.default_rng(2)
    x = random.uniform(0.0, 10.0, 6_000)
    y = 3.0 * x + random.normal(0.0, 0.5, 6_000)
    (frame,) = explored_figure(table_of(x=x, y=y), ExploredColumns("x", "y", has_median=True))
    median = frame["median"]
    # A bin is a third wide, over which y rises by one.
    np.testing.assert_allclose(median.values("y"), 3.0 * median.values("x"), atol=0.6)
    half = 0.5 * (frame["16 to 84 %"].values("y2") - frame["16 to 84 %"].values("y1"))
    assert 0.4 < np.median(half) < 0.75


def test_median_stands_out_from_cells_and_is_said_in_numbers(many):
    (frame,) = explored_figure(many, ExploredColumns("x", "y", has_median=True))
    names = [glyphs.name for glyphs in frame.glyphs]
    assert names.index("cells by number") < names.index("edge of the median")
    assert names[-2:] == ["edge of the median", "median"]
    edge, median = (frame[name].looks["line_width"] for name in names[-2:])
    assert edge > 2.0 * median
    assert frame["edge of the median"].looks["line_color"] == "background"
    low, high = frame["median"].values("y").min(), frame["median"].values("y").max()
    assert f"medians from {low:.3g} to {high:.3g}" in frame.subtitle


def test_detectors_have_a_colour_each_and_a_legend():
    detectors, nx = [2, 0, 2, 5], [1.0, 2.0, 3.0, 4.0]
    rows = pd.DataFrame({"field_id": 0, "plate_id": 1, "detector_id": detectors, "nx": nx})
    table = explorable("measurements", rows, schema.RESIDUALS)
    (frame,) = explored_figure(table, ExploredColumns("nx", "nx", colour="detector_id"))
    drawn = frame["rows by detector"]
    assert drawn.labels == {"detector 0", "detector 2", "detector 5"}
    colours = drawn.looks["fill_color"]
    assert len(set(colours.looks.values())) == 3
    assert drawn.columns["colour"].tolist() == [f"detector {n}" for n in (0, 2, 2, 5)]
