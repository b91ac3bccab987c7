"""Rows that a figure shows: their extent, their cells, and the sources in an area."""

import numpy as np
import pytest

from plateviz.figures.figure import Axis
from plateviz.plots.elements.cells import Counts, edges_of
from plateviz.plots.explore import explored_rows
from plateviz.plots.explore.explored_rows import (
    ExploredColumns,
    counts_in_frame,
    extent_of,
    items_within,
    rows_in_frame,
)
from plateviz.tables.explore import ExplorableTable
from solver.data.columns import Column

UNIT = Axis("", (0.0, 1.0))


@pytest.fixture(autouse=True)
def small_parts(monkeypatch):
    """Look at the rows in parts of seven, so that the last one is shorter."""
    monkeypatch.setattr(explored_rows, "_PART", 7)


def table_of(ids=None, **columns):
    size = len(next(iter(columns.values())))
    named = {name: Column(name, "float64", "", "") for name in columns}
    values = {"source_id": np.arange(size) if ids is None else np.array(ids), **columns}
    return ExplorableTable("rows", size, named, values.__getitem__, True, False)


@pytest.fixture(params=[np.float32, np.float64])
def table(request):
    random = np.random.default_rng(4)
    columns = {name: random.normal(0.5, 0.4, 60).astype(request.param) for name in ("x", "y", "z")}
    columns["x"][3] = columns["y"][20] = columns["z"][50] = np.nan
    columns["y"][40] = np.inf
    return table_of(**columns)


def counted(table, chosen, x=UNIT, y=UNIT):
    return counts_in_frame(table, chosen, x, y)


@pytest.mark.parametrize("is_log", [False, True])
@pytest.mark.parametrize("only", ["", "z"])
def test_extent_is_that_of_the_rows_that_can_be_drawn(table, is_log, only):
    chosen = ExploredColumns("x", "y", only=only, lowest=0.3, is_log_x=is_log)
    found = extent_of(table, chosen)
    x, y, z = (table.numbers(name) for name in "xyz")
    is_kept = z >= 0.3 if only else np.ones(60, dtype=bool)
    is_drawn = is_kept & np.isfinite(x) & np.isfinite(y) & ((x > 0) | (not is_log))
    assert (found.n_shown, found.n_left_out) == (is_drawn.sum(), (~is_kept).sum())
    assert found.x == (x[is_drawn].min(), x[is_drawn].max())
    assert found.y == (y[is_drawn].min(), y[is_drawn].max())
    if only:
        assert found.only == (np.nanmin(z), np.nanmax(z))
    assert np.isnan(found.only[0]) == (only == "")


def test_extent_without_a_row_is_not_a_number():
    found = extent_of(table_of(x=np.full(9, np.nan), y=np.ones(9)), ExploredColumns("x", "y"))
    assert found.n_shown == 0
    assert np.isnan([*found.x, *found.y]).all()


def test_each_row_is_counted_in_its_cell(table):
    image = counted(table, ExploredColumns("x", "y", only="z", lowest=0.3)).image()
    x, y, z = (table.numbers(name) for name in "xyz")
    height, width = image.shape
    expected = np.zeros((height, width))
    for one in np.flatnonzero((z >= 0.3) & (x >= 0) & (x < 1) & (y >= 0) & (y < 1)):
        expected[int(y[one] * height), int(x[one] * width)] += 1
    np.testing.assert_array_equal(np.nan_to_num(image), expected)


def test_histograms_count_what_is_in_the_frame(table):
    counts = counted(table, ExploredColumns("x", "y"))
    x, y = table.numbers("x"), table.numbers("y")
    is_inside = (x >= 0) & (x < 1) & (y >= 0) & (y < 1)
    for axis, values in enumerate((x, y)):
        edges, n = counts.histogram(axis)
        np.testing.assert_array_equal(n, np.histogram(values[is_inside], edges)[0])
    assert counts.number == is_inside.sum()


