"""`plateviz report`: the files that it writes and the options that it refuses."""

import json
import shutil
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import replace

import pytest

from plateviz.reports.folder import _workers
from plateviz.runs.fitted_orbit import write_fitted_orbit
from plateviz.runs.new_run import begin_run
from plateviz.runs.run_directory import RunDirectory
from solver.data.settings import FitSettings
from solver.io.result import write_result


def of_orbit(result, orbit):
    """Return a result as that of another orbit."""
    return replace(result, exposures=result.exposures.assign(orbit_id=orbit))


@pytest.fixture
def run_dir(survey_folder, fit_result):
    """A survey with a run in which orbit 0 is fitted and orbit 1 has failed."""
    run = begin_run(survey_folder, "default", FitSettings())
    write_fitted_orbit(run.orbit_directory(0), of_orbit(fit_result, 0))
    run.keep_failure(1, "orbit 1: the data leave a direction unconstrained")
    return survey_folder


@pytest.mark.usefixtures("few_figures")
def test_result_file_is_reported_on_one_page(run, fit_result, tmp_path):
    write_result(fit_result, tmp_path / "r.fits")
    code, out, _ = run("report", tmp_path / "r.fits", "-o", tmp_path / "r.html")
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert code == 0
    assert "Orbit 7" in out
    assert page.endswith("</html>") or page.endswith("</html>\n")
    assert "Values (CSV)" in page
    assert "<dt>jax</dt>" in page[page.index("Versions that solved it") :]
    assert "<dd>JASMINE mini-mock</dd>" in page[page.index(">Instrument<") :]


def test_failed_orbit_has_a_report(run, run_dir, tmp_path):
    code, _, _ = run("report", run_dir, "--orbit", 1, "-o", tmp_path / "r.html")
    assert code == 0
    assert "leave a direction unconstrained" in (tmp_path / "r.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("few_figures")
def test_two_results_are_compared(run, fit_result, tmp_path):
    for name in ("a", "b"):
        write_result(fit_result, tmp_path / f"{name}.fits")
    arguments = ["--other", tmp_path / "b.fits", "-o", tmp_path / "r.html"]
    more = ["--both", "residual-map", "--explore", "rows=sources&x=ra&y=dec"]
    code, _, _ = run("report", tmp_path / "a.fits", *arguments, *more)
    assert code == 0
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert "What differs between the other solution (A) and this one (B)" in page
    for name in ("comparison", "both-residual-map", "explore-0"):
        assert f'id="figure-{name}"' in page


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--orbit", "9"], "expected an orbit 9, found none of that number"),
        (["--orbit", "2"], "expected a complete fitted orbit, found no COMPLETE file"),
        (["--orbit", "0", "--both", "residual-map"], "--both: expected with --other"),
        (["--source", "5", "--explore", "rows=orbits"], "--explore: expected with an orbit or"),
        (["--orbit", "0", "--explore", "rows=stars&x=ra&y=dec"], "found 'stars'"),
        (["--orbit", "0", "--explore", "rows=sources&x=ra&y=flux"], "found 'flux'"),
        (["--pages", "--explore", "rows=sources&x=ra&y=dec"], "--pages: expected no option but"),
        (["--orbit", "0", "--survey"], "expected one of --orbit, --source and --survey"),
        (["--run", "other"], "expected a run 'other', found default"),
        (["--survey"], "found 1 of 3 orbits missing"),
        (["--source", "5", "--other", "b"], "--other: expected with an orbit or a survey"),
        (["--other", "b"], "expected a run 'b', found default"),
        (["--other", "default"], "--other: expected another run than 'default', found the same"),
        (["--orbit", "0", "--instrument", "i.toml"], "--instrument: expected with a result of"),
    ],
)
def test_invalid_options_give_one_message_and_no_file(run, run_dir, tmp_path, options, message):
    code, _, err = run("report", run_dir, *options, "-o", tmp_path / "r.html")
    assert code == 2
    assert message in err
    assert err.strip().count("\n") == 0
    assert not list(tmp_path.glob("r.html*"))


def test_page_and_its_pdf_cannot_have_the_same_name(run, run_dir, tmp_path):
    code, _, err = run("report", run_dir, "--orbit", 0, "-o", tmp_path / "r.pdf", "--pdf")
    assert code == 2
    assert "expected a name that ends in .html or .htm" in err
    assert not (tmp_path / "r.pdf").exists()


@pytest.mark.usefixtures("few_figures")
def test_page_of_an_orbit_lists_the_versions_of_the_fit(run, run_dir, tmp_path):
    run("report", run_dir, "--orbit", 0, "-o", tmp_path / "r.html")
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    solved = page.index("Versions that solved it")
    assert "<dt>jax</dt>" in page[solved:]


def test_run_of_a_newer_version_is_refused(run, run_dir, tmp_path):
    head = RunDirectory(run_dir, "default").orbit_directory(0) / "result.json"
    head.write_text(json.dumps({**json.loads(head.read_text()), "format": 99}))
    head.with_name("COMPLETE").write_text("")
    code, _, err = run("report", run_dir, "--orbit", 0, "-o", tmp_path / "r.html")
    assert code == 2
    assert "written by a newer plateviz" in err


