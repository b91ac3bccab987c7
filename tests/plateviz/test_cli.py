"""The command line: exit codes, messages, and what it prints for machines."""

import json
import socket
import sys

import pytest

from plateviz.cli import main
from solver.io.result import read_result


@pytest.fixture
def run(monkeypatch, capsys):
    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["plateviz", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        printed = capsys.readouterr()
        return ended.value.code or 0, printed.out, printed.err

    return call


@pytest.fixture
def sample(sample_orbit_dir):
    return [sample_orbit_dir / f"sample_{name}.fits" for name in ("obs", "ref", "truth")]


def test_fit_prints_one_object_and_writes_the_result(run, sample, tmp_path):
    obs, ref, truth = sample
    output = tmp_path / "r.fits"
    code, out, _ = run("fit", obs, ref, "--truth", truth, "-o", output, "--json")
    summary = json.loads(out)
    assert code == 0
    assert summary["converged"]
    assert summary["output"] == str(output)
    assert (summary["n_measurements"], summary["n_reference"]) == (36_312, 58)
    assert {"read", "prepare", "fit", "write"} <= set(summary["seconds"])
    assert {"reason", "engine", "iterations", "n_sources", "chi2_per_dof"} <= set(summary)
    assert len(read_result(output).sources) == 814


def test_fit_prints_a_summary_for_people(run, sample, tmp_path):
    code, out, _ = run("fit", *sample[:2], "-o", tmp_path / "r.fits", "--order", "3")
    assert code == 0
    assert "converged after" in out
    assert "36312 measurements of 814 sources (58 reference)" in out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--order", "12"], "expected a distortion order from 0 to 9, found 12"),
        (["--engine", "magic"], "found 'magic'"),
        (["--prior", "distortion_x"], "expected GROUP=VALUE, found 'distortion_x'"),
        (["--prior", "nothing=1"], "found 'nothing'"),
        (["--prior", "distortion_x=1deg"], "prior of distortion_x: expected a unit out of"),
        (["--orbit", "99"], "99"),
        (["--instrument", "none.toml"], "none.toml: expected an instrument in TOML"),
    ],
    ids=["order", "engine", "no value", "group", "unit", "orbit", "instrument"],
)
def test_a_mistake_ends_with_two_and_one_message(run, sample, tmp_path, options, message):
    code, out, err = run("fit", *sample[:2], "-o", tmp_path / "r.fits", *options)
    assert code == 2
    assert message in err
    assert "Traceback" not in out + err
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_not_there_is_named(run, sample, tmp_path):
    code, _, err = run("fit", tmp_path / "none.fits", sample[1], "-o", tmp_path / "r.fits")
    assert code == 2
    assert "none.fits" in err


def test_an_output_that_cannot_be_written_is_said_before_the_fit(run, sample, tmp_path):
    code, _, err = run("fit", *sample[:2], "-o", tmp_path / "no" / "r.fits")
    assert code == 2
    assert "expected to write into a folder" in err


def test_inspect_says_what_files_are(run, sample):
    code, out, _ = run("inspect", sample[0], sample[1])
    assert code == 0
    assert "36312 rows" in out
    assert "source_id" in out


def test_inspect_of_something_else_ends_with_two(run, tmp_path):
    (tmp_path / "x.fits").write_text("no table")
    code, out, _ = run("inspect", tmp_path / "x.fits", "--json")
    assert code == 2
    assert json.loads(out)[0]["problems"]


def test_a_folder_that_is_no_survey_is_not_served(run, tmp_path):
    code, _, err = run("serve", tmp_path, "--port", "0", "--no-open")
    assert code == 2
    assert "survey.toml" in err


def test_a_port_in_use_is_said_before_any_work(run, tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        code, _, err = run("serve", tmp_path, "--port", taken.getsockname()[1], "--no-open")
    assert code == 2
    assert "expected an address and a port that are free" in err
