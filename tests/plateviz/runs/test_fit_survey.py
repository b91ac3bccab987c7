"""Fits of a small survey: with one and two workers, interrupted, and with a damaged orbit."""

import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pandas as pd
import pytest
from distributed import LocalCluster

from plateviz.cli.paper_survey import reproduced
from plateviz.cli.survey import parse_orbits
from plateviz.runs import fit_survey as fit_survey_module
from plateviz.runs.fit_survey import fit_survey, gather
from plateviz.runs.gathered_diagnosis import write_test_tables
from plateviz.runs.new_run import begin_run
from plateviz.runs.run import Run, open_run, survey_runs
from plateviz.runs.run_directory import RunDirectory
from plateviz.runs.run_tables import read_run_tests, read_run_verdict
from solver.data.run_schema import RUN_TABLES
from solver.data.settings import FitSettings
from solver.data.survey_schema import ERRORS_BY_COUNT, HISTORY, MOTIONS, RUN_ORBITS
from solver.errors import InputError
from solver.io.survey import measurement_path
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey

pytestmark = pytest.mark.slow

SETTINGS = FitSettings()


def contents(run):
    """Return the bytes of every file of a run, except files of timings."""
    paths = sorted(path for path in run.directory.rglob("*") if path.is_file())
    return {
        str(path.relative_to(run.directory)): path.read_bytes()
        for path in paths
        if path.name != "timings.json"
    }


@pytest.fixture(scope="module")
def report(fitted_survey):
    return fit_survey(fitted_survey, "one", SETTINGS, workers=1)


@pytest.fixture(scope="module")
def run(report):
    return Run(report.run)


def test_every_orbit_is_fitted(report):
    assert report.fitted == [0, 1, 2]
    assert (report.kept, report.failed) == ([], {})
    assert report.run.is_complete


@pytest.mark.full
def test_results_do_not_depend_on_the_number_of_workers(report, fitted_survey):
    other = fit_survey(fitted_survey, "two", SETTINGS, workers=2)
    one, two = contents(report.run), contents(other.run)
    assert one.keys() == two.keys()
    assert [name for name in one if one[name] != two[name]] == []


def test_complete_run_is_not_changed(report, fitted_survey):
    before = {p: p.stat().st_mtime_ns for p in report.run.directory.rglob("*")}
    again = fit_survey(fitted_survey, "one", SETTINGS)
    assert (again.fitted, again.kept) == ([], [0, 1, 2])
    assert {p: p.stat().st_mtime_ns for p in report.run.directory.rglob("*")} == before


@pytest.mark.usefixtures("without_workers")
def test_orbit_without_a_solution_says_what_to_do(tmp_path):
    survey = tmp_path / "sky"
    settings = SurveySettings(orbits=1, seed=3, defects=("swapped=5%",)).scaled(4_000)
    simulate_survey(survey, settings)
    failed = fit_survey(survey, "swapped", SETTINGS, workers=1).failed
    assert failed[0].endswith(
        "before the steps became small. Measurements have each other's identification: let the "
        "fit find, list and leave them out (--robust)"
    )


@pytest.mark.usefixtures("without_workers")
def test_orbit_that_was_ended_early_says_that_only(fitted_survey):
    hurried = SETTINGS.with_(max_iterations=1)
    failed = fit_survey(fitted_survey, "hurried", hurried, [0], workers=1).failed
    assert failed[0].endswith("before the steps became small")


def test_run_in_parts_and_with_a_failed_orbit_ends_as_the_same_run(report, fitted_survey):
    seen = []
    path = measurement_path(fitted_survey, 1)
    whole = path.read_bytes()
    path.write_bytes(whole[:1000])
    try:
        broken = fit_survey(fitted_survey, "parts", SETTINGS, [1, 2], 1, progress=seen.append)
        assert broken.fitted == [2]
        assert list(broken.failed) == [1]
        assert "orbit=0001.parquet" in broken.failed[1]
        assert not broken.run.is_complete
        assert [step.done for step in seen] == [0, 1, 2]
        assert len(Run(broken.run).motions()) > 0
        table = Run(broken.run).orbits().set_index("orbit_id")
        assert table["status"].tolist() == ["missing", "failed", "complete"]
        has_fitted = [Run(broken.run).has_fitted(orbit) for orbit in table.index]
        assert has_fitted == [False, False, True]
        assert "orbit=0001.parquet" in table.loc[1, "message"]
    finally:
        path.write_bytes(whole)
    rest = fit_survey(fitted_survey, "parts", SETTINGS, workers=1)
    assert (rest.fitted, rest.kept) == ([0, 1], [2])
    assert rest.run.is_complete
    assert contents(rest.run) == contents(report.run)


