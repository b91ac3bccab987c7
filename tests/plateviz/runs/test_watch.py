"""A watched survey: orbits that arrive, are being written, damaged or changed; its ends."""

import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pandas as pd
import pytest

from plateviz.runs import dask_workers, fit_survey, watch
from plateviz.runs.fitted_exposures import FittedExposures
from plateviz.runs.new_run import begin_run
from plateviz.runs.run_directory import RunDirectory
from plateviz.runs.watch import Ends, Watch
from plateviz.verdict.verdict import with_verdict
from solver.data.schema import ENVIRONMENT
from solver.data.settings import FitSettings
from solver.errors import FitError, InputError
from solver.io.lock import locked
from solver.io.survey import (
    EXPOSURES,
    REFERENCE,
    measurement_path,
    read_survey_orbit,
    read_survey_table,
    write_survey_table,
)
from solver.io.survey_manifest import MANIFEST, survey_changes
from tests.solver.growing_survey import GrowingSurvey

pytestmark = pytest.mark.usefixtures("without_workers")

ONCE = Ends(at_once=True)


@pytest.fixture
def growing(made_survey, tmp_path):
    return GrowingSurvey(made_survey, tmp_path / "survey", 1)


@pytest.fixture
def fits(monkeypatch, fit_result):
    """Replace the fit of an orbit by one that reads it, or is refused: id -> reason."""
    refused = {}

    def fit(run, orbit):
        read = read_survey_orbit(run.survey, orbit)
        if orbit in refused:
            reason = refused[orbit]
            raise FitError(reason() if callable(reason) else reason)
        result = with_verdict(replace(fit_result, provenance=read.provenance))
        run.keep(orbit, result, {"history": fit_result.sources[["source_id"]]})

    monkeypatch.setattr(dask_workers, "_fit", fit)
    monkeypatch.setattr(fit_survey, "gather", lambda _: None)
    return refused


@pytest.fixture
def watched(growing, monkeypatch):
    """Return the function that watches: at each pause it takes a step, after the last Ctrl-C."""

    def call(*steps, name="watched", ends=None, settings=None):
        said, left = [], iter(steps)

        def pause(_):
            step = next(left, None)
            if step is None:
                raise KeyboardInterrupt
            step()

        monkeypatch.setattr(watch, "sleep", pause)
        watcher = Watch(growing.directory, name, settings or FitSettings(), 1, said.append)
        try:
            watcher.run(1.0, ends or Ends())
        except KeyboardInterrupt:
            assert ends is None
        finally:
            watcher.end()
        return [(event.kind, event.orbit, event.message) for event in said]

    return call


def nothing():
    pass


def kinds(said):
    left_out = ("watching", "fitting", "ended")
    return [(kind, orbit) for kind, orbit, _ in said if kind not in left_out]


def message(said, kind):
    (found,) = [words for one, _, words in said if one == kind]
    return found


@pytest.mark.usefixtures("fits")
def test_orbits_are_fitted_as_they_arrive_and_a_restart_goes_on(growing, watched):
    said = watched(lambda: growing.append(1))
    assert kinds(said) == [("fitted", 0), ("fitted", 1)]
    assert "ended; 2 orbits fitted" in message(said, "ended")
    # A first fit may take half a minute, in which the watch would seem to do nothing.
    begun = [words for kind, _, words in said if kind in ("fitting", "fitted")]
    assert begun[::2] == ["1 orbit is being fitted"] * 2
    said = watched(lambda: growing.append(2))
    assert "2 orbits are fitted already" in message(said, "watching")
    assert kinds(said) == [("fitted", 2)]
    run = RunDirectory(growing.directory, "watched")
    assert run.complete_orbits() == [0, 1, 2]
    assert (run.grows, run.is_complete) == (True, False)


