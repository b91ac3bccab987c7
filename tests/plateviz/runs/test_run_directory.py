"""Runs of a survey: created once, continued, never changed."""

import pytest

from plateviz.runs.new_run import begin_run
from plateviz.runs.run import Run, RunProgress
from plateviz.runs.run_directory import run_directories
from plateviz.tables import source_list
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io.survey import survey_orbits

ODD = FitSettings(
    prior_widths={"position_angle": float("inf")}, prior_shifts={"detector_x[2]": -5.0}
)


def test_run_stores_its_settings(survey_folder):
    run = begin_run(survey_folder, "odd", ODD)
    assert run.settings() == ODD
    assert begin_run(survey_folder, "odd", ODD) == run
    assert not run.is_complete
    assert run.complete_orbits() == []
    assert run in run_directories(survey_folder)


def test_run_with_other_settings_is_refused(survey_folder):
    begin_run(survey_folder, "one", FitSettings())
    with pytest.raises(InputError, match=r"run\.toml: expected .* found other settings \(order\)"):
        begin_run(survey_folder, "one", FitSettings(order=4))


def test_run_with_other_inputs_is_refused(survey_folder):
    begin_run(survey_folder, "inputs", FitSettings())
    with (survey_folder / "survey.toml").open("a", encoding="utf-8") as header:
        header.write("# changed\n")
    (survey_folder / "manifest.sha256").unlink()
    with pytest.raises(InputError, match=r"found other inputs \(survey\.toml\)"):
        begin_run(survey_folder, "inputs", FitSettings())


@pytest.mark.parametrize("name", ["", "../up", ".hidden", "a b", "a/b", 101 * "a"])
def test_invalid_folder_name_is_refused(survey_folder, name):
    with pytest.raises(InputError, match="--run: expected a name"):
        begin_run(survey_folder, name, FitSettings())


def test_folder_that_is_not_a_run_is_refused(survey_folder):
    (survey_folder / "runs" / "mine").mkdir(parents=True)
    (survey_folder / "runs" / "mine" / "notes.txt").write_text("keep", encoding="utf-8")
    with pytest.raises(InputError, match="expected a run, found a folder without"):
        begin_run(survey_folder, "mine", FitSettings())


def test_folder_that_is_not_a_survey_has_no_runs(tmp_path):
    assert run_directories(tmp_path) == []
    with pytest.raises(InputError, match=r"expected a survey with a file survey\.toml"):
        begin_run(tmp_path, "one", FitSettings())


def test_failure_is_recorded_until_the_orbit_is_fitted(survey_folder, fit_result):
    run = begin_run(survey_folder, "failing", FitSettings())
    run.keep_failure(1, "orbit 1: no light")
    assert run.failures() == {1: "orbit 1: no light"}
    run.keep(1, fit_result, {"history": fit_result.sources})
    assert run.failures() == {}
    assert run.complete_orbits() == [1]


def test_what_is_written_is_counted(survey_folder, fit_result):
    run = begin_run(survey_folder, "counted", FitSettings())
    n_orbits = len(survey_orbits(survey_folder))
    assert Run(run).progress() == RunProgress(n_orbits, 0, 0, False, False)
    run.keep_failure(1, "orbit 1: no light")
    run.keep(0, fit_result, {"history": fit_result.sources})
    assert Run(run).progress() == RunProgress(n_orbits, 1, 1, False, False)


def test_incomplete_orbit_is_not_listed(survey_folder):
    run = begin_run(survey_folder, "half", FitSettings())
    run.orbit_directory(0).mkdir()
    (run.orbit_directory(0) / "history.parquet").touch()
    assert run.complete_orbits() == []


def test_begun_run_has_no_sources_yet(survey_folder):
    """A page opened just then shows an empty list."""
    run = Run(begin_run(survey_folder, "begun", FitSettings()))
    assert not run.is_gathered
    assert source_list(run.counts()).empty