@pytest.mark.full
def test_killed_run_continues_with_the_missing_orbits(report, fitted_survey):
    command = [sys.executable, "-m", "plateviz.cli.main", "survey", str(fitted_survey)]
    process = subprocess.Popen([*command, "--run", "killed"], start_new_session=True)
    killed = RunDirectory(fitted_survey, "killed")
    deadline = time.monotonic() + 120.0
    while not killed.complete_orbits() and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    there = killed.complete_orbits()
    resumed = fit_survey(fitted_survey, "killed", SETTINGS)
    assert resumed.kept == there
    assert there
    assert contents(killed) == contents(report.run)


@pytest.mark.full
def test_run_killed_before_gathering_is_completed(report, fitted_survey):
    late = fit_survey(fitted_survey, "late", SETTINGS, [0], 1).run
    for orbit in (1, 2):
        shutil.copytree(report.run.orbit_directory(orbit), late.orbit_directory(orbit))
    assert fit_survey(fitted_survey, "late", SETTINGS).fitted == []
    assert late.is_complete
    assert contents(late) == contents(report.run)


def test_run_without_all_of_its_test_tables_is_not_judged_as_gathered(
    report, fitted_survey, monkeypatch
):
    directory = shutil.copytree(report.run.directory, fitted_survey / "runs" / "gathering")
    partial = RunDirectory(fitted_survey, "gathering")
    kept = {table.name: directory / f"{table.name}.parquet" for table in RUN_TABLES}
    for name in ("COMPLETE", "gathered.json", "motions.parquet"):
        (directory / name).unlink()
    for file in kept.values():
        file.unlink()
    seen = []

    def write_tables(run):
        write_test_tables(run)
        seen.append((run.is_gathered, read_run_verdict(Run(run)).state))

    monkeypatch.setattr(fit_survey_module, "write_test_tables", write_tables)
    gather(partial)
    assert seen == [(False, "warn")]
    assert partial.is_gathered
    assert all(file.is_file() for file in kept.values())
    shutil.rmtree(directory)


def test_orbits_table_follows_the_schema(run):
    table = run.orbits()
    assert list(table.columns) == RUN_ORBITS.names
    assert (table["status"] == "complete").all()
    assert (np.abs(table["chi2_per_dof"] - 1.0) < 6.0 * np.sqrt(2.0 / table["dof"])).all()


def test_history_of_a_source_agrees_with_its_orbits(run):
    counts = run.counts()
    often = int(counts.loc[counts["n_orbits"].idxmax(), "source_id"])
    history = run.history(often)
    assert list(history.columns) == HISTORY.names
    assert len(history) == counts["n_orbits"].max()
    assert history["epoch"].is_monotonic_increasing
    for row in history.itertuples():
        sources = run.result(row.orbit_id).sources.set_index("source_id")
        assert sources.loc[often, "ra"] == row.ra
    assert run.history(1).empty


def test_source_is_found_by_a_numpy_id(run):
    found = run.motions()["source_id"].iloc[0]
    assert isinstance(found, np.integer)
    assert set(run.history(found)["source_id"]) == {found}
    assert run.motion(found)["source_id"] == found


def test_motions_include_every_source(run):
    motions, counts = run.motions(), run.counts()
    assert list(motions.columns) == MOTIONS.names
    pd.testing.assert_frame_equal(motions[counts.columns.tolist()], counts)
    row = run.motion(int(counts["source_id"].iloc[3]))
    assert row["source_id"] == counts["source_id"].iloc[3]
    assert run.motion(1) is None


def test_errors_by_count_are_of_the_artificial_sources(run):
    errors = run.errors_by_count()
    assert list(errors.columns) == ERRORS_BY_COUNT.names
    assert errors["n_orbits"].iloc[0] == 1


