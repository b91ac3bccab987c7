"""Reading an orbit: all layouts give the same tables, and mistakes raise InputError."""

import numpy as np
import pandas as pd
import pytest
from astropy.io import fits
from astropy.io.votable import tree, writeto
from astropy.table import Table, unique, vstack

from solver.data.schema import CATALOGUE, ENVIRONMENT, MEASUREMENT, TRUTH
from solver.errors import InputError
from solver.io.atomic import sha256_of
from solver.io.read_orbit import read_orbit
from tests.solver.io_samples import (
    FIRST_ID,
    catalogue,
    environment,
    measurement,
    write_fits,
    write_orbit,
    write_table,
)

TABLES = {"measurements": MEASUREMENT, "exposures": ENVIRONMENT, "catalogue": CATALOGUE}
PAPER = {
    "measurement": {},
    "environment": {
        "obstime": "exptime",
        "ra_est": "ra_tel",
        "dec_est": "dec_tel",
        "pa_est": "theta_tel",
        "focal_length": "foc_tel",
    },
    "catalogue": {"is_reference": "flag_ref"},
}
PUBLISHED_CODE = {
    "measurement": {"sx": "sx0", "sy": "sy0"},
    "environment": {
        "ra_est": "ra est",
        "dec_est": "dec est",
        "pa_est": "pa est",
        "focal_length": "focal length",
    },
    "catalogue": {"is_reference": "reference_flag"},
}


def _assert_same(first, second, in_any_order=False):
    for name, table in TABLES.items():
        frames = [getattr(data, name) for data in (first, second)]
        if in_any_order:
            frames = [f.sort_values(list(table.key), ignore_index=True) for f in frames]
        pd.testing.assert_frame_equal(*frames, check_exact=True)


@pytest.fixture
def expected(tmp_path):
    folder = tmp_path / "expected"
    folder.mkdir()
    return read_orbit(*write_orbit(folder))


def test_tables_are_canonical(expected):
    for name, table in TABLES.items():
        assert list(getattr(expected, name).columns) == table.names
    assert expected.truth is None
    assert expected.orbit_id == 1
    np.testing.assert_array_equal(expected.measurements["nx"], measurement()["nx"])
    np.testing.assert_array_equal(expected.measurements["source_id"], measurement()["source_id"])


@pytest.mark.parametrize("suffix", [".csv", ".ecsv", ".parquet", ".fits", ".xml"])
def test_folder_of_files(tmp_path, expected, suffix):
    write_table(measurement(), tmp_path / f"measurement{suffix}")
    write_table(environment(), tmp_path / f"environment{suffix}")
    ref = write_table(catalogue(), tmp_path / f"stars{suffix}")
    _assert_same(expected, read_orbit(tmp_path, ref))


@pytest.mark.parametrize("suffix", [".csv", ".ecsv", ".parquet"])
def test_measurements_with_the_environment_beside_them(tmp_path, expected, suffix):
    obs = write_table(measurement(), tmp_path / f"pixels{suffix}")
    write_table(environment(), tmp_path / f"environment{suffix}")
    ref = write_table(catalogue(), tmp_path / f"stars{suffix}")
    _assert_same(expected, read_orbit(obs, ref))


def test_votable_with_both_tables(tmp_path, expected):
    resource = tree.Resource()
    document = tree.VOTableFile()
    document.resources.append(resource)
    for name, table in (("environment", environment()), ("Measurement", measurement())):
        element = tree.TableElement.from_table(document, table)
        element.name = name
        resource.tables.append(element)
    writeto(document, str(tmp_path / "obs.vot"))
    ref = write_table(catalogue(), tmp_path / "ref.xml")
    _assert_same(expected, read_orbit(tmp_path / "obs.vot", ref))


def test_environment_of_another_format_beside_the_measurements(tmp_path, expected):
    obs = write_table(measurement(), tmp_path / "pixels.parquet")
    write_table(environment(), tmp_path / "Environment.csv")
    _assert_same(expected, read_orbit(obs, write_table(catalogue(), tmp_path / "ref.csv")))


def test_environment_of_the_same_format_is_preferred(tmp_path, expected):
    obs = write_table(measurement(), tmp_path / "measurement.csv")
    write_table(environment(), tmp_path / "environment.csv")
    write_table(environment()[:1], tmp_path / "environment.ecsv")
    _assert_same(expected, read_orbit(obs, write_table(catalogue(), tmp_path / "ref.csv")))


