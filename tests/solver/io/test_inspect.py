"""Inspection: kind, contents and problems of files, without exceptions."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
from astropy.time import Time

from solver.data.instrument import MINI_MOCK, write_instrument
from solver.errors import InputError
from solver.io.inspect import inspect_files
from solver.io.result import write_result
from solver.io.survey import measurement_path, read_survey_orbit
from tests.solver.io_samples import (
    FIRST_ID,
    catalogue,
    environment,
    measurement,
    small_result,
    write_fits,
    write_orbit,
    write_table,
)


def _inspect(*paths):
    found = inspect_files(paths)
    # The result must be valid strict JSON.
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    return found


def test_observation_and_catalogue(tmp_path):
    obs, ref = _inspect(*write_orbit(tmp_path))
    assert (obs["kind"], ref["kind"]) == ("observation", "catalogue")
    assert (obs["problems"], ref["problems"]) == ([], [])
    assert [(t["name"], t["kind"], t["rows"]) for t in obs["tables"]] == [
        ("MEASUREMENT", "measurement", 24),
        ("ENVIRONMENT", "environment", 4),
    ]


def test_columns_have_unit_range_and_canonical_name(tmp_path):
    table = measurement()
    table.rename_column("sx", "sx0")
    table["note"] = ["x"] * len(table)
    obs, _ = _inspect(*write_orbit(tmp_path, table))
    columns = {column["name"]: column for column in obs["tables"][0]["columns"]}
    assert columns["sx0"] == {
        "name": "sx0",
        "unit": "pix",
        "type": "float64",
        "min": table["sx0"].min(),
        "max": table["sx0"].max(),
        "canonical": "sx",
    }
    assert columns["source_id"]["max"] == FIRST_ID + 5
    assert columns["note"]["canonical"] is None
    assert columns["note"]["min"] is None


def test_range_ignores_non_finite_values(tmp_path):
    table = catalogue()
    table["parallax"] = [1.0, np.nan, np.inf, 2.0, 1.5, 1.5, 1.5]
    table["nothing"] = np.full(7, np.nan)
    (found,) = _inspect(write_fits(tmp_path / "r.fits", catalogue=table))
    columns = {column["name"]: column for column in found["tables"][0]["columns"]}
    assert (columns["parallax"]["min"], columns["parallax"]["max"]) == (1.0, 2.0)
    assert columns["nothing"]["min"] is None
    assert len(found["problems"]) == 1


def test_range_of_times(tmp_path):
    table = environment()
    table["obstime"] = Time([61822.0, 61822.5, 61823.0, 61824.0], format="mjd", scale="tcb")
    (found,) = _inspect(write_table(table, tmp_path / "environment.ecsv"))
    column = next(c for c in found["tables"][0]["columns"] if c["name"] == "obstime")
    assert (column["type"], column["min"][:10], column["max"][:10]) == (
        "time",
        "2028-02-21",
        "2028-02-23",
    )


def test_all_problems_are_listed(tmp_path):
    measured, listed = measurement(), catalogue()
    measured["nx"][0] = np.nan
    measured["sx"][:] = 0.0
    listed["is_reference"][:] = False
    obs, ref = _inspect(*write_orbit(tmp_path, measured, environment()[:2], listed[1:]))
    listed_problems = "\n".join(obs["problems"])
    assert len(obs["problems"]) == 5
    for part in (
        "'nx': expected finite",
        "'sx': expected values from 1e-07 to 1000 pix",
        "for every measured exposure",
        "every measured source in",
        "at least one reference source",
    ):
        assert part in listed_problems
    assert ref["problems"] == []


def test_tables_in_files_of_their_own_are_checked_together(tmp_path):
    found = _inspect(
        write_table(measurement(), tmp_path / "pixels.csv"),
        write_table(environment()[1:], tmp_path / "exposures.csv"),
        write_table(catalogue(), tmp_path / "stars.csv"),
    )
    assert [item["kind"] for item in found] == ["measurement", "environment", "catalogue"]
    assert ["for every measured exposure" in text for text in found[0]["problems"]] == [True]


def test_folder_of_an_observation(tmp_path):
    write_table(measurement(), tmp_path / "measurement.csv")
    write_table(environment(), tmp_path / "environment.csv")
    (found,) = _inspect(tmp_path)
    assert found["kind"] == "observation"
    assert found["problems"] == []


@pytest.mark.parametrize("named_by", ["file", "column", "table"])
def test_truth(tmp_path, named_by):
    table = catalogue()
    if named_by == "column":
        table["ra_epoch"] = table["ra"]
    name = {"file": "my_truth.fits"}.get(named_by, "b.fits")
    hdu = {"table": "ground_truth"}.get(named_by, "stars")
    obs, truth = _inspect(write_orbit(tmp_path)[0], write_fits(tmp_path / name, **{hdu: table}))
    assert truth["kind"] == "truth"
    assert obs["problems"] == []


def test_truth_of_other_sources(tmp_path):
    obs, _ = write_orbit(tmp_path)
    found = _inspect(obs, write_fits(tmp_path / "truth.fits", truth=catalogue()[-1:]))
    assert "expected some of the 6 sources" in found[0]["problems"][0]


def test_result(tmp_path):
    write_result(small_result(), tmp_path / "r.fits")
    (found,) = _inspect(tmp_path / "r.fits")
    assert found["kind"] == "result"
    assert found["problems"] == []
    assert {"RESULT", "SAMPLE", "SUMMARY"} <= {table["name"] for table in found["tables"]}


def test_instrument(tmp_path):
    (tmp_path / "i.toml").write_text(write_instrument(MINI_MOCK))
    (tmp_path / "bad.toml").write_text("name = 1")
    good, bad = _inspect(tmp_path / "i.toml", tmp_path / "bad.toml")
    assert (good["kind"], good["problems"]) == ("instrument", [])
    assert "expected" in bad["problems"][0]


def test_survey(tmp_path):
    (tmp_path / "survey.toml").write_text("format = 1")
    write_table(catalogue(), tmp_path / "reference.parquet")
    write_table(environment(), tmp_path / "exposures.parquet")
    (found,) = _inspect(tmp_path)
    assert found["kind"] == "survey"
    assert [table["kind"] for table in found["tables"]] == ["environment", "catalogue"]
    assert found["problems"] == []


def test_survey_with_a_broken_table(tmp_path):
    (tmp_path / "survey.toml").write_text("")
    (tmp_path / "reference.parquet").write_bytes(b"no")
    (found,) = _inspect(tmp_path)
    assert "reference.parquet: expected a Parquet table" in found["problems"][0]


def test_measurements_of_a_survey_are_counted_where_their_files_can_be_read(small_survey, tmp_path):
    survey = tmp_path / "survey"
    shutil.copytree(small_survey, survey)
    (whole,) = _inspect(survey)
    assert whole["problems"] == []
    n_rows = [len(read_survey_orbit(survey, orbit).measurements) for orbit in (0, 1)]
    assert whole["counts"] == {"orbits": 2, "measurements": sum(n_rows)}
    measurement_path(survey, 1).write_bytes(b"no")
    (damaged,) = _inspect(survey)
    assert "orbit=0001.parquet" in damaged["problems"][0]
    assert damaged["counts"] == {"orbits": 2, "measurements": n_rows[0]}


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.fits", b""),
        ("a.fits", bytes(2880)),
        ("a.csv", b"some words\nand more\n"),
        ("a.csv", b""),
        ("a.parquet", b"PAR1"),
        ("a.xml", b"<html/>"),
        ("a.txt", b"words"),
        ("a.toml", b"\xff"),
        ("none.fits", None),
    ],
)
def test_bad_files_are_described_without_raising(tmp_path, name, content):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    (found,) = _inspect(tmp_path / name)
    assert len(found["problems"]) == 1
    assert name in found["problems"][0]
    assert "expected" in found["problems"][0]


def test_empty_folder(tmp_path):
    (found,) = _inspect(tmp_path)
    assert found["kind"] == "unknown"
    assert "expected a survey or the tables of an observation" in found["problems"][0]


def test_table_with_other_columns_is_unknown(tmp_path):
    (found,) = _inspect(write_fits(tmp_path / "a.fits", lines=environment()["plate_id", "pa_est"]))
    assert found["kind"] == "unknown"
    assert "found LINES with other columns" in found["problems"][0]


def test_table_with_misspelt_column_is_recognised(tmp_path):
    table = measurement()
    table.rename_column("ny", "y")
    obs, _ = _inspect(*write_orbit(tmp_path, table))
    assert obs["kind"] == "observation"
    assert "found none for ny" in obs["problems"][0]


def test_sample_orbit(sample_orbit_dir):
    names = ("sample_obs.fits", "sample_ref.fits", "sample_truth.fits")
    found = _inspect(*(sample_orbit_dir / name for name in names))
    assert [item["kind"] for item in found] == ["observation", "catalogue", "truth"]
    assert [item["problems"] for item in found] == [[], [], []]


def test_orbits_that_are_misnamed_unreadable_or_copies_are_named(small_survey, tmp_path):
    survey = tmp_path / "survey"
    shutil.copytree(small_survey, survey)
    (survey / "manifest.sha256").unlink()
    exposures = pd.read_parquet(survey / "exposures.parquet")
    copy = exposures[exposures["orbit_id"] == 0].assign(orbit_id=5)
    pd.concat([exposures, copy]).to_parquet(survey / "exposures.parquet", index=False)
    shutil.copy(measurement_path(survey, 0), survey / "measurements" / "orbit=-005.parquet")
    measurement_path(survey, 1).write_bytes(b"no")
    problems = _inspect(survey)[0]["problems"]
    assert any("orbit=-005.parquet is not read, since its name is" in one for one in problems)
    assert any("orbit=0001.parquet: expected a table" in one for one in problems)
    assert any("found the same times and pointings in (0, 5)" in one for one in problems)


def test_measurements_at_one_place_are_a_problem(tmp_path):
    table = measurement()
    table["nx"], table["ny"] = 3.5, -2.0
    obs, _ = _inspect(*write_orbit(tmp_path, table))
    (problem,) = obs["problems"]
    assert problem.endswith("found all 24 of orbit 1 at (3.5, -2) pix")


def test_unfinished_survey_is_not_taken_for_whole_tables(small_survey, tmp_path):
    survey = tmp_path / "survey"
    shutil.copytree(small_survey, survey)
    (survey / "survey.toml").rename(survey / "unfinished.toml")
    (report,) = inspect_files([survey])
    assert report["kind"] == "unfinished survey"
    assert any("`plateviz simulate`" in one for one in report["problems"])
    with pytest.raises(InputError, match="found an unfinished one"):
        read_survey_orbit(survey, 0)
