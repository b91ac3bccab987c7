"""Orbits added to a survey: as a whole, once, and after a kill again."""

import shutil
from dataclasses import replace

import pandas as pd
import pytest

from solver.data.schema import ENVIRONMENT
from solver.errors import InputError
from solver.io import survey_growth
from solver.io.survey import EXPOSURES, read_survey_orbit, read_survey_table, survey_orbits
from solver.io.survey_growth import append_orbit
from solver.io.survey_manifest import MANIFEST, survey_changes
from tests.solver.growing_survey import GrowingSurvey


@pytest.fixture
def growing(small_survey, tmp_path):
    return GrowingSurvey(small_survey, tmp_path / "survey", 1)


def assert_equal(one, other):
    for name in ("measurements", "exposures", "catalogue", "truth"):
        pd.testing.assert_frame_equal(getattr(one, name), getattr(other, name))


def renumbered(orbit, number, days=0.0):
    """Return an orbit under another id, some days later."""
    exposures = orbit.exposures.assign(orbit_id=number, obstime=orbit.exposures["obstime"] + days)
    measurements = orbit.measurements.assign(orbit_id=number)
    return replace(orbit, measurements=measurements, exposures=exposures)


def test_added_orbit_is_read_as_in_the_survey_that_it_comes_from(growing, small_survey):
    growing.append(1)
    assert survey_orbits(growing.directory) == [0, 1]
    assert survey_changes(growing.directory) == []
    for orbit in (0, 1):
        found = read_survey_orbit(growing.directory, orbit)
        assert_equal(found, read_survey_orbit(small_survey, orbit))
    names = (MANIFEST, EXPOSURES, "measurements/orbit=0001.parquet")
    assert [(growing.directory / name).read_bytes() for name in names[1:]] == [
        (small_survey / name).read_bytes() for name in names[1:]
    ]


def test_survey_may_begin_without_orbits_and_without_a_manifest(small_survey, tmp_path):
    growing = GrowingSurvey(small_survey, tmp_path / "survey", 0)
    (growing.directory / MANIFEST).unlink()
    for orbit in (1, 0):
        growing.append(orbit)
    assert not (growing.directory / MANIFEST).exists()
    assert survey_orbits(growing.directory) == [0, 1]
    exposures = read_survey_table(growing.directory / EXPOSURES, ENVIRONMENT)
    assert exposures["orbit_id"].is_monotonic_increasing
    with pytest.raises(InputError, match="that the survey does not have, found 1"):
        growing.append(1)


def test_orbit_that_the_survey_has_is_refused_and_nothing_is_changed(growing, small_survey):
    orbit = read_survey_orbit(small_survey, 0)
    before = {path: path.read_bytes() for path in growing.directory.rglob("*.*")}
    with pytest.raises(
        InputError, match="expected an orbit that the survey does not have, found 0"
    ):
        append_orbit(growing.directory, orbit)
    unknown = orbit.measurements.assign(orbit_id=7, source_id=orbit.measurements["source_id"] + 1)
    exposures = orbit.exposures.assign(orbit_id=7)
    with pytest.raises(InputError, match="expected every measured source in"):
        append_orbit(growing.directory, replace(orbit, measurements=unknown, exposures=exposures))
    with pytest.raises(InputError, match="for every measured exposure"):
        append_orbit(growing.directory, replace(orbit, measurements=unknown))
    assert {path: path.read_bytes() for path in growing.directory.rglob("*.*")} == before


@pytest.mark.parametrize("written", [1, 2], ids=["after the measurements", "after the exposures"])
def test_killed_call_is_repeated(growing, monkeypatch, written):
    def kill(*arguments):
        write(*arguments)
        calls.append(arguments)
        if len(calls) == written:
            raise KeyboardInterrupt

    calls, write = [], survey_growth.write_survey_table
    monkeypatch.setattr(survey_growth, "write_survey_table", kill)
    with pytest.raises(KeyboardInterrupt):
        growing.append(1)
    monkeypatch.undo()
    growing.append(1)
    assert survey_changes(growing.directory) == []
    assert read_survey_orbit(growing.directory, 1).orbit_id == 1


def test_exposures_that_are_others_are_refused(growing, small_survey):
    shutil.copy(small_survey / EXPOSURES, growing.directory / EXPOSURES)
    exposures = read_survey_table(small_survey / EXPOSURES, ENVIRONMENT)
    changed = exposures.assign(ra_est=exposures["ra_est"] + 1e-6)
    survey_growth.write_survey_table(changed, ENVIRONMENT, growing.directory / EXPOSURES)
    with pytest.raises(
        InputError, match="expected the file that was written, found other contents"
    ):
        growing.append(1)


def test_killed_call_keeps_no_other_orbit_out(growing, small_survey):
    old = (growing.directory / MANIFEST).read_bytes()
    growing.append(1)
    # As if the exposures were replaced and the manifest were not.
    (growing.directory / MANIFEST).write_bytes(old)
    one = read_survey_orbit(small_survey, 1)
    append_orbit(growing.directory, renumbered(one, 2, days=3.0))
    assert survey_changes(growing.directory) == []
    exposures = read_survey_table(growing.directory / EXPOSURES, ENVIRONMENT)
    assert exposures["orbit_id"].unique().tolist() == [0, 2]
    growing.append(1)
    assert survey_changes(growing.directory) == []
    assert read_survey_orbit(growing.directory, 1).orbit_id == 1


def test_copy_of_an_orbit_is_refused(growing, small_survey):
    copy = renumbered(read_survey_orbit(small_survey, 0), 7)
    with pytest.raises(InputError, match=r"expected no exposure in two orbits, .*\(0, 7\)"):
        append_orbit(growing.directory, copy)
    with pytest.raises(InputError, match="orbit -1: expected an orbit_id of 0 or more"):
        append_orbit(growing.directory, renumbered(copy, -1, days=3.0))
    assert survey_orbits(growing.directory) == [0]


def test_exposures_of_other_orbits_may_be_wrong(small_survey, tmp_path):
    survey = tmp_path / "survey"
    shutil.copytree(small_survey, survey)
    (survey / MANIFEST).unlink()
    exposures = pd.read_parquet(survey / EXPOSURES)
    exposures.loc[exposures["orbit_id"] == 1, "ra_est"] = float("nan")
    exposures.to_parquet(survey / EXPOSURES, index=False)
    assert_equal(read_survey_orbit(survey, 0), read_survey_orbit(small_survey, 0))
    with pytest.raises(InputError, match="column 'ra_est': expected"):
        read_survey_orbit(survey, 1)
