"""Survey directories: written completely or resumed, and refused if invalid."""

import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from pyarrow import parquet

from solver.data.instrument import MINI_MOCK, parse_instrument
from solver.errors import InputError
from solver.io.survey import read_survey_orbit, survey_orbits
from solver.io.survey_header import read_header, write_header
from solver.simulate.catalogue import reference_catalogue, truth_catalogue
from solver.simulate.measure import measure_orbit
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey

SETTINGS = SurveySettings(orbits=3, n_stars=1500, n_reference=400, n_artificial=40)


class InterruptionError(Exception):
    """Stands for an interruption by the user (Ctrl-C)."""


def interrupt_after(orbits: int) -> object:
    def progress(done: int, total: int) -> None:
        assert total == SETTINGS.orbits
        if done == orbits:
            raise InterruptionError

    return progress


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("survey") / "made" / "here"
    simulate_survey(directory, SETTINGS)
    return directory


def test_directory_has_the_designed_files(survey: Path) -> None:
    assert sorted(str(p.relative_to(survey)) for p in survey.rglob("*") if p.is_file()) == [
        "exposures.parquet",
        "manifest.sha256",
        "measurements/orbit=0000.parquet",
        "measurements/orbit=0001.parquet",
        "measurements/orbit=0002.parquet",
        "reference.parquet",
        "survey.toml",
        "truth.parquet",
    ]


def test_header_has_settings_and_versions(survey: Path) -> None:
    header = tomllib.loads((survey / "survey.toml").read_text(encoding="utf-8"))
    assert header["format"] == 1
    assert SurveySettings.from_dict(header["settings"]) == SETTINGS
    assert parse_instrument(header["instrument"], survey / "survey.toml") == MINI_MOCK
    assert header["versions"]["numpy"] == np.__version__


def test_orbits_read_back_as_simulated(survey: Path) -> None:
    assert survey_orbits(survey) == [0, 1, 2]
    truth = truth_catalogue(SETTINGS)
    expected = measure_orbit(1, truth, SETTINGS)
    data = read_survey_orbit(survey, 1)
    measured = np.sort(expected.measurements["source_id"].unique())
    assert data.orbit_id == 1
    pd.testing.assert_frame_equal(data.measurements, expected.measurements)
    pd.testing.assert_frame_equal(data.exposures, expected.exposures)
    for table, whole in (
        (data.catalogue, reference_catalogue(truth, SETTINGS)),
        (data.truth, truth),
    ):
        chosen = whole[whole["source_id"].isin(measured)].reset_index(drop=True)
        pd.testing.assert_frame_equal(table, chosen)
    assert next(iter(data.provenance)) == "measurements/orbit=0001.parquet"
    assert len(data.provenance) == 4


def test_ids_round_trip(survey: Path) -> None:
    ids = parquet.read_table(survey / "measurements" / "orbit=0000.parquet")["source_id"]
    assert str(ids.type) == "int64"
    assert np.isin(ids.to_numpy(), truth_catalogue(SETTINGS)["source_id"]).all()


def test_columns_have_units(survey: Path) -> None:
    columns = parquet.read_schema(survey / "reference.parquet")
    assert columns.field("pmra").metadata == {b"unit": b"mas / yr"}
    assert columns.field("source_id").metadata is None


def test_interrupted_survey_is_not_read_and_resumes_to_the_same_bytes(
    survey: Path, tmp_path: Path
) -> None:
    with pytest.raises(InterruptionError):
        simulate_survey(tmp_path, SETTINGS, progress=interrupt_after(2))
    with pytest.raises(InputError, match=r"expected a survey with a file survey\.toml"):
        survey_orbits(tmp_path)
    written = tmp_path / "measurements" / "orbit=0001.parquet"
    kept = written.stat()
    done: list[int] = []
    simulate_survey(tmp_path, SETTINGS, progress=lambda orbit, _: done.append(orbit))
    assert done == [1, 2, 3]
    # Not the time of the last reading, which the manifest changes.
    assert (written.stat().st_ino, written.stat().st_mtime_ns) == (kept.st_ino, kept.st_mtime_ns)
    for path in survey.rglob("*.*"):
        assert (tmp_path / path.relative_to(survey)).read_bytes() == path.read_bytes()
    assert not (tmp_path / "unfinished.toml").exists()


