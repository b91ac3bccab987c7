"""Missing and damaged files of small surveys and runs, which were made without a fit."""

import os
import re
import shutil

import numpy as np
import pytest

import solver.io.survey as survey_module
from plateviz.runs.load_tables import survey_tables
from plateviz.runs.run import Run
from plateviz.runs.run_directory import RunDirectory
from plateviz.solving.origin import SurveyFolder
from solver.data.schema import CATALOGUE, TRUTH
from solver.errors import InputError
from solver.io.atomic import sha256_of
from solver.io.manifest import UnchangedFiles
from solver.io.survey import (
    measurement_path,
    read_survey_orbit,
    read_survey_table,
    survey_orbits,
    write_survey_table,
)
from tests.campaigns import seed_files
from tests.campaigns.seed_files import FIRST_ID, RUN


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A survey with a complete run."""
    orbit = seed_files.orbit_tables(tmp_path_factory.mktemp("sample"))
    folder = tmp_path_factory.mktemp("made") / "survey"
    seed_files.make_run(folder, orbit)
    return folder


@pytest.fixture
def survey(made, tmp_path):
    return shutil.copytree(made, tmp_path / "survey")


@pytest.fixture
def run(survey):
    """The run, as if it were not complete: its files are not compared with a manifest."""
    (survey / "runs" / RUN / "COMPLETE").unlink()
    return Run(RunDirectory(survey, RUN))


def edit(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def test_orbit_of_missing_measurements_is_refused_by_name(survey):
    measurement_path(survey, 1).unlink()
    assert survey_orbits(survey) == [0, 1]
    assert read_survey_orbit(survey, 0).orbit_id == 0
    with pytest.raises(InputError, match=r"orbit=0001\.parquet: expected the file that was writt"):
        read_survey_orbit(survey, 1)


def test_missing_truth_is_refused_where_the_manifest_lists_it(survey):
    (survey / "truth.parquet").unlink()
    for read in (lambda: read_survey_orbit(survey, 0), lambda: survey_tables(_run(survey))):
        with pytest.raises(InputError, match=r"truth\.parquet: expected the file that was writt"):
            read()
    (survey / "manifest.sha256").unlink()
    assert read_survey_orbit(survey, 0).truth is None
    assert survey_tables(_run(survey)).truth is None


@pytest.mark.parametrize(("name", "schema"), [("reference", CATALOGUE), ("truth", TRUTH)])
def test_table_of_sources_that_was_written_again_is_read_again(survey, name, schema):
    first = read_survey_orbit(survey, 0)
    (survey / "manifest.sha256").unlink()
    path = survey / f"{name}.parquet"
    moved = read_survey_table(path, schema)
    moved["ra"] += 0.25
    write_survey_table(moved, schema, path)
    field = {"reference": "catalogue", "truth": "truth"}[name]
    before, after = (getattr(one, field)["ra"] for one in (first, read_survey_orbit(survey, 0)))
    assert np.allclose(after - before, 0.25)


def test_orbits_share_no_table_that_can_be_changed(survey):
    first = read_survey_orbit(survey, 0)
    true_ra = first.truth["ra"].copy()
    for frame in (first.catalogue, first.truth):
        frame.loc[:, "ra"] = 0.0
    again = read_survey_orbit(survey, 0)
    assert again.truth["ra"].equals(true_ra)
    assert again.catalogue["ra"].all()


def test_catalogue_that_changes_while_it_is_read_is_refused(survey, monkeypatch):
    path, read = survey / "reference.parquet", survey_module.find_catalogue

    def replaced(asked):
        found = read(asked)
        if asked == path:
            path.write_bytes(path.read_bytes() + b" ")
        return found

    monkeypatch.setattr(survey_module, "find_catalogue", replaced)
    with pytest.raises(InputError, match=r"reference\.parquet: expected no change while"):
        read_survey_orbit(survey, 0)


@pytest.mark.parametrize(("name", "schema"), [("reference", CATALOGUE), ("truth", TRUTH)])
def test_changed_table_of_a_survey_is_refused_by_name(survey, name, schema):
    path = survey / f"{name}.parquet"
    content = path.read_bytes()
    # The footer, which no checksum of a page protects: an optional column gets another name.
    path.write_bytes(content.replace(b"is_artificial", b"is_artificiam"))
    with pytest.raises(InputError, match=rf"{name}\.parquet: expected the file that was written"):
        read_survey_table(path, schema)
    with pytest.raises(InputError, match=rf"{name}\.parquet: expected the file that was written"):
        survey_tables(_run(survey))


@pytest.mark.parametrize(
    ("name", "read"),
    [
        ("motions.parquet", lambda run: run.motions()),
        ("motions.parquet", lambda run: run.motion(FIRST_ID)),
        ("motions.parquet", lambda run: run.counts()),
        ("history.parquet", lambda run: run.history(FIRST_ID)),
        ("history.parquet", lambda run: run.classes(1)),
        ("errors_by_count.parquet", lambda run: run.errors_by_count()),
        ("gathered.json", lambda run: RunDirectory(run.survey, RUN).gathered_orbits()),
    ],
)
def test_missing_table_of_a_complete_run_is_refused_by_name(survey, name, read):
    (survey / "runs" / RUN / name).unlink()
    with pytest.raises(InputError, match=rf"{re.escape(name)}: expected the file that was writt"):
        read(_run(survey))


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("instrument = ", "instrumant = ", "expected the text of an instrument, found None"),
        ("instrument = ", "instrument = 3 # ", "expected the text of an instrument, found 3"),
    ],
    ids=["missing", "number"],
)
def test_survey_without_an_instrument_is_refused(survey, old, new, found):
    (survey / "manifest.sha256").unlink()
    path = survey / "survey.toml"
    lines = path.read_text(encoding="utf-8").partition("instrument = ")
    path.write_text(f'{lines[0]}instrument = "none"\n', encoding="utf-8")
    edit(path, old, new)
    with pytest.raises(InputError, match=rf"survey\.toml: {found}"):
        SurveyFolder(str(survey)).read_instrument()


@pytest.mark.parametrize("value", ["3", "[1.0]", '["a", 2]', "[1.0, nan]", "[[1], 2]"])
def test_field_of_a_survey_has_to_be_two_numbers(survey, value):
    (survey / "manifest.sha256").unlink()
    edit(survey / "survey.toml", "field_l_deg = [-1.4, 0.7]", f"field_l_deg = {value}")
    with pytest.raises(InputError, match=r"survey\.toml: expected field_l_deg to be two numbers"):
        survey_tables(_run(survey))


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("order = 3", "order = 77", "from 0 to 9, found 77"),
        ("order = 3", "ordre = 3", "unknown settings: ordre"),
        ("[settings]", "[settinks]", "expected the settings of a fit"),
        ("[settings]", "settings = 4\n[other]", "expected the settings of a fit"),
    ],
    ids=["value", "name", "no-settings", "number"],
)
def test_wrong_settings_of_a_run_are_refused_by_name(run, old, new, found):
    edit(run.directory / "run.toml", old, new)
    with pytest.raises(InputError, match=rf"run\.toml: .*{found}"):
        RunDirectory(run.survey, RUN).settings()


def test_damaged_history_is_refused_in_words(run):
    (run.directory / "gathered.json").unlink()
    path = run.directory / "history.parquet"
    content = path.read_bytes()
    footer = len(content) - 8 - int.from_bytes(content[-8:-4], "little")
    path.write_bytes(content[:footer] + bytes(20) + content[footer + 20 :])
    with pytest.raises(InputError, match=r"expected the tables of a run, found \w") as refused:
        run.classes(1)
    assert "Exception" not in str(refused.value)
    assert "LINE" not in str(refused.value)


def exchange_columns(path):
    """Give two columns each other's name, in the footer that no checksum of a page protects."""
    content = path.read_bytes()
    for first, second in ((b"sigma_ra_noise", b"0" * 14), (b"prior_sigma_ra", b"sigma_ra_noise")):
        assert first in content
        content = content.replace(first, second)
    path.write_bytes(content.replace(b"0" * 14, b"prior_sigma_ra"))


