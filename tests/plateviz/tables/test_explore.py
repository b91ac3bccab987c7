"""Tables whose columns are drawn against each other, and the sources in an area of a figure."""

import numpy as np
import pytest

from plateviz.tables.explore import EXPLORABLE, ExplorableTable
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


@pytest.mark.parametrize("name", ["measurements", "sources"])
def test_rows_have_the_sources_that_their_table_says(name, fit_result):
    table = EXPLORABLE[name](fit_result)
    ids, codes, classes = table.sources()
    assert np.all(np.diff(ids) > 0)
    np.testing.assert_array_equal(ids[codes], table.read("source_id"))
    np.testing.assert_array_equal(classes[codes], table.read("source_class"))


def test_sources_of_a_table_without_classes_have_none():
    columns = {"x": np.ones(3), "source_id": np.array([7, 5, 7])}
    named = {"x": Column("x", "float64", "", "")}
    table = ExplorableTable("rows", 3, named, columns.__getitem__, True, False)
    ids, codes, classes = table.sources()
    assert (ids.tolist(), codes.tolist(), classes) == ([5, 7], [1, 0, 1], None)
    assert table.items("sources").among({7, 8}).tolist() == [False, True]


def test_numbers_of_four_bytes_are_not_copied_into_eight():
    values = np.ones(3, dtype=np.float32)
    table = ExplorableTable(
        "rows", 3, {"x": Column("x", "float64", "", "")}, {"x": values}.get, False, False
    )
    assert table.numbers("x") is values


def test_exposures_are_named_for_a_hover(fit_result):
    words = EXPLORABLE["exposures"](fit_result).words
    assert words["exposure"](np.array([1])).tolist() == ["field 0, exposure 1"]


def test_rows_of_one_orbit_are_of_exposures_and_detectors_too(fit_result):
    tables = {name: make(fit_result) for name, make in EXPLORABLE.items()}
    assert tables["measurements"].kinds == ("sources", "exposures", "detectors")
    assert tables["sources"].kinds == ("sources",)
    assert tables["exposures"].kinds == ("exposures",)
    assert tables["exposures"].kind("sources") == "exposures"
    rows = fit_result.residuals
    exposures = tables["measurements"].items("exposures")
    found = [exposures.items[code] for code in exposures.codes]
    assert found == list(zip(rows["field_id"], rows["plate_id"], strict=True))
    detectors = tables["measurements"].items("detectors")
    assert [detectors.items[code] for code in detectors.codes] == rows["detector_id"].tolist()


def test_exposures_of_several_orbits_are_not_the_same(fit_result):
    table = EXPLORABLE["measurements"](fit_result)
    several = table._replace(columns={**table.columns, "orbit_id": table.columns["nx"]})
    assert several.kinds == ("sources",)
    assert several._replace(has_sources=False).kind("sources") == ""