@pytest.mark.parametrize("names", [PAPER, PUBLISHED_CODE], ids=["paper", "published code"])
def test_names_of_the_paper_and_of_its_code(tmp_path, expected, names):
    tables = {
        "measurement": measurement(),
        "environment": environment(),
        "catalogue": catalogue(),
    }
    for key, renamed in names.items():
        for name, new in renamed.items():
            tables[key].rename_column(name, new)
    _assert_same(expected, read_orbit(*write_orbit(tmp_path, *tables.values())))


def test_row_order_does_not_matter(tmp_path, expected):
    rng = np.random.default_rng(5)
    tables = [measurement(), environment(), catalogue()]
    shuffled = [table[rng.permutation(len(table))] for table in tables]
    data = read_orbit(*write_orbit(tmp_path, *shuffled))
    np.testing.assert_array_equal(data.measurements["nx"], shuffled[0]["nx"])
    _assert_same(expected, data, in_any_order=True)


def test_hdus_in_any_order_under_other_names(tmp_path, expected):
    obs = write_fits(tmp_path / "o.fits", exposures=environment(), obs=measurement())
    _, ref = write_orbit(tmp_path)
    _assert_same(expected, read_orbit(obs, ref))


def test_catalogue_after_an_empty_table(tmp_path, expected):
    obs, _ = write_orbit(tmp_path)
    ref = write_fits(tmp_path / "r.fits", notes=Table({"a": np.zeros(0)}), stars=catalogue())
    _assert_same(expected, read_orbit(obs, ref))


def test_provenance_has_the_observation_first_then_the_catalogue(tmp_path):
    obs, ref = write_orbit(tmp_path)
    truth = write_fits(tmp_path / "TRUTH.fits", truth=catalogue())
    data = read_orbit(obs, ref, truth)
    assert list(data.provenance.items()) == [
        (path.name, sha256_of(path)) for path in (obs, ref, truth)
    ]


def test_provenance_of_files_of_the_same_name(tmp_path):
    obs, ref = write_orbit(tmp_path)
    (tmp_path / "true").mkdir()
    truth = write_fits(tmp_path / "true" / "REF.fits", truth=catalogue())
    assert list(read_orbit(obs, ref, truth).provenance) == ["OBS.fits", "REF.fits", "true/REF.fits"]


def test_partial_truth_with_columns_of_its_own(tmp_path):
    obs, ref = write_orbit(tmp_path)
    table = catalogue()[2:4]
    table["ra_epoch"] = [1.0, 2.0]
    table.remove_columns(["ra_error", "dec_error", "is_reference"])
    truth = read_orbit(obs, ref, write_fits(tmp_path / "t.fits", truth=table)).truth
    assert list(truth.columns) == TRUTH.names
    assert truth["source_id"].tolist() == [FIRST_ID + 2, FIRST_ID + 3]


def test_truth_of_other_sources(tmp_path):
    obs, ref = write_orbit(tmp_path)
    truth = write_fits(tmp_path / "t.fits", truth=catalogue()[-1:])
    message = r"t\.fits, HDU TRUTH, column source_id: expected some of the 6 .*found none"
    with pytest.raises(InputError, match=message):
        read_orbit(obs, ref, truth)


def test_exposures_without_measurements_are_dropped(tmp_path):
    table = measurement()
    data = read_orbit(*write_orbit(tmp_path, table[table["field_id"] == 0]))
    assert data.exposures["field_id"].tolist() == [0, 0]


def _orbits(*numbers):
    return (
        vstack([measurement(orbit) for orbit in numbers]),
        vstack([environment(orbit) for orbit in numbers]),
    )


def test_one_of_several_orbits(tmp_path, expected):
    _assert_same(expected, read_orbit(*write_orbit(tmp_path, *_orbits(3, 1, 2)), orbit=1))


@pytest.mark.parametrize(
    ("numbers", "orbit", "message"),
    [
        ((3, 1), None, r"expected one orbit, .*found the orbits 1, 3$"),
        (range(12), None, "found the orbits 0, 1, 2, 3, 4, 5, 6, 7, 8, 9 and 2 more"),
        ((3, 1), 2, "column orbit_id: expected orbit 2, found only 1, 3"),
    ],
    ids=["several", "many", "unknown"],
)
def test_ambiguous_or_unknown_orbit_is_refused(tmp_path, numbers, orbit, message):
    paths = write_orbit(tmp_path, *_orbits(*numbers))
    with pytest.raises(InputError, match=message):
        read_orbit(*paths, orbit=orbit)