@pytest.mark.parametrize("state", ["complete", "failed", "interrupted"])
def test_columns_with_exchanged_names_are_refused(survey, state):
    run = _run(survey)
    if state != "complete":
        (run.directory / "COMPLETE").unlink()
    if state == "interrupted":
        for name in ("gathered.json", "history.parquet", "motions.parquet"):
            (run.directory / name).unlink()
    assert len(run.history(FIRST_ID)) == 2
    gathered = run.directory / "history.parquet"
    exchange_columns(
        gathered if gathered.is_file() else run.directory / "orbit=0001" / gathered.name
    )
    for read in (lambda: run.history(FIRST_ID), lambda: run.classes(1)):
        with pytest.raises(InputError, match=r"history\.parquet: expected the file that was writt"):
            read()
    assert any("history.parquet" in message for message in RunDirectory(survey, RUN).changes())


def test_run_of_an_older_version_lists_orbits_only(survey):
    run = _run(survey)
    (run.directory / "COMPLETE").unlink()
    (run.directory / "gathered.json").write_text("[0, 1]", encoding="utf-8")
    assert RunDirectory(survey, RUN).gathered_orbits() == [0, 1]
    assert len(run.history(FIRST_ID)) == 2


def test_file_that_was_checked_is_checked_again_when_it_is_written(tmp_path, monkeypatch):
    path, unchanged = tmp_path / "a", UnchangedFiles()
    path.write_bytes(b"a")
    os.utime(path, (1e9, 1e9))
    digest = sha256_of(path)
    unchanged.require(path, digest, "restore it")
    with monkeypatch.context() as patch:
        patch.setattr("solver.io.manifest.sha256_of", lambda _: pytest.fail("read again"))
        unchanged.require(path, digest, "restore it")
    path.write_bytes(b"b")
    with pytest.raises(InputError, match="a: expected the file that was written"):
        unchanged.require(path, digest, "restore it")


def _run(survey):
    return Run(RunDirectory(survey, RUN))