def test_run_is_tested_from_its_own_tables(run):
    tests = read_run_tests(run)
    frames = tests.calibrations, tests.orbit_tests, tests.orbit_causes, tests.zonal
    for table, frame in zip(RUN_TABLES, frames, strict=True):
        assert list(frame) == table.names
    assert set(tests.calibrations["orbit_id"]) == {0, 1, 2}
    assert set(tests.orbit_causes["orbit_id"]) == {0, 1, 2}
    stored = run.result(1).summary["verdict"]["tests"]
    of_orbit = tests.orbit_tests[tests.orbit_tests["orbit_id"] == 1]
    assert list(of_orbit["name"]) == [test["name"] for test in stored]
    assert list(of_orbit["sigma"]) == [test["sigma"] for test in stored]
    # Three orbits are too few to look for smooth errors of the catalogue.
    assert tests.zonal.empty
    verdict = read_run_verdict(run)
    assert verdict.state in ("good", "warn")
    assert any("takes eight orbits" in sentence for sentence in verdict.reasons)


def test_statistics_of_classes_agree_with_their_sources(run):
    classes, motions = run.classes(often=2), run.motions()
    others = motions[~motions["is_reference"] & ~motions["is_artificial"]]
    squares = others["n_orbits"] * others["rms_truth_2d"] ** 2
    expected = np.sqrt(squares.sum() / others["n_orbits"].sum() / 2.0)
    assert classes.loc["non-reference", "rms_deviation"] == pytest.approx(expected)
    assert classes.loc["non-reference", "sigma_single"] == pytest.approx(4.0, rel=1e-3)


def test_paper_is_reproduced_from_an_existing_run(run, fitted_survey):
    before = contents(RunDirectory(fitted_survey, run.name))
    table = reproduced(fitted_survey, run.name, None).set_index("quantity")
    assert table.loc["uncertainty times sqrt(N)", "ratio"] == pytest.approx(1.0, abs=1e-3)
    assert table.loc["time per orbit", "ratio"] < 1.0
    assert contents(RunDirectory(fitted_survey, run.name)) == before


def test_runs_are_found_by_name(run, fitted_survey):
    assert open_run(fitted_survey, "one").directory == run.directory
    assert "one" in [found.name for found in survey_runs(fitted_survey)]
    with pytest.raises(InputError, match=r"expected a run 'none', found .*one"):
        open_run(fitted_survey, "none")


def test_unreadable_table_is_reported(fitted_survey):
    torn = begin_run(fitted_survey, "torn", SETTINGS)
    (torn.directory / "history.parquet").write_bytes(b"PAR1")
    with pytest.raises(InputError, match=r"history\.parquet: expected a table of plateviz, found"):
        Run(torn).history(1)


def test_new_run_is_empty(fitted_survey):
    empty = Run(begin_run(fitted_survey, "empty", SETTINGS))
    assert empty.history(1).empty
    assert empty.counts().empty
    assert empty.motions().empty
    assert empty.errors_by_count() is None
    assert empty.motion(1) is None
    assert (empty.orbits()["status"] == "missing").all()


def test_unknown_orbit_is_refused(fitted_survey):
    with pytest.raises(InputError, match="expected orbits out of 0 to 2, found 7"):
        fit_survey(fitted_survey, "one", SETTINGS, [1, 7])


@pytest.mark.full
def test_workers_of_a_scheduler_give_the_same_run(report, fitted_survey):
    with LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0", memory_limit=0
    ) as cluster:
        address = cluster.scheduler_address
        other = fit_survey(fitted_survey, "cluster", SETTINGS, scheduler=address)
    assert contents(other.run) == contents(report.run)


def test_scheduler_that_does_not_answer_is_refused(fitted_survey, monkeypatch):
    monkeypatch.setattr("plateviz.runs.dask_workers._TIMEOUT", "1s")
    with pytest.raises(InputError, match="--scheduler: expected the address"):
        fit_survey(fitted_survey, "nowhere", SETTINGS, scheduler="tcp://127.0.0.1:9")


@pytest.mark.parametrize(
    ("text", "orbits"), [(None, None), ("3", [3]), ("0-2,7", [0, 1, 2, 7])], ids=str
)
def test_orbits_are_parsed_from_ranges(text, orbits):
    assert parse_orbits(text) == orbits


def test_range_that_no_survey_has_is_refused():
    with pytest.raises(InputError, match="--orbits: expected fewer than 1,000,000, found '0-99999"):
        parse_orbits("3,0-99999999999999")


@pytest.mark.parametrize("text", ["", "a", "3-1", "1-2-3", "1,,2"])
def test_text_that_is_not_a_range_is_refused(text):
    with pytest.raises(InputError, match="--orbits: expected numbers and ranges"):
        parse_orbits(text)