@pytest.mark.usefixtures("fits")
def test_three_writers_at_once_add_their_orbits_and_one_orbit_once(growing, watched):
    refused = []

    def write(orbit):
        try:
            growing.append(orbit)
        except InputError as error:
            refused.append(str(error))

    def write_at_once():
        with ThreadPoolExecutor(3) as writers:
            list(writers.map(write, (1, 2, 2)))

    said = watched(write_at_once)
    assert kinds(said) == [("fitted", 0), ("fitted", 1), ("fitted", 2)]
    assert len(refused) == 1
    assert "that the survey does not have, found 2" in refused[0]
    assert survey_changes(growing.directory) == []


@pytest.mark.usefixtures("fits")
def test_file_that_is_being_copied_waits_for_its_line_of_the_manifest(growing, watched):
    whole = growing.content(1)
    said = watched(
        lambda: growing.file(1).write_bytes(whole[:5000]),
        lambda: growing.file(1).write_bytes(whole),
        nothing,
        growing.file(1).unlink,
        lambda: growing.append(1),
    )
    assert kinds(said) == [("fitted", 0), ("waiting", 1), ("fitted", 1)]
    assert "manifest.sha256 does not list measurements/orbit=0001.parquet" in message(
        said, "waiting"
    )


@pytest.mark.usefixtures("fits")
def test_without_a_manifest_a_file_is_whole_once_it_rests(made_survey, growing, watched):
    (growing.directory / MANIFEST).unlink()
    shutil.copy(made_survey / EXPOSURES, growing.directory / EXPOSURES)
    whole = growing.content(1)
    said = watched(
        nothing,
        lambda: growing.file(1).write_bytes(whole[:5000]),
        lambda: growing.file(1).write_bytes(whole[:9000]),
        nothing,
        lambda: growing.file(1).write_bytes(whole),
        nothing,
    )
    assert kinds(said) == [
        ("waiting", 0),
        ("fitted", 0),
        ("waiting", 1),
        ("damaged", 1),
        ("waiting", 1),
        ("fitted", 1),
    ]


@pytest.mark.usefixtures("fits")
def test_damaged_orbit_is_told_once_and_fitted_when_it_is_mended(growing, watched):
    def damage():
        growing.append(1)
        growing.file(1).write_bytes(growing.content(1)[:-1] + b"?")

    said = watched(
        damage, nothing, nothing, lambda: growing.file(1).write_bytes(growing.content(1))
    )
    assert kinds(said)[1:] == [("waiting", 1), ("damaged", 1), ("fitted", 1)]
    assert "orbit=0001.parquet is not the file that manifest.sha256 lists" in message(
        said, "damaged"
    )


def test_orbit_without_a_solution_is_told_once_and_tried_again_when_it_changes(
    growing, watched, fits
):
    fits[1] = "the fit has no solution"

    def change():
        fits.clear()
        growing.file(1).touch()

    said = watched(lambda: growing.append(1), nothing, nothing, change)
    assert kinds(said) == [("fitted", 0), ("failed", 1), ("fitted", 1)]
    assert message(said, "failed") == "the fit has no solution"


def test_failure_of_an_orbit_that_is_written_meanwhile_is_not_told(growing, watched, fits):
    def write():
        fits.clear()
        growing.file(0).touch()
        return "read while it was written"

    fits[0] = write
    assert kinds(watched(nothing)) == [("fitted", 0)]


@pytest.mark.usefixtures("fits")
def test_changed_orbit_is_named_and_keeps_its_solution(growing, watched):
    watched(lambda: growing.append(1))
    run = RunDirectory(growing.directory, "watched")
    before = {path: path.stat().st_mtime_ns for path in run.directory.glob("orbit=*/*")}
    whole = growing.file(0).read_bytes()

    def exchange():
        growing.file(0).write_bytes(growing.content(1))
        growing.write_manifest()

    said = watched(nothing, exchange, nothing)
    assert kinds(said) == [("changed", 0)]
    assert "another --run NAME fits it as it is now" in message(said, "changed")
    # A new watch knows it too, and the same bytes are no change.
    assert kinds(watched(nothing)) == [("changed", 0)]
    growing.file(0).write_bytes(whole)
    growing.write_manifest()
    assert kinds(watched(lambda: growing.file(0).touch(), growing.file(1).unlink)) == [
        ("changed", 1)
    ]
    assert {p: p.stat().st_mtime_ns for p in run.directory.glob("orbit=*/*")} == before