def test_unwritable_output_is_refused_before_drawing(run, run_dir, tmp_path):
    target = tmp_path / "no" / "such" / "r.html"
    code, _, err = run("report", run_dir, "--orbit", 0, "-o", target)
    assert code == 2
    assert str(target) in err


def test_result_file_with_an_orbit_option_is_refused(run, fit_result, tmp_path):
    write_result(fit_result, tmp_path / "r.fits")
    code, _, err = run("report", tmp_path / "r.fits", "--orbit", 7, "-o", tmp_path / "r.html")
    assert code == 2
    assert "expected a survey directory" in err


def test_options_of_a_page_and_of_pages_are_not_mixed(run, run_dir, tmp_path):
    for options in (("--pages", "--overwrite"), ("--workers", 2)):
        code, _, err = run("report", run_dir, "-o", tmp_path / "r", *options)
        assert code == 2
        assert "expected" in err
        assert not (tmp_path / "r").exists()


def test_pdf_without_chromium_is_refused_before_writing(run, run_dir, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda _: None)
    code, _, err = run("report", run_dir, "--orbit", 0, "-o", tmp_path / "r.html", "--pdf")
    assert code == 2
    assert "--pdf: expected one of chromium" in err
    assert not (tmp_path / "r.html").exists()


@pytest.fixture
def whole_run(run_dir, fit_result):
    """A run in which two orbits are fitted and one has failed."""
    write_fitted_orbit(RunDirectory(run_dir, "default").orbit_directory(2), of_orbit(fit_result, 2))
    return run_dir


def test_two_runs_are_compared(run, whole_run, fit_result, tmp_path):
    other = begin_run(whole_run, "low", FitSettings(order=3))
    for orbit in range(3):
        write_fitted_orbit(other.orbit_directory(orbit), of_orbit(fit_result, orbit))
    arguments = ["--other", "low", "--both", "orbit-health", "-o", tmp_path / "r.html"]
    code, _, _ = run("report", whole_run, *arguments)
    assert code == 0
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert "Run default of 3 orbits, compared with run low" in page
    assert "What differs between run low (A) and run default (B)" in page
    assert "<td>order 3</td><td>order 5</td>" in page
    for name in ("motion-differences", "both-orbit-health"):
        assert f'id="figure-{name}"' in page
    code, _, err = run("report", whole_run, *arguments, "--both", "footprint", "--overwrite")
    assert code == 2
    assert "both: expected a figure out of orbit-health" in err


@pytest.mark.slow
def test_folder_has_a_page_per_orbit_and_keeps_written_pages(run, whole_run, tmp_path):
    folder = tmp_path / "pages"
    code, out, _ = run("report", whole_run, "--pages", "-o", folder, "--workers", 1)
    assert code == 0
    assert "3 orbit pages written" in out
    names = sorted(path.name for path in folder.iterdir())
    pages = [f"orbit-{number:04d}.html" for number in range(3)]
    assert names == ["index.html", *pages, "report.json"]
    index = (folder / "index.html").read_text(encoding="utf-8")
    assert all(f'<a href="{page}">' in index for page in pages)
    middle = (folder / pages[1]).read_text(encoding="utf-8")
    assert all(f'<a href="{page}">' in middle for page in ("index.html", pages[0], pages[2]))
    before = (folder / pages[2]).read_bytes()
    (folder / pages[1]).unlink()
    _, out, _ = run("report", whole_run, "--pages", "-o", folder, "--workers", 1)
    assert "1 orbit pages written, 2 already there" in out
    assert (folder / pages[2]).read_bytes() == before


def test_folder_that_was_killed_while_it_began_is_begun(run, whole_run, tmp_path, monkeypatch):
    monkeypatch.setattr("plateviz.reports.folder._workers", killed_pool)
    folder = tmp_path / "pages"
    (folder / ".report.json-0123456789ab.part").mkdir(parents=True)
    code, _, err = run("report", whole_run, "--pages", "-o", folder)
    assert code == 1
    assert "found that one was killed" in err
    assert [path.name for path in folder.iterdir()] == ["report.json"]


@contextmanager
def killed_pool(count, folder):
    with _workers(count, folder):
        raise BrokenProcessPool("A process in the process pool was terminated abruptly")
    yield


def test_folder_with_other_files_is_left_unchanged(run, whole_run, tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    code, _, err = run("report", whole_run, "--pages", "-o", tmp_path)
    assert code == 2
    assert "expected an empty folder" in err
    assert [path.name for path in tmp_path.iterdir() if path.name != "survey"] == ["mine.txt"]


def test_folder_of_another_run_is_left_unchanged(run, whole_run, tmp_path):
    folder = tmp_path / "pages"
    folder.mkdir()
    (folder / "report.json").write_text('{"run": "other"}')
    code, _, err = run("report", whole_run, "--pages", "-o", folder)
    assert code == 2
    assert "expected pages of this run and version, found others" in err
