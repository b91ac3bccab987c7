"""Survey directories with defects, and the bytes of those without."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from solver.data.defect_schema import AFFECTED
from solver.errors import InputError
from solver.io.inspect import inspect_files
from solver.io.manifest import read_manifest
from solver.io.survey import read_survey_orbit
from solver.io.survey_header import read_header
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import read_affected, simulate_survey

PLAIN = SurveySettings(orbits=3, seed=7).scaled(1500)
DEFECTS = ("noise=10%", "outliers=1%", "swapped=1%", "binaries=2", "charge-transfer=5mpix")
SETTINGS = replace(PLAIN, defects=DEFECTS)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    directory = tmp_path_factory.mktemp("plain")
    simulate_survey(directory, PLAIN)
    return directory


@pytest.fixture(scope="module")
def survey(tmp_path_factory):
    directory = tmp_path_factory.mktemp("defective")
    simulate_survey(directory, SETTINGS)
    return directory


def test_survey_without_defects_is_that_of_the_version_before_them(plain):
    """Numbers written by the last version without defects."""
    rows = pd.read_parquet(plain / "measurements" / "orbit=0000.parquet")
    assert rows.columns.tolist() == [
        *("orbit_id", "field_id", "plate_id", "detector_id", "source_id", "nx", "ny", "sx", "sy")
    ]
    assert len(rows) == 2156
    ids = (4040000991784024449, 4040001832793005323, 4040000873448026046)
    places = (
        (466.6227274869823, -51.227192615433495),
        (-694.0146669336278, -485.24510273930025),
        (-342.8105730414061, 156.25946782212938),
    )
    for row, source, place in zip((0, 1000, -1), ids, places, strict=True):
        assert rows["source_id"].iloc[row] == source
        np.testing.assert_allclose(rows[["nx", "ny"]].iloc[row], place, rtol=0, atol=1e-8)
    truth, reference = (
        pd.read_parquet(plain / f"{name}.parquet") for name in ("truth", "reference")
    )
    assert "magnitude" not in truth
    assert "magnitude" not in reference
    assert truth["pmra"].iloc[700] == pytest.approx(1.0936678022936936, abs=1e-12)
    assert reference["parallax"].iloc[700] == pytest.approx(0.27575071748237084, abs=1e-12)
    settings = read_header(plain)["settings"]
    assert not {"defects", "magnitudes", "noise_by_magnitude"} & set(settings)
    assert not (plain / "defects").exists()
    assert read_affected(plain).empty
    assert list(read_affected(plain).columns) == AFFECTED.names


def test_absent_magnitudes_are_read_as_nan_and_present_ones_as_they_are(plain, survey):
    for directory, has_magnitudes in ((plain, False), (survey, True)):
        data = read_survey_orbit(directory, 0)
        for table in (data.measurements, data.catalogue, data.truth):
            assert table["magnitude"].notna().all() == has_magnitudes
            assert table["magnitude"].isna().all() != has_magnitudes


def test_header_and_inspection_name_the_defects(plain, survey):
    expected = list(SETTINGS.defects)
    assert sorted(expected) == sorted(DEFECTS)
    assert read_header(survey)["settings"]["defects"] == expected
    assert SurveySettings.from_dict(read_header(survey)["settings"]) == SETTINGS
    found, without = inspect_files([survey, plain])
    assert found["defects"] == expected
    assert without["defects"] == []
    assert found["problems"] == []
    json.dumps(found)


def test_affected_rows_are_listed_beside_the_tables(survey):
    affected = read_affected(survey)
    assert set(affected["defect"]) == {"outliers", "swapped", "binaries"}
    assert (affected["defect"] == "binaries").sum() == 2
    assert (affected.loc[affected["defect"] == "binaries", "orbit_id"] == -1).all()
    names = {name for name in read_manifest(survey / "manifest.sha256") if "defects" in name}
    assert names == {
        "defects/reference.parquet",
        *(f"defects/orbit={number:04d}.parquet" for number in range(3)),
    }
    # No fit reads them.
    data = read_survey_orbit(survey, 1)
    assert not any("defects" in name for name in data.provenance)
    rows = affected[(affected["orbit_id"] == 1) & (affected["defect"] == "swapped")]
    assert len(rows.merge(data.measurements, on=AFFECTED.names[1:6])) == len(rows)


def test_damaged_list_of_affected_rows_is_refused_and_inspected(survey, tmp_path):
    copy = shutil.copytree(survey, tmp_path / "copy")
    (copy / "defects" / "orbit=0001.parquet").write_bytes(b"PAR1")
    with pytest.raises(InputError, match=r"orbit=0001\.parquet"):
        read_affected(copy)
    assert any("orbit=0001" in problem for problem in inspect_files([copy])[0]["problems"])


def test_interrupted_survey_with_defects_resumes_to_the_same_bytes(survey, tmp_path):
    class InterruptionError(Exception):
        pass

    def stop(done, total):
        if done == 2:
            raise InterruptionError

    with pytest.raises(InterruptionError):
        simulate_survey(tmp_path, SETTINGS, progress=stop)
    with pytest.raises(InputError, match="found other defects"):
        simulate_survey(tmp_path, replace(SETTINGS, defects=DEFECTS[1:]))
    simulate_survey(tmp_path, SETTINGS)
    made = sorted(path.relative_to(survey) for path in survey.rglob("*.*"))
    assert made == sorted(path.relative_to(tmp_path) for path in tmp_path.rglob("*.*"))
    assert all((tmp_path / name).read_bytes() == (survey / name).read_bytes() for name in made)
