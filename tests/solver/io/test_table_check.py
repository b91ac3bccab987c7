"""Table checks: names, types, units and values, with all problems in one message."""

import numpy as np
import pandas as pd
import pytest
from astropy import units as u
from astropy.table import Column, MaskedColumn, QTable, Table
from astropy.time import Time

from solver.data.schema import CATALOGUE, ENVIRONMENT, MEASUREMENT, TRUTH
from solver.errors import InputError
from solver.io.table_check import conform, examine
from tests.solver.io_samples import FIRST_ID, catalogue, environment, measurement

WHERE = "OBS.fits, HDU X"


def _replaced(table, **columns):
    for name, values in columns.items():
        table[name] = values
    return table


def test_conform_returns_canonical_columns_in_order():
    frame = conform(catalogue(), CATALOGUE, WHERE)
    assert list(frame.columns) == CATALOGUE.names
    assert {c.name: str(frame[c.name].dtype) for c in CATALOGUE} == {
        c.name: c.dtype for c in CATALOGUE
    }


def test_absent_optional_columns_are_filled():
    frame = conform(catalogue(), CATALOGUE, WHERE)
    assert (frame["ra_dec_corr"] == 0.0).all()
    assert not frame["is_artificial"].any()


def test_absent_errors_of_a_truth_are_nan_and_nan_is_accepted():
    table = catalogue()
    table.remove_columns(["ra_error", "is_reference"])
    table["dec_error"][:] = np.nan
    frame = conform(table, TRUTH, WHERE)
    assert frame[["ra_error", "dec_error"]].isna().all(axis=None)
    assert not frame["is_reference"].any()


def test_other_columns_are_dropped():
    table = _replaced(catalogue(), ra_epoch=np.zeros(7), phot=Column(np.zeros(7), unit="mag"))
    assert list(conform(table, TRUTH, WHERE).columns) == TRUTH.names