def _with(table, name, row, value):
    table[name][row] = value
    return table


def _without(table, name):
    table.remove_column(name)
    return table


def _renamed(table, name, new):
    table.rename_column(name, new)
    return table


def _in_unit(table, name, unit):
    table[name].unit = unit
    return table


def _float_ids(table):
    table["source_id"] = table["source_id"].astype(float)
    return table


def _at_one_place(table):
    table["nx"], table["ny"] = 0.0, 0.0
    return table


def _twice(table):
    return vstack([table, table[3:4]])


MISTAKES = {
    "missing column": ({"measured": _without(measurement(), "ny")}, "found none for ny"),
    "misspelt column": (
        {"measured": _renamed(measurement(), "source_id", "souce_id")},
        r"source_id \(did you mean 'souce_id'\?\)",
    ),
    "NaN pixel": (
        {"measured": _with(measurement(), "nx", 4, np.nan)},
        r"MEASUREMENT, column 'nx': expected finite numbers, found 1 of 24 rows.*row 5",
    ),
    "zero sigma": (
        {"measured": _with(measurement(), "sx", 2, 0.0)},
        r"MEASUREMENT, column 'sx': expected values from 1e-07 to 1000 pix .*, found 0\.0.*row 3",
    ),
    "negative sigma": (
        {"measured": _with(measurement(), "sy", 2, -0.01)},
        r"MEASUREMENT, column 'sy': expected values from 1e-07 to 1000 pix .*, found -0\.01.*row 3",
    ),
    "source not in the catalogue": (
        {"listed": catalogue()[1:]},
        rf"MEASUREMENT, column source_id: .*REF\.fits.*found 1 of 6 that are not: {FIRST_ID}",
    ),
    "all measurements at one place": (
        {"measured": _at_one_place(measurement())},
        r"MEASUREMENT, columns nx and ny: expected .* different places of a detector, "
        r"found all 24 of orbit 1 at \(0, 0\) pix$",
    ),
    "duplicate id in the catalogue": (
        {"listed": _twice(catalogue())},
        rf"CATALOGUE: expected each source_id once.*source_id {FIRST_ID + 3} in row 8",
    ),
    "duplicate measurement": (
        {"measured": _twice(measurement())},
        r"MEASUREMENT: expected each orbit_id, .*source_id once, found 1 row that repeats another",
    ),
    "exposure without a row": (
        {"exposed": environment()[:3]},
        r"MEASUREMENT: expected a row in .*ENVIRONMENT.*found none for \(1, 1, 1\)$",
    ),
    "wrong unit": (
        {"exposed": _in_unit(environment(), "focal_length", "deg")},
        r"ENVIRONMENT, column 'focal_length': .*convertible to 'um', found 'deg'",
    ),
    "empty table": (
        {"measured": measurement()[:0]},
        "MEASUREMENT: expected at least one row, found none",
    ),
    "empty catalogue": (
        {"listed": catalogue()[:0]},
        "REF.fits: expected a table with at least one",
    ),
    "float ids": (
        {"measured": _float_ids(measurement())},
        r"MEASUREMENT, column 'source_id': expected integers \(int64\), found float64",
    ),
    "no reference star": (
        {"listed": _with(catalogue(), "is_reference", slice(0, 2), False)},
        r"REF\.fits, HDU CATALOGUE, column is_reference: expected at least one .*found none",
    ),
    "reference star not measured": (
        {
            "listed": _with(
                _with(catalogue(), "is_reference", slice(0, 2), False), "is_reference", 6, True
            )
        },
        "column is_reference: expected at least one reference source among the 6 measured",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_are_refused_and_nothing_is_written(tmp_path, mistake):
    tables, message = MISTAKES[mistake]
    paths = write_orbit(tmp_path, **tables)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(InputError, match=rf"{tmp_path}.*{message}"):
        read_orbit(*paths)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_unknown_unit(tmp_path):
    obs, ref = write_orbit(tmp_path)
    hdus = [fits.PrimaryHDU(), fits.table_to_hdu(catalogue())]
    hdus[1].columns["ra"].unit = "furlong"
    fits.HDUList(hdus).writeto(ref, overwrite=True)
    with pytest.raises(
        InputError, match=r"REF\.fits.*'ra'.*'deg', found an unknown unit 'furlong'"
    ):
        read_orbit(obs, ref)


def test_missing_hdu(tmp_path):
    _, ref = write_orbit(tmp_path)
    obs = write_fits(tmp_path / "o.fits", measurement=measurement())
    with pytest.raises(InputError, match=r"o\.fits: .*called 'environment', found MEASUREMENT"):
        read_orbit(obs, ref)


def test_files_swapped(tmp_path):
    obs, ref = write_orbit(tmp_path)
    with pytest.raises(InputError, match=r"REF\.fits: .*called 'measurement', found CATALOGUE"):
        read_orbit(ref, obs)


def test_survey_is_no_orbit_and_says_how_to_fit_one_of_it(tmp_path):
    survey = tmp_path / "my survey"
    (survey / "measurements").mkdir(parents=True)
    (survey / "survey.toml").touch()
    ref = write_table(catalogue(), survey / "reference.csv")
    obs = write_table(measurement(), survey / "measurements" / "m.csv")
    told = r"is a survey, of which `plateviz survey '.*my survey' --orbits N` fits orbit N$"
    for given in (survey, obs):
        with pytest.raises(InputError, match=told):
            read_orbit(given, ref)


def test_unfinished_survey_is_not_asked_for_the_tables_of_an_observation(tmp_path):
    (tmp_path / "measurements").mkdir()
    (tmp_path / "unfinished.toml").touch()
    ref = write_table(catalogue(), tmp_path / "reference.csv")
    obs = write_table(measurement(), tmp_path / "measurements" / "m.csv")
    for given in (tmp_path, obs):
        with pytest.raises(InputError, match=r"found an unfinished one: .*`plateviz simulate`"):
            read_orbit(given, ref)


def test_missing_environment_file(tmp_path):
    obs = write_table(measurement(), tmp_path / "m.csv")
    ref = write_table(catalogue(), tmp_path / "r.csv")
    with pytest.raises(InputError, match=r"expected a file called environment.*found m.csv, r.csv"):
        read_orbit(obs, ref)


def test_two_environment_files(tmp_path):
    for suffix in (".csv", ".ecsv"):
        write_table(environment(), tmp_path / f"environment{suffix}")
    write_table(measurement(), tmp_path / "measurement.csv")
    with pytest.raises(InputError, match="expected one file with the environment table, found"):
        read_orbit(tmp_path, tmp_path / "any.fits")


@pytest.mark.parametrize("which", [0, 1], ids=["OBS", "REF"])
def test_missing_file(tmp_path, which):
    paths = list(write_orbit(tmp_path))
    paths[which] = tmp_path / "none.fits"
    with pytest.raises(InputError, match=r"none\.fits: expected a file, found none"):
        read_orbit(*paths)


def test_paths_may_be_text(tmp_path, expected):
    obs, ref = write_orbit(tmp_path)
    _assert_same(expected, read_orbit(str(obs), str(ref)))


def test_sample_orbit(sample_orbit_dir):
    data = read_orbit(
        sample_orbit_dir / "sample_obs.fits",
        sample_orbit_dir / "sample_ref.fits",
        sample_orbit_dir / "sample_truth.fits",
    )
    raw = Table.read(sample_orbit_dir / "sample_obs.fits", hdu="measurement")
    assert len(data.measurements) == 36312
    assert len(data.exposures) == 96
    assert data.measurements["source_id"].nunique() == len(unique(raw, "source_id")) == 814
    np.testing.assert_array_equal(data.measurements["source_id"], raw["source_id"])
    np.testing.assert_array_equal(data.measurements["sx"], raw["sx0"])
    assert data.truth["ra_error"].lt(1.0).all()
    measured = data.catalogue["source_id"].isin(data.measurements["source_id"])
    assert (measured & data.catalogue["is_reference"]).sum() == 58


def test_sample_orbit_as_parquet(sample_orbit_dir, tmp_path):
    obs = sample_orbit_dir / "sample_obs.fits"
    ref = sample_orbit_dir / "sample_ref.fits"
    for name in ("measurement", "environment"):
        table = Table.read(obs, hdu=name)
        write_table(table, tmp_path / f"{name}.parquet")
    _assert_same(read_orbit(obs, ref), read_orbit(tmp_path, ref))
