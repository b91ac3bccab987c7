"""Damaged files of surveys and runs: refused by name, never read as changed, and repaired."""

import re
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from plateviz.runs.fit_survey import fit_survey
from plateviz.runs.run import Run
from plateviz.runs.run_directory import RunDirectory
from solver.data.instrument import write_instrument
from solver.data.schema import ENVIRONMENT, MEASUREMENT
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io.survey import (
    EXPOSURES,
    measurement_path,
    read_survey_instrument,
    read_survey_orbit,
    read_survey_table,
    survey_orbits,
    write_survey_table,
)
from solver.io.survey_header import read_header, write_header
from tests.fitting import fitting_in_this_process

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("without_workers")]

# Flips of one bit at places spread over a file; the quick share of a campaign.
FLIPS = 6


@pytest.fixture(scope="module")
def whole(made_survey, tmp_path_factory):
    """A survey of three orbits with a complete run."""
    survey = shutil.copytree(made_survey, tmp_path_factory.mktemp("whole") / "survey")
    with fitting_in_this_process():
        fit_survey(survey, "default", FitSettings(order=3), workers=1)
    return survey


@pytest.fixture
def survey(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "survey")


def contents(folder):
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in paths
        if path.name != "timings.json"
    }


def flip(path, position, bit=3):
    content = bytearray(path.read_bytes())
    content[position] ^= 1 << bit
    path.write_bytes(content)


def positions(path, seed):
    return np.random.default_rng(seed).integers(0, path.stat().st_size, FLIPS)


