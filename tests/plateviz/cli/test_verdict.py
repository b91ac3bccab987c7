"""The verdict of `plateviz fit` and `survey`: printed, written, an exit code; what is refused."""

import json
import shutil

import numpy as np
import pyarrow as pa
import pytest
from astropy.io import fits

from plateviz.verdict.verdict import Verdict
from solver.engines.run_engine import run_engine
from solver.errors import LikelyCause, NoSolutionError
from solver.io.parquet import read_frame, write_parquet
from solver.io.result import read_result
from solver.io.survey import REFERENCE, measurement_path
from solver.io.survey_manifest import MANIFEST


@pytest.fixture
def orbit(sample_orbit_dir):
    return [sample_orbit_dir / f"sample_{name}.fits" for name in ("obs", "ref")]


def changed(path, folder, change):
    """Write a copy of a file whose tables were changed, and return its path."""
    copy = folder / path.name
    with fits.open(path) as hdus:
        for hdu in hdus[1:]:
            change(hdu.data)
        hdus.writeto(copy, checksum=True)
    return copy


@pytest.fixture
def measured_references(orbit):
    """Rows of the reference sources that the orbit has measured."""
    measured = fits.getdata(orbit[0], "measurement")["source_id"]
    table = fits.getdata(orbit[1])
    is_reference = np.asarray(table["reference_flag"]).astype(bool)
    return np.flatnonzero(is_reference & np.isin(table["source_id"], measured))


def test_good_solution_says_so_everywhere(run, orbit, tmp_path):
    code, out, _ = run("fit", *orbit, "-o", tmp_path / "r.fits", "--json")
    assert code == 0
    verdict = json.loads(out)["verdict"]
    assert verdict["state"] == "good"
    assert verdict["headline"] == "This solution can be trusted."
    assert verdict["reasons"]
    assert fits.getheader(tmp_path / "r.fits")["VERDICT"] == "good"
    assert read_result(tmp_path / "r.fits").summary["verdict"] == verdict


def test_good_solution_is_printed_with_what_no_test_can_see(run, orbit, tmp_path):
    code, out, _ = run("fit", *orbit, "-o", tmp_path / "r.fits")
    assert code == 0
    assert "- No test of one orbit shows smooth errors of the reference catalogue." in out


@pytest.mark.parametrize("obstime", [0.0, 1e6, np.nan], ids=str)
def test_time_that_no_mission_has_is_refused(run, orbit, tmp_path, obstime):
    def change(table):
        if "OBSTIME" in [name.upper() for name in table.names]:
            table["obstime"][3] = obstime

    observation = changed(orbit[0], tmp_path, change)
    code, _, err = run("fit", observation, orbit[1], "-o", tmp_path / "r.fits")
    assert code == 2
    assert "column 'obstime': expected" in err
    assert "the first is row 4" in err
    assert not (tmp_path / "r.fits").exists()


def test_exposure_of_another_day_is_refused_by_name(run, orbit, tmp_path):
    def change(table):
        if "OBSTIME" in [name.upper() for name in table.names]:
            table["obstime"][3] += 5.0
            change.row = table[3]
            change.key = tuple(int(table[n][3]) for n in ("orbit_id", "field_id", "plate_id"))

    observation = changed(orbit[0], tmp_path, change)
    code, _, err = run("fit", observation, orbit[1], "-o", tmp_path / "r.fits")
    assert code == 2
    assert "expected the exposures of an orbit within 2 d" in err
    assert str(change.key) in err


def test_reference_epoch_zero_is_refused(run, orbit, measured_references, tmp_path):
    def change(table):
        table["ref_epoch"][measured_references[0]] = 0.0

    reference = changed(orbit[1], tmp_path, change)
    code, _, err = run("fit", orbit[0], reference, "-o", tmp_path / "r.fits")
    assert code == 2
    assert "column 'ref_epoch': expected values from 1850 to 2150 yr" in err


def test_wrong_references_end_with_exit_code_three(run, orbit, measured_references, tmp_path):
    """Three references 50 mas off: every number converges, and the positions are wrong."""

    def change(table):
        table["dec"][measured_references[:3]] += 50.0 / 3.6e6

    reference = changed(orbit[1], tmp_path, change)
    code, out, err = run("fit", orbit[0], reference, "-o", tmp_path / "r.fits", "--json")
    assert code == 3
    assert "the fit converged, but its solution should not be trusted" in err
    verdict = json.loads(out)["verdict"]
    assert verdict["state"] == "bad"
    cause = verdict["causes"][0]
    assert cause["name"] == "wrong-references"
    assert cause["significance"] > 10.0
    assert cause["title"] in verdict["headline"]
    assert all(cause[part] for part in ("words", "spoils", "action", "options"))
    assert verdict["reasons"]
    assert fits.getheader(tmp_path / "r.fits")["VERDICT"] == "bad"
    options = ["--overwrite", "--accept"]
    code, out, err = run("fit", orbit[0], reference, "-o", tmp_path / "r.fits", *options)
    assert code == 0
    assert "This solution should not be trusted as it is: " in out