def test_cells_of_a_logarithmic_axis_are_equal_on_it():
    axis = Axis("x", (1.0, 100.0), is_log=True)
    np.testing.assert_allclose(edges_of(axis, 2), [1.0, 10.0, 100.0])
    counts = Counts(axis, UNIT)
    counts.add(np.array([5.0, 50.0, 50.0]), np.full(3, 0.5))
    image = counts.image()
    columns = np.flatnonzero(np.isfinite(image).any(axis=0))
    ends = image.shape[1] * np.log10([5.0, 50.0]) / 2.0
    assert columns.tolist() == np.floor(ends).astype(int).tolist()
    assert np.nanmax(image) == 2.0


def test_values_that_are_missing_do_not_count_in_a_mean():
    middle = np.full(3, 0.5)
    counts = Counts(UNIT, UNIT, has_values=True)
    counts.add(middle, middle, values=np.array([1.0, np.nan, 3.0]))
    means = counts.means()
    assert means[np.isfinite(means)].tolist() == [2.0]


@pytest.mark.parametrize("is_log", [False, True])
def test_medians_are_those_of_all_rows_beside_the_bins(is_log):
    random = np.random.default_rng(5)
    y = random.lognormal(0.0, 1.0, 3000)
    y[::100] = np.nan
    y[::151] = -1.0
    table = table_of(x=random.uniform(0.0, 1.0, 3000), y=y)
    axis = Axis("", (0.2, 4.0), is_log=is_log)
    chosen = ExploredColumns("x", "y", has_median=True, is_log_y=is_log)
    found = counted(table, chosen, y=axis).medians()
    among = np.isfinite(y) & ((y > 0) | (not is_log))
    bins = np.floor(32 * table.numbers("x")).astype(int)
    for x, low, median, high in zip(*found, strict=True):
        values = y[among & (bins == int(32 * x))]
        expected = np.clip(np.quantile(values, [0.16, 0.5, 0.84]), *axis.limits)
        # Quantiles between two of ninety values are a matter of definition.
        np.testing.assert_allclose([low, median, high], expected, rtol=0.1)
    assert len(found.x) == 32


def test_median_outside_the_frame_is_left_out():
    counts = Counts(UNIT, UNIT, has_medians=True)
    counts.add(np.repeat([0.1, 0.9], 20), np.repeat([0.5, 3.0], 20))
    (x, _, median, _) = counts.medians()
    assert x == pytest.approx([0.1], abs=1 / 32)
    assert median == pytest.approx([0.5], abs=1e-3)


def test_rows_in_a_frame_are_found_by_number(table):
    x, y = table.numbers("x"), table.numbers("y")
    limits = ((0.2, 0.8), (0.9, 0.1))
    expected = np.flatnonzero((x >= 0.2) & (x <= 0.8) & (y >= 0.1) & (y <= 0.9))
    assert rows_in_frame(table, ExploredColumns("x", "y"), limits).tolist() == expected.tolist()
    found = rows_in_frame(table, ExploredColumns("x", "y"), limits, expected[:2].tolist())
    assert found.tolist() == expected[:2].tolist()
    assert len(rows_in_frame(table, ExploredColumns("x", "y"), None)) == 57


def test_area_has_the_sources_with_a_row_inside():
    """A concave area, and a source with one row inside and another outside."""
    table = table_of(
        ids=[7, 8, 9, 7, 6],
        x=np.array([1.0, 3.0, 3.0, 9.0, 1.0]),
        y=np.array([1.0, 1.0, 3.0, 9.0, 3.0]),
        z=np.array([0.0, 1.0, 0.0, 0.0, 0.0]),
    )
    # An L, which leaves out its upper right quarter.
    corners = np.array([(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)], dtype=float)
    chosen = ExploredColumns("x", "y")
    assert items_within(table, chosen, corners) == {7, 8, 6}
    assert items_within(table, chosen, corners[::-1]) == {7, 8, 6}
    without = ExploredColumns("x", "y", only="z", highest=0.5)
    assert items_within(table, without, corners) == {7, 6}
    assert items_within(table, chosen, corners[:2]) == frozenset()
    assert items_within(table, chosen, corners + 20.0) == frozenset()
