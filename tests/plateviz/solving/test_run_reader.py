"""A run is read and judged in another thread, once for all pages, and again once it is written."""

import shutil
from concurrent.futures import ThreadPoolExecutor

import pytest

from plateviz.runs.new_run import begin_run
from plateviz.runs.run import open_run
from plateviz.runs.run_tables import read_run_verdict
from plateviz.solving import run_reader
from plateviz.solving.run_reader import RunReader
from solver.data.settings import FitSettings
from solver.errors import InputError
from tests.plateviz.solving.waiting import Waiting


@pytest.fixture
def run(survey_folder):
    """A run that has no orbit yet."""
    begin_run(survey_folder, "default", FitSettings())
    return open_run(survey_folder, "default")


def test_run_is_read_once_for_all_pages(run):
    waiting = Waiting()
    reader = RunReader(waiting)
    first, second = reader.read(run), reader.read(open_run(run.survey, run.name))
    assert first is second
    assert not first.done()
    waiting.work()
    assert reader.read(run) is first
    assert first.result().verdict == read_run_verdict(run)


def test_run_is_read_again_once_anything_is_written(run):
    with ThreadPoolExecutor(1) as threads:
        reader = RunReader(threads)
        first = reader.read(run)
        (run.directory / "note.txt").write_text("Looks well.")
        assert reader.read(run) is not first


def test_run_that_could_not_be_read_is_tried_again(run):
    waiting = Waiting()
    reader, orbits = RunReader(waiting), run.orbits
    run.orbits = lambda: (_ for _ in ()).throw(InputError("expected a disk"))
    first = reader.read(run)
    waiting.work()
    with pytest.raises(InputError, match="expected a disk"):
        first.result()
    run.orbits = orbits
    again = reader.read(run)
    waiting.work()
    assert len(again.result().tables.orbits) == len(orbits())


def test_run_that_is_gone_says_so(run):
    shutil.rmtree(run.directory)
    with pytest.raises(InputError, match="default: expected a run, found No such file"):
        RunReader(Waiting()).read(run)


def test_figures_have_the_tables_of_the_verdict(run, monkeypatch):
    waiting = Waiting()
    answer = RunReader(waiting).read(run)
    waiting.work()
    read = answer.result()
    monkeypatch.setattr(type(run), "orbits", lambda _: pytest.fail("read again"))
    whole = read.whole(waiting)
    assert read.whole(waiting) is whole
    waiting.work()
    assert whole.result().tests is read.tables.tests
    assert whole.result().motions is read.tables.motions


def test_few_runs_are_kept(run, monkeypatch):
    monkeypatch.setattr(run_reader, "_MOST", 1)
    reader = RunReader(Waiting())
    first = reader.read(run)
    shutil.copytree(run.directory, run.directory.with_name("other"))
    reader.read(open_run(run.survey, "other"))
    assert reader.read(run) is not first