def test_a_fit_that_does_not_converge_has_a_verdict_too(run, orbit, tmp_path):
    """Forty pairs of measurements have each other's identification."""

    def change(table):
        if "source_id" not in table.names:
            return
        keys = ("orbit_id", "field_id", "plate_id", "detector_id")
        even = np.arange(0, len(table) - 1, 2)
        alike = np.all([table[key][even] == table[key][even + 1] for key in keys], axis=0)
        for row in np.random.default_rng(0).choice(even[alike], 40, replace=False):
            pair = [row, row + 1]
            table["source_id"][pair] = table["source_id"][pair[::-1]]

    observation = changed(orbit[0], tmp_path, change)
    code, out, err = run("fit", observation, orbit[1], "-o", tmp_path / "r.fits", "--json")
    assert code == 1
    verdict = json.loads(out)["verdict"]
    assert verdict["state"] == "bad"
    cause = verdict["causes"][0]
    assert cause["name"] == "swapped"
    assert "--robust" in cause["options"]
    assert len(cause["items"]) > 20
    assert "has not converged" in err


# Groups of which one prior has to hold the scale, and one the place of the detectors.
HOLDING = ("focal_length", "pitch_x", "pitch_y", "detector_x", "detector_y")
OPEN = [f"--prior={one}=flat" for one in HOLDING]


def test_a_fit_without_uncertainties_has_a_verdict_too(run, orbit, tmp_path):
    code, out, err = run("fit", *orbit, "-o", tmp_path / "r.fits", *OPEN, "--json")
    assert code == 1
    assert "plateviz: orbit 1: the data and the priors together leave a direction" in err
    summary = json.loads(out)
    assert (summary["orbit"], summary["engine"], summary["converged"]) == (1, "gauss-newton", False)
    assert summary["n_reference"] == 58
    verdict = summary["verdict"]
    assert set(verdict) == set(Verdict._fields)
    assert verdict["state"] == "bad"
    cause = verdict["causes"][0]
    assert cause["name"] == "open-direction"
    assert cause["options"][0].startswith("--prior focal_length=")
    assert summary["reason"] in verdict["reasons"][0]
    assert not (tmp_path / "r.fits").exists()


def test_what_other_engines_found_is_told_beside_it(run, orbit, tmp_path, monkeypatch):
    def without_svi(problem, settings, *given):
        if settings.engine == "svi":
            cause = LikelyCause("open-direction", "a title", "words", "do it")
            raise NoSolutionError("no luck", {"engine": "svi", "reason": "why"}, 0.0, cause)
        return run_engine(problem, settings, *given)

    monkeypatch.setattr("solver.fit.run_engine", without_svi)
    options = ["-o", tmp_path / "r.fits", "--engine", "all", "--json"]
    code, out, err = run("fit", *orbit, *options)
    assert (code, err.splitlines()[-1]) == (1, "plateviz: no luck")
    found = json.loads(out)
    assert found["verdict"]["state"] == "good"
    assert list(found["engines"]) == ["gauss-newton", "svi"]
    assert found["engines"]["svi"]["verdict"]["state"] == "bad"


@pytest.mark.slow
@pytest.mark.usefixtures("without_workers")
def test_survey_names_the_orbits_whose_solutions_should_not_be_trusted(run, made_survey, tmp_path):
    survey = shutil.copytree(made_survey, tmp_path / "survey")
    # Changed on purpose.
    (survey / MANIFEST).unlink()
    catalogue = read_frame(survey / REFERENCE)
    measured = read_frame(measurement_path(survey, 0))["source_id"]
    rows = catalogue.index[catalogue["is_reference"] & catalogue["source_id"].isin(measured)][:3]
    catalogue.loc[rows, "dec"] += 50.0 / 3.6e6
    write_parquet(pa.Table.from_pandas(catalogue, preserve_index=False), survey / REFERENCE)
    options = ["survey", survey, "--order", "3", "--orbits", "0", "--workers", "1", "--json"]
    code, out, err = run(*options)
    assert code == 3
    assert list(json.loads(out)["distrusted"]) == ["0"]
    assert "the solutions of 1 orbit should not be trusted as they are: 0" in err
    code, out, _ = run(*options, "--accept")
    assert code == 0
    assert json.loads(out)["kept"] == [0]