@pytest.mark.parametrize("at", ["begin", "orbit", "end"])
def test_survey_resumes_whenever_it_was_killed(survey: Path, tmp_path: Path, at: str) -> None:
    if at != "begin":
        shutil.copytree(survey, tmp_path, dirs_exist_ok=True)
        (tmp_path / "survey.toml").rename(tmp_path / "unfinished.toml")
    if at == "orbit":
        (tmp_path / "manifest.sha256").unlink()
        (tmp_path / "measurements" / "orbit=0002.parquet").unlink()
    folder = tmp_path / "measurements" if at == "orbit" else tmp_path
    half = folder / ".orbit=0002.parquet-0123456789ab.part"
    half.mkdir()
    (half / "orbit=0002.parquet").write_bytes(b"PAR1")
    simulate_survey(tmp_path, SETTINGS)
    paths = {path.relative_to(tmp_path) for path in tmp_path.rglob("*")}
    assert paths == {path.relative_to(survey) for path in survey.rglob("*")}
    for path in survey.rglob("*.*"):
        assert (tmp_path / path.relative_to(survey)).read_bytes() == path.read_bytes()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"settings": replace(SETTINGS, seed=1)}, "found other seed$"),
        ({"instrument": replace(MINI_MOCK, focal_length_um=4e6)}, "found other instrument$"),
    ],
    ids=["settings", "instrument"],
)
def test_unfinished_survey_with_other_settings_is_refused(
    change: dict[str, object], message: str, tmp_path: Path
) -> None:
    with pytest.raises(InterruptionError):
        simulate_survey(tmp_path, SETTINGS, progress=interrupt_after(1))
    with pytest.raises(InputError, match=message):
        simulate_survey(tmp_path, **{"settings": SETTINGS, **change})


def test_finished_survey_is_refused(survey: Path) -> None:
    with pytest.raises(InputError, match="found a finished one"):
        simulate_survey(survey, SETTINGS)


def test_directory_with_other_files_is_refused_and_unchanged(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(InputError, match=r"an empty directory .* found thesis\.tex"):
        simulate_survey(tmp_path, SETTINGS)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]


def test_file_in_place_of_the_directory_is_refused(tmp_path: Path) -> None:
    (tmp_path / "survey").write_text("mine")
    with pytest.raises(InputError, match="expected a directory for the survey, found a file"):
        simulate_survey(tmp_path / "survey", SETTINGS)


def test_survey_without_reference_stars_in_an_orbit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="orbit 0: expected at least one reference star"):
        simulate_survey(tmp_path, SurveySettings(orbits=1, n_stars=2, n_reference=1))


def test_gaia_table_becomes_the_truth(tmp_path: Path) -> None:
    stars = truth_catalogue(replace(SETTINGS, n_artificial=0, seed=3))
    table = tmp_path / "gaia.csv"
    stars.drop(columns=["is_reference", "is_artificial"]).to_csv(table, index=False)
    settings = replace(SETTINGS, orbits=1)
    simulate_survey(tmp_path / "survey", settings, catalogue=table)
    truth = read_survey_orbit(tmp_path / "survey", 0).truth
    assert np.isin(truth.query("~is_artificial")["source_id"], stars["source_id"]).all()
    assert read_header(tmp_path / "survey")["catalogue"]["name"] == "gaia.csv"


def test_invalid_gaia_table_is_named(tmp_path: Path) -> None:
    table = tmp_path / "gaia.csv"
    table.write_text("source_id,ra\n1,2.0\n")
    with pytest.raises(InputError, match=r"gaia\.csv: expected the columns"):
        simulate_survey(tmp_path / "survey", SETTINGS, catalogue=table)


def test_unknown_orbit_is_refused(survey: Path) -> None:
    with pytest.raises(InputError, match="expected an orbit out of 0 to 2, found 7"):
        read_survey_orbit(survey, 7)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("format = 2", "expected format = 1, found 2"),
        ("", "expected format = 1, found 'no format'"),
        ("format =", "expected the header of a survey, found"),
    ],
    ids=["newer", "none", "damaged"],
)
def test_invalid_headers_are_refused(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "survey.toml").write_text(text)
    with pytest.raises(InputError, match=message):
        survey_orbits(tmp_path)


def test_orbit_file_of_another_orbit_is_refused(survey: Path, tmp_path: Path) -> None:
    (tmp_path / "measurements").mkdir()
    for name in ("survey.toml", "reference.parquet", "exposures.parquet"):
        (tmp_path / name).symlink_to(survey / name)
    (tmp_path / "measurements" / "orbit=0005.parquet").symlink_to(
        survey / "measurements" / "orbit=0001.parquet"
    )
    with pytest.raises(InputError, match=r"column orbit_id: expected 5 alone, found \[1\]"):
        read_survey_orbit(tmp_path, 5)


def test_survey_without_truth_is_read(survey: Path, tmp_path: Path) -> None:
    for name in ("survey.toml", "reference.parquet", "exposures.parquet", "measurements"):
        (tmp_path / name).symlink_to(survey / name)
    assert read_survey_orbit(tmp_path, 0).truth is None


def test_header_round_trips_special_characters(tmp_path: Path) -> None:
    content = {
        "line": 'a "quoted" \\ back\x7fslash, µ and \x01',
        "lines": 'a """ b\n\\n "c"\n',
        "table": {"numbers": [1, 2.5, [True]], "text": "x", "row": {"k": 1}},
    }
    write_header(tmp_path, content)
    assert read_header(tmp_path) == {"format": 1, **content}