def change_exposures(growing, orbit):
    path = growing.directory / EXPOSURES
    table = read_survey_table(path, ENVIRONMENT)
    table.loc[table["orbit_id"] == orbit, "ra_est"] += 1e-6
    write_survey_table(table, ENVIRONMENT, path)
    growing.write_manifest()


@pytest.mark.usefixtures("fits")
def test_exposures_that_change_are_named_once_by_each_watch(growing, watched):
    said = watched(lambda: change_exposures(growing, 0), nothing)
    assert kinds(said) == [("fitted", 0), ("changed", 0)]
    assert "its exposures in exposures.parquet are others" in message(said, "changed")
    said = watched(lambda: growing.append(1), nothing)
    assert kinds(said) == [("changed", 0), ("fitted", 1)]


@pytest.mark.usefixtures("fits")
def test_exposures_that_change_between_two_watches_are_named(growing, watched):
    watched(lambda: growing.append(1))
    # Those of other orbits are no change of these.
    growing.append(2)
    assert kinds(watched(ends=ONCE)) == [("fitted", 2)]
    change_exposures(growing, 1)
    assert kinds(watched(ends=ONCE)) == [("changed", 1)]


@pytest.mark.usefixtures("fits")
def test_exposures_that_were_written_after_the_look_and_before_the_fit_are_no_change(
    growing, watched, monkeypatch
):
    record = FittedExposures.record

    def change_then(self, digests):
        record(self, dict.fromkeys(digests, "of the look"))

    monkeypatch.setattr(FittedExposures, "record", change_then)
    assert kinds(watched(nothing)) == [("fitted", 0)]


@pytest.mark.usefixtures("fits")
def test_damaged_record_of_exposures_is_named(growing, watched):
    watched(ends=ONCE)
    (RunDirectory(growing.directory, "watched").directory / "exposures.json").write_text("[]")
    with pytest.raises(InputError, match=r"exposures.json: expected digests of exposures"):
        watched(ends=ONCE)


@pytest.mark.usefixtures("fits")
def test_table_of_all_orbits_that_is_being_written_lets_the_survey_wait(growing, watched):
    path = growing.directory / EXPOSURES
    whole = path.read_bytes()
    said = watched(
        lambda: path.write_bytes(whole[:100]),
        nothing,
        lambda: path.write_bytes(whole),
        lambda: growing.append(2),
    )
    assert kinds(said) == [("fitted", 0), ("waiting", None), ("fitted", 2)]


@pytest.mark.usefixtures("fits")
def test_listed_file_that_is_not_there_and_a_wrong_name_are_told(growing, watched):
    def step():
        growing.append(1)
        growing.file(1).rename(growing.file(1).with_name("orbit=01.parquet"))

    said = watched(step)
    assert kinds(said) == [("fitted", 0), ("damaged", None), ("waiting", 1)]
    assert "its name is not orbit=0001.parquet" in message(said, "damaged")
    assert "which is not there yet" in message(said, "waiting")


@pytest.mark.usefixtures("fits")
def test_run_is_completed_when_the_awaited_orbits_are_done(growing, watched):
    said = watched(lambda: growing.append(1), ends=Ends(until=2))
    assert kinds(said) == [("fitted", 0), ("fitted", 1), ("complete", None)]
    run = RunDirectory(growing.directory, "watched")
    assert run.is_complete
    assert kinds(watched(ends=Ends(until=2))) == [("complete", None)]
    growing.append(2)
    with pytest.raises(InputError, match="found a complete one, which is not changed; orbit 2"):
        watched()
    assert run.complete_orbits() == [0, 1]


@pytest.mark.usefixtures("fits")
def test_open_run_is_closed_by_a_fit_of_the_whole_survey(growing, watched):
    watched(ends=ONCE)
    growing.append(1)
    report = fit_survey.fit_survey(growing.directory, "watched", FitSettings(), workers=1)
    assert (report.fitted, report.kept) == ([1], [0])
    assert report.run.is_complete


