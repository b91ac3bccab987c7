"""Tables whose columns are drawn against each other, and the sources in an area of a figure."""

import numpy as np
import pytest

from plateviz.tables.explore import EXPLORABLE, ExplorableTable, sources_within
from plateviz.tables.sources import deviation
from solver.data import schema
from solver.data.columns import Column


@pytest.fixture(params=EXPLORABLE)
def table(request, fit_result):
    return EXPLORABLE[request.param](fit_result)


def test_every_column_has_a_number_for_each_row_and_a_meaning(table):
    for name, column in table.columns.items():
        assert column.name == name
        assert column.meaning
        assert table.numbers(name).shape == (table.size,)


def test_unknown_column_is_refused(table):
    with pytest.raises(KeyError, match="source_class"):
        table.numbers("source_class")


def test_columns_of_the_result_are_those_of_the_schema(fit_result):
    for name, kind, frame in (
        ("sources", schema.SOURCES, fit_result.sources),
        ("measurements", schema.RESIDUALS, fit_result.residuals),
        ("exposures", schema.EXPOSURES, fit_result.exposures),
    ):
        found = EXPLORABLE[name](fit_result)
        assert found.size == len(frame)
        numbers = {c.name for c in kind if c.dtype != "str"} - {"orbit_id", "source_id"}
        assert numbers <= set(found.columns)


def test_measurements_have_the_values_of_their_source_and_exposure(fit_result):
    table = EXPLORABLE["measurements"](fit_result)
    rows = fit_result.residuals
    row = len(rows) // 2
    sources = fit_result.sources.set_index("source_id")
    one = {name: rows[name].iloc[row] for name in rows}
    assert table.numbers("n_obs")[row] == sources["n_obs"][one["source_id"]]
    exposures = fit_result.exposures.set_index(["orbit_id", "field_id", "plate_id"])["obstime"]
    since = exposures[one["orbit_id"], one["field_id"], one["plate_id"]] - exposures.min()
    assert table.numbers("minutes")[row] == pytest.approx(1440.0 * since)
    squares = one["standardised_x"] ** 2 + one["standardised_y"] ** 2
    assert table.numbers("standardised")[row] == pytest.approx(np.sqrt(squares))
    phases = table.numbers("phase_x")
    assert (phases >= 0).all()
    assert (phases < 1).all()
    np.testing.assert_allclose((rows["nx"] - phases) % 1.0, 0.0, atol=1e-9)


def test_sources_have_their_deviation_from_the_truth(fit_result):
    table = EXPLORABLE["sources"](fit_result)
    expected = deviation(fit_result, fit_result.true_places).set_index("source_id")
    found = table.numbers("pull_ra")
    np.testing.assert_array_equal(found, expected["pull_ra"][table.read("source_id")])


def test_exposures_have_their_fitted_parameters(fit_result):
    table = EXPLORABLE["exposures"](fit_result)
    expected = fit_result.values_on("exp", "offset")["focal_length"]
    np.testing.assert_array_equal(table.numbers("focal_length_offset"), expected)
    assert table.columns["focal_length_offset"].unit


def test_area_has_the_sources_with_a_row_inside():
    """A concave area, and a source with one row inside and another outside."""
    columns = {
        "x": np.array([1.0, 3.0, 3.0, 9.0, 1.0]),
        "y": np.array([1.0, 1.0, 3.0, 9.0, 3.0]),
        "source_id": np.array([7, 8, 9, 7, 6]),
    }
    named = {name: Column(name, "float64", "", "") for name in ("x", "y")}
    table = ExplorableTable("rows", 5, named, columns.__getitem__, True, False)
    # An L, which leaves out its upper right quarter.
    corners = np.array([(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)], dtype=float)
    everything = np.ones(5, dtype=bool)
    assert sources_within(table, "x", "y", corners, everything) == {7, 8, 6}
    assert sources_within(table, "x", "y", corners[::-1], everything) == {7, 8, 6}
    assert sources_within(table, "x", "y", corners, columns["source_id"] != 8) == {7, 6}
    assert sources_within(table, "x", "y", corners[:2], everything) == frozenset()
    assert sources_within(table, "x", "y", corners + 20.0, everything) == frozenset()