@pytest.mark.parametrize(
    ("canonical", "alias", "table", "schema"),
    [
        ("sx", "sx0", measurement(), MEASUREMENT),
        ("sy", "SY0", measurement(), MEASUREMENT),
        ("obstime", "exptime", environment(), ENVIRONMENT),
        ("ra_est", "ra est", environment(), ENVIRONMENT),
        ("ra_est", "ra_tel", environment(), ENVIRONMENT),
        ("pa_est", "theta_tel", environment(), ENVIRONMENT),
        ("focal_length", "focal length", environment(), ENVIRONMENT),
        ("focal_length", "FOC_TEL", environment(), ENVIRONMENT),
        ("is_reference", "reference_flag", catalogue(), CATALOGUE),
        ("is_reference", "flag_ref", catalogue(), CATALOGUE),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_aliases(canonical, alias, table, schema):
    table = table.copy()
    table.rename_column(canonical, alias)
    np.testing.assert_array_equal(conform(table, schema, WHERE)[canonical], table[alias])


def test_estimated_pointing_has_priority_in_any_case():
    table = environment()
    table.rename_column("ra_est", "RA EST")
    table["ra"] = Column(np.zeros(len(table)), unit="deg")
    np.testing.assert_array_equal(conform(table, ENVIRONMENT, WHERE)["ra_est"], table["RA EST"])


def test_same_case_has_priority():
    table = measurement()
    table["NX"] = np.zeros(len(table))
    np.testing.assert_array_equal(conform(table, MEASUREMENT, WHERE)["nx"], table["nx"])


@pytest.mark.parametrize(
    ("name", "unit", "factor"),
    [
        ("ra", "rad", 180 / np.pi),
        ("ra_error", "deg", 3.6e6),
        ("dec_error", "uas", 1e-3),
        ("pmra", "arcsec / yr", 1e3),
        ("parallax", "", 1.0),
    ],
)
def test_units_are_converted(name, unit, factor):
    table = catalogue()
    values = np.full(len(table), 0.5)
    table[name] = Column(values, unit=unit)
    np.testing.assert_allclose(conform(table, CATALOGUE, WHERE)[name], factor * values, rtol=1e-14)


def test_values_in_the_canonical_unit_are_unchanged():
    table = catalogue()
    np.testing.assert_array_equal(conform(table, CATALOGUE, WHERE)["ra"], table["ra"])


def test_quantities_are_read_as_columns():
    table = QTable(catalogue())
    table["parallax"] = table["parallax"].to(u.uas)
    frame = conform(table, CATALOGUE, WHERE)
    np.testing.assert_allclose(frame["parallax"], catalogue()["parallax"], rtol=1e-14)


@pytest.mark.parametrize(("scale", "seconds"), [("tcb", 0.0), ("tdb", 25.0), ("utc", 94.2)])
def test_times_become_mjd_in_tcb(scale, seconds):
    table = environment()
    table["obstime"] = Time(np.full(len(table), 61822.0), format="mjd", scale=scale)
    frame = conform(table, ENVIRONMENT, WHERE)
    np.testing.assert_allclose((frame["obstime"] - 61822.0) * 86400.0, seconds, atol=0.1)


@pytest.mark.parametrize("scale", ["local", "ut1"])
def test_times_that_need_the_rotation_of_the_earth_are_refused(scale):
    table = environment()
    table["obstime"] = Time(np.full(len(table), 61822.0), format="mjd", scale=scale)
    with pytest.raises(InputError, match=f"expected a time scale out of utc, .*, found '{scale}'"):
        conform(table, ENVIRONMENT, WHERE)


def test_ref_epoch_as_a_time_is_a_julian_year():
    table = catalogue()
    table["ref_epoch"] = Time(np.full(len(table), 2016.0), format="jyear", scale="tcb")
    assert (conform(table, CATALOGUE, WHERE)["ref_epoch"] == 2016.0).all()


@pytest.mark.parametrize("dtype", ["int64", "uint64", "<i8", ">i8"])
def test_ids_are_exact(dtype):
    table = catalogue()
    ids = FIRST_ID + np.arange(len(table))
    table["source_id"] = ids.astype(dtype)
    frame = conform(table, CATALOGUE, WHERE)
    assert frame["source_id"].dtype == np.int64
    assert frame["source_id"].tolist() == ids.tolist()


@pytest.mark.parametrize(
    "flags",
    [
        [True, False, True],
        [1, 0, 1],
        ["T", "F", "T"],
        ["true", "false", "TRUE"],
        [b"T ", b"F", b"t"],
        np.array(["True", "False", "True"], dtype=object),
    ],
    ids=["bool", "int", "letter", "word", "bytes", "object"],
)
def test_booleans(flags):
    table = catalogue()[:3]
    table["is_reference"] = flags
    assert conform(table, CATALOGUE, WHERE)["is_reference"].tolist() == [True, False, True]


def test_row_order_is_kept():
    table = measurement()[::-1]
    np.testing.assert_array_equal(conform(table, MEASUREMENT, WHERE)["nx"], table["nx"])


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        (
            "nx",
            [1.0, np.nan, np.inf],
            r"expected finite numbers, found 2 of 3 rows.*first is row 2",
        ),
        ("nx", MaskedColumn([1.0, 2.0, 3.0], mask=[0, 0, 1]), "a value in every row, found 1 of 3"),
        ("nx", ["1", "2", "3"], "expected numbers, found text such as '1'"),
        ("nx", np.zeros((3, 2)), r"expected one value per row, found an array of shape \(2,\)"),
        ("nx", [True, False, True], "expected numbers, found bool"),
        ("nx", Time([1.0, 2.0, 3.0], format="mjd"), "expected numbers in pix, found times"),
        ("nx", Column([1.0, 2.0, 3.0], unit="mm"), "convertible to 'pix', found 'mm'"),
        ("sx", [0.01, 0.0, 0.01], "from 1e-07 to 1000 pix .*, found 0.0: 1 of 3 rows .* row 2"),
        ("sx", [0.01, 0.01, -2.0], "from 1e-07 to 1000 pix .*, found -2.0: 1 of 3 rows .* row 3"),
        ("source_id", [1.0, 2.0, 3.0], r"integers \(int64\), found float64, which cannot hold"),
        ("source_id", ["1", "2", "3"], r"integers \(int64\), found text"),
        ("source_id", np.array([1, 2, 2**63], dtype="uint64"), "9223372036854775808, beyond int64"),
        ("source_id", MaskedColumn([1, 2, 3], mask=[1, 0, 0]), "a value in every row.*row 1"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_refused_measurements(name, values, message):
    table = _replaced(measurement()[:3], **{name: values})
    with pytest.raises(InputError, match=rf"^OBS.fits, HDU X, column '{name}': .*{message}"):
        conform(table, MEASUREMENT, WHERE)


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("is_reference", [0, 1, 2], "true or false .*found 2: 1 of 3 rows"),
        ("is_reference", ["T", "F", "maybe"], "true or false .*found 'maybe'"),
        ("is_reference", [0.0, 1.0, 1.0], "true or false .*found float64"),
        ("ra", np.ones(3, dtype="float32"), "float64, for its precision, found float32"),
        ("dec", [0.0, 0.0, 266.2], "values from -90 to 90 deg .*, found 266.2"),
        ("pmra_error", [0.1, 0.1, -0.1], "values from 0 to 20000 mas / yr .*, found -0.1"),
        ("ra_dec_corr", [0.1, 0.1, 1.5], "values from -1 to 1 .*, found 1.5"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_refused_catalogues(name, values, message):
    table = _replaced(catalogue()[:3], **{name: values})
    with pytest.raises(InputError, match=rf"column '{name}': expected .*{message}"):
        conform(table, CATALOGUE, WHERE)


def test_unknown_unit():
    table = measurement()
    table["nx"].unit = u.Unit("pxl", parse_strict="silent")
    with pytest.raises(InputError, match="column 'nx': .*'pix', found an unknown unit 'pxl'"):
        conform(table, MEASUREMENT, WHERE)


def test_unknown_unit_of_an_unused_column_is_ignored():
    table = measurement()
    table["flux"] = Column(np.ones(len(table)), unit=u.Unit("pxl", parse_strict="silent"))
    assert examine(table, MEASUREMENT, WHERE)[1] == []


def test_julian_date_for_mjd():
    table = _replaced(environment(), obstime=np.full(4, 2461822.5))
    with pytest.raises(
        InputError, match="'obstime': expected values from 40000 to 90000 d .*, found"
    ):
        conform(table, ENVIRONMENT, WHERE)


def test_masked_times():
    table = environment()
    times = Time(np.full(len(table), 61822.0), format="mjd", scale="tcb")
    times[1] = np.ma.masked
    table["obstime"] = times
    with pytest.raises(InputError, match="column 'obstime': expected a time in every row.*row 2"):
        conform(table, ENVIRONMENT, WHERE)


def test_missing_columns_are_named_all_at_once_with_close_matches():
    table = measurement()
    table.rename_columns(["source_id", "ny"], ["sourceid", "y_pixel"])
    message = r"found none for source_id \(did you mean 'sourceid'\?\), ny;.*orbit_id, field_id"
    with pytest.raises(InputError, match=message):
        conform(table, MEASUREMENT, WHERE)


def test_close_match_of_an_alias():
    table = catalogue()
    table.rename_column("is_reference", "referenceflag")
    with pytest.raises(InputError, match=r"is_reference \(did you mean 'referenceflag'\?\)"):
        conform(table, CATALOGUE, WHERE)


def test_empty_table():
    with pytest.raises(InputError, match="expected at least one row, found none"):
        conform(measurement()[:0], MEASUREMENT, WHERE)


def test_duplicate_key_names_one():
    table = catalogue()
    table["source_id"][5] = table["source_id"][2]
    message = (
        f"each source_id once, found 1 row that repeats another.* source_id {FIRST_ID + 2} in row 6"
    )
    with pytest.raises(InputError, match=message):
        conform(table, CATALOGUE, WHERE)


def test_every_problem_is_listed():
    table = measurement()
    table["nx"][0] = np.nan
    table["sx"][:] = 0.0
    table["sy"][3] = -1.0
    table["source_id"][1] = table["source_id"][0]
    table["detector_id"][1] = table["detector_id"][0]
    table.remove_column("ny")
    found = examine(table, MEASUREMENT, WHERE)[1]
    assert len(found) == 5
    assert all(message.startswith(WHERE) for message in found)


def test_no_problem_in_a_good_table():
    assert examine(measurement(), MEASUREMENT, WHERE)[1] == []


def test_message_of_many_problems_counts_the_rest():
    table = measurement()
    for name in ("nx", "ny", "sx", "sy", "orbit_id", "field_id", "plate_id"):
        table[name] = ["x"] * len(table)
    with pytest.raises(InputError, match="; and 2 more$"):
        conform(table, MEASUREMENT, WHERE)


def test_conform_is_idempotent():
    frame = conform(catalogue(), CATALOGUE, WHERE)
    again = conform(Table.from_pandas(frame), CATALOGUE, WHERE)
    pd.testing.assert_frame_equal(frame, again, check_exact=True)