@pytest.mark.usefixtures("fits")
def test_run_of_the_orbits_that_there_were_is_refused(growing, watched):
    begin_run(growing.directory, "default", FitSettings())
    with pytest.raises(InputError, match="expected a run that `plateviz watch` began"):
        watched(name="default")


@pytest.mark.usefixtures("fits")
def test_second_watch_of_a_run_is_refused(growing, watched):
    run = begin_run(growing.directory, "watched", FitSettings(), grows=True)
    with (
        locked(run.directory),
        pytest.raises(InputError, match="that another process is fitting; wait for it"),
    ):
        watched()


@pytest.mark.usefixtures("fits")
def test_survey_that_vanishes_ends_the_watch_in_words(growing, watched):
    with pytest.raises(InputError, match="expected the survey that is watched, found none there"):
        watched(lambda: shutil.rmtree(growing.directory), nothing, ends=Ends(until=9))


@pytest.mark.usefixtures("fits")
def test_other_catalogue_ends_the_watch_in_words(growing, watched):
    def change():
        growing.append(1)
        with (growing.directory / REFERENCE).open("ab") as file:
            file.write(b" ")

    with pytest.raises(InputError, match=r"found other inputs \(reference.parquet\)"):
        watched(change, nothing, ends=Ends(until=9))


@pytest.mark.slow
def test_watched_run_has_the_tables_of_a_run_of_all_orbits(growing, watched):
    assert kinds(watched(ends=ONCE)) == [("fitted", 0)]
    for orbit in (1, 2):
        growing.append(orbit)
    watched(ends=Ends(until=3))
    whole = fit_survey.fit_survey(growing.directory, "whole", FitSettings(), workers=1).run
    run = RunDirectory(growing.directory, "watched")
    assert run.is_complete
    assert run.changes() == []
    for name in ("history.parquet", "motions.parquet", "orbit=0001/sources.parquet"):
        assert (run.directory / name).read_bytes() == (whole.directory / name).read_bytes()
    assert json.loads((run.directory / "gathered.json").read_text())["orbits"] == [0, 1, 2]


@pytest.mark.usefixtures("fits")
def test_copy_of_an_orbit_is_told_and_not_fitted(growing, watched):
    def step():
        growing.append(1)
        table = read_survey_table(growing.directory / EXPOSURES, ENVIRONMENT)
        copied = table[table["orbit_id"] == 0].assign(orbit_id=2)
        shutil.copy(measurement_path(growing.whole, 2), growing.file(2))
        write_survey_table(pd.concat([table, copied]), ENVIRONMENT, growing.directory / EXPOSURES)
        growing.write_manifest()

    said = watched(step)
    assert kinds(said) == [("fitted", 0), ("damaged", 2), ("fitted", 1)]
    assert "times and pointings of orbit 0" in message(said, "damaged")


@pytest.mark.usefixtures("fits")
def test_copy_that_comes_before_a_fitted_orbit_is_not_fitted(made_survey, tmp_path, watched):
    growing = GrowingSurvey(made_survey, tmp_path / "other", 2)
    table = read_survey_table(growing.directory / EXPOSURES, ENVIRONMENT)
    later = table[table["orbit_id"] == 1]
    write_survey_table(later, ENVIRONMENT, growing.directory / EXPOSURES)
    growing.file(0).unlink()
    growing.write_manifest()
    said = []
    watcher = Watch(growing.directory, "watched", FitSettings(), 1, said.append)
    watcher.run(1.0, ONCE)
    assert watcher.unread == []
    both = pd.concat([later.assign(orbit_id=0), later])
    write_survey_table(both, ENVIRONMENT, growing.directory / EXPOSURES)
    shutil.copy(measurement_path(made_survey, 0), growing.file(0))
    growing.write_manifest()
    watcher.run(1.0, ONCE)
    assert watcher.fitted == [1]
    assert watcher.unread == ["its exposures have the times and pointings of orbit 1"]