def read_all(run):
    """Read a run as the dashboard and the reports do."""
    opened = Run(run)
    opened.header()
    opened.orbits()
    for orbit in run.complete_orbits():
        opened.result(orbit)
    motions = opened.motions()
    opened.counts()
    opened.errors_by_count()
    opened.classes(1)
    for source in motions["source_id"].iloc[:: len(motions) // 3]:
        opened.history(source)
        opened.motion(source)


def test_whole_run_has_no_changes(whole):
    run = RunDirectory(whole, "default")
    assert run.changes() == []
    read_all(run)


@pytest.mark.parametrize(
    "name", ["measurements/orbit=0001.parquet", "reference.parquet", "survey.toml"]
)
def test_flipped_bit_of_a_survey_is_refused_by_name(run, survey, name):
    path = survey / name
    intact = path.read_bytes()
    for position in positions(path, 1):
        path.write_bytes(intact)
        flip(path, position)
        with pytest.raises(InputError, match=re.escape(name.rpartition("/")[2])):
            read_survey_orbit(survey, 1)
        code, out, _ = run("inspect", survey)
        assert code == 2
        assert str(path) in out.replace("\n", "")


def test_missing_measurements_are_found(run, survey):
    measurement_path(survey, 2).unlink()
    code, out, _ = run("inspect", survey)
    assert code == 2
    assert "orbit=0002.parquet: expected the file that was written, found none" in out
    assert "  orbits: 3\n" in out
    assert "  orbits solved in the run default: 3\n" in out


def test_fitted_orbit_without_a_manifest_is_named(run, survey):
    manifest = survey / "runs" / "default" / "orbit=0001" / "COMPLETE"
    manifest.unlink()
    code, out, _ = run("inspect", survey)
    assert code == 2
    assert f"{manifest}: the manifest of a fitted orbit is missing" in out.replace("\n", "")
    assert RunDirectory(survey, "default").remove_damaged() == [1]
    assert not manifest.parent.exists()


@pytest.mark.parametrize(
    "name",
    [
        "orbit=0001/sources.parquet",
        "orbit=0001/residuals.parquet",
        "orbit=0001/result.json",
        "orbit=0001/timings.json",
        "motions.parquet",
        "history.parquet",
        "run.toml",
    ],
)
def test_flipped_bit_of_a_run_is_refused_by_name(survey, name):
    run = RunDirectory(survey, "default")
    path = run.directory / name
    intact = path.read_bytes()
    for position in positions(path, 2):
        path.write_bytes(intact)
        flip(path, position)
        with pytest.raises(InputError, match=re.escape(path.name)):
            read_all(run)
        assert any(path.name in message for message in run.changes())
        with pytest.raises(InputError, match=re.escape(path.name)):
            fit_survey(survey, "default", FitSettings(order=3))


def test_page_of_the_history_is_checked_where_the_file_is_not(survey):
    """Reading one source does not read the whole file, and yet no changed value is returned."""
    run = Run(RunDirectory(survey, "default"))
    path = run.directory / "history.parquet"
    intact, sources = path.read_bytes(), run.motions()["source_id"]
    before = {source: run.history(source) for source in sources.iloc[::40]}
    for position in positions(path, 3):
        path.write_bytes(intact)
        flip(path, position)
        for source, expected in before.items():
            try:
                found = run.history(source)
            except InputError:
                continue
            assert found.equals(expected)


def test_history_of_a_run_that_is_gone_is_refused_in_words(survey):
    run = Run(RunDirectory(survey, "default"))
    source = run.motions()["source_id"].iloc[0]
    assert len(run.history(source)) > 0
    shutil.rmtree(run.directory)
    with pytest.raises(InputError, match="default: expected fitted orbits, found none any more"):
        run.history(source)


@pytest.mark.parametrize(
    "name",
    [
        "orbit=0001/sources.parquet",
        pytest.param("orbit=0001/COMPLETE", marks=pytest.mark.full),
        "history.parquet",
        "COMPLETE",
    ],
)
def test_repaired_run_has_the_same_bytes(whole, survey, name):
    run = RunDirectory(survey, "default")
    path = run.directory / name
    flip(path, path.stat().st_size // 2)
    report = fit_survey(survey, "default", FitSettings(order=3), workers=1, repair=True)
    assert report.fitted == ([1] if name.startswith("orbit") else [])
    assert run.changes() == []
    assert contents(run.directory) == contents(RunDirectory(whole, "default").directory)


def test_orbit_is_not_removed_if_it_could_not_be_fitted_again(survey):
    run = RunDirectory(survey, "default")
    flip(run.orbit_directory(1) / "timings.json", 20)
    flip(measurement_path(survey, 1), 2000)
    before = contents(survey)
    with pytest.raises(InputError, match=r"measurements/orbit=0001\.parquet: expected the file"):
        fit_survey(survey, "default", FitSettings(order=3), workers=1, repair=True)
    assert contents(survey) == before
    assert run.complete_orbits() == [0, 1, 2]


def test_repair_of_a_whole_run_changes_nothing(survey):
    directory = RunDirectory(survey, "default").directory
    before = {path: path.stat().st_mtime_ns for path in directory.rglob("*")}
    fit_survey(survey, "default", FitSettings(order=3), repair=True)
    assert {path: path.stat().st_mtime_ns for path in directory.rglob("*")} == before


def test_run_of_an_older_version_without_manifests_is_read(survey):
    run = RunDirectory(survey, "default")
    for complete in [run.directory / "COMPLETE", *run.directory.glob("orbit=*/COMPLETE")]:
        complete.write_text("")
    (survey / "manifest.sha256").unlink()
    read_all(run)
    assert survey_orbits(survey) == [0, 1, 2]
    assert run.changes() == []


def test_survey_with_another_instrument_now_shows_none_of_its_solutions(survey):
    header = dict(read_header(survey))
    camera = replace(read_survey_instrument(survey), focal_length_um=2e6)
    (survey / "manifest.sha256").unlink()
    write_header(survey, {**header, "instrument": write_instrument(camera)})
    with pytest.raises(InputError, match="orbit 0: expected a solution with the instrument of the"):
        Run(RunDirectory(survey, "default")).result(0)


def test_source_is_found_once_its_orbit_is_fitted(survey):
    run, history = RunDirectory(survey, "default"), survey / "hidden"
    source = Run(run).motions()["source_id"].iloc[0]
    run.directory.rename(history)
    opened = Run(run)
    run.directory.mkdir()
    assert opened.history(source).empty
    run.directory.rmdir()
    history.rename(run.directory)
    assert not opened.history(source).empty


def test_orbit_whose_measurements_were_changed_is_fitted_again_by_a_repair(survey):
    path = measurement_path(survey, 1)
    measurements = read_survey_table(path, MEASUREMENT)
    write_survey_table(measurements.iloc[:-1], MEASUREMENT, path)
    (survey / "manifest.sha256").unlink()
    settings = FitSettings(order=3)
    with pytest.raises(InputError, match=r"0001\.parquet: expected the measurements that run"):
        fit_survey(survey, "default", settings, workers=1)
    report = fit_survey(survey, "default", settings, workers=1, repair=True)
    assert report.fitted == [1]
    assert len(Run(report.run).result(1).residuals) == len(measurements) - 1


def test_copied_orbit_is_refused(survey):
    (survey / "manifest.sha256").unlink()
    exposures = read_survey_table(survey / EXPOSURES, ENVIRONMENT)
    copy = exposures[exposures["orbit_id"] == 0].assign(orbit_id=7)
    write_survey_table(pd.concat([exposures, copy]), ENVIRONMENT, survey / EXPOSURES)
    with pytest.raises(InputError, match=r"expected no exposure in two orbits, .*\(0, 7\)"):
        fit_survey(survey, "another", FitSettings(order=3), workers=1)


def test_solution_of_another_orbit_is_refused(survey):
    files = RunDirectory(survey, "default")
    shutil.rmtree(files.orbit_directory(1))
    shutil.copytree(files.orbit_directory(0), files.orbit_directory(1))
    opened = Run(files)
    with pytest.raises(InputError, match=r"orbit=0001: expected orbit 1, found 0; remove the dir"):
        opened.result(1)
    assert set(opened.result(0).exposures["orbit_id"]) == {0}


def test_solution_is_not_removed_where_its_measurements_cannot_be_fitted_again(survey):
    path, settings = measurement_path(survey, 1), FitSettings(order=3)
    (survey / "manifest.sha256").unlink()
    before = contents(survey / "runs")
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match=r"orbit=0001\.parquet"):
        fit_survey(survey, "default", settings, workers=1, repair=True)
    path.unlink()
    for repair in (False, True):
        report = fit_survey(survey, "default", settings, workers=1, repair=repair)
        assert (report.fitted, report.failed) == ([], {})
    assert contents(survey / "runs") == before
