"""The command line: exit codes, messages and printed output."""

import json
import re
import socket

import pytest

from plateviz.cli.output import print_inspection
from plateviz.solving.origin import SurveyFolder
from solver.io.result import read_result


@pytest.fixture
def sample(sample_orbit_dir):
    return [sample_orbit_dir / f"sample_{name}.fits" for name in ("obs", "ref", "truth")]


def test_fit_prints_one_json_object_and_writes_the_result(run, sample, tmp_path):
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


def test_fit_prints_a_summary_as_text(run, sample, tmp_path):
    code, out, err = run("fit", *sample[:2], "-o", tmp_path / "r.fits", "--order", "3")
    assert code == 3
    assert "should not be trusted as it is; it is written, and --accept" in err
    assert "This solution should not be trusted as it is: " in out
    assert "- χ² per degree of freedom: " in out
    assert "converged: every step" in out
    assert "gauss-newton, " in out
    assert "36312 measurements of 814 sources (58 reference)" in out


@pytest.mark.full
@pytest.mark.slow
def test_svi_with_a_checkpoint_stops_at_the_limit_and_removes_it(run, sample, tmp_path):
    """At the limit of steps, the exit code is 1 and the checkpoint file is removed."""
    output, checkpoint = tmp_path / "r.fits", tmp_path / "run.npz"
    options = ["--engine", "svi", "--steps", "50", "--thin", "20", "--checkpoint", checkpoint]
    code, out, err = run("fit", *sample[:2], "-o", output, *options, "--json")
    summary = json.loads(out)
    assert code == 1
    assert "the limit of steps was reached" in err
    assert (summary["engine"], summary["iterations"]) == ("svi", 100)
    assert not checkpoint.exists()
    assert len(read_result(output).losses) == 100


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--order", "12"], "expected a distortion order from 0 to 9, found 12"),
        (["--engine", "magic"], "found 'magic'"),
        (["--engine", "svi", "--compat", "pyro"], "expected warpfield"),
        (["--checkpoint", "run.npz"], "--checkpoint: expected the engine svi"),
        (["--prior", "distortion_x"], "expected GROUP=VALUE, found 'distortion_x'"),
        (["--prior", "nothing=1"], "found 'nothing'"),
        (["--centre", "detector_x[2]"], "expected GROUP=SHIFT"),
        (["--centre", "detector_x[7]=1um"], "expected an element out of 0, 1, 2, 3, found '7'"),
        (["--prior", "distortion_x=1deg"], "prior of distortion_x: expected a unit such as um"),
        (["--orbit", "99"], "99"),
        (["--instrument", "none.toml"], "none.toml: expected an instrument in TOML"),
    ],
    ids=[
        "order",
        "engine",
        "compat",
        "checkpoint",
        "no value",
        "group",
        "no shift",
        "element",
        "unit",
        "orbit",
        "instrument",
    ],
)
def test_invalid_option_exits_with_two_and_one_message(run, sample, tmp_path, options, message):
    code, out, err = run("fit", *sample[:2], "-o", tmp_path / "r.fits", *options)
    assert code == 2
    assert message in err
    assert "Traceback" not in out + err
    assert list(tmp_path.iterdir()) == []


def test_missing_file_is_named(run, sample, tmp_path):
    code, _, err = run("fit", tmp_path / "none.fits", sample[1], "-o", tmp_path / "r.fits")
    assert code == 2
    assert "none.fits" in err


def test_unwritable_output_is_refused_before_the_fit(run, sample, tmp_path):
    code, _, err = run("fit", *sample[:2], "-o", tmp_path / "no" / "r.fits")
    assert code == 2
    assert "expected to write into a folder" in err


def test_inspect_lists_tables_and_columns(run, sample):
    code, out, _ = run("inspect", sample[0], sample[1])
    assert code == 0
    assert "36312 rows" in out
    assert "source_id" in out


@pytest.mark.parametrize(
    ("last", "dates"), [(62202.5, ", 2029-03-07 00:00 to 2029-03-07 12:00 TCB"), (1e300, "")]
)
def test_inspect_prints_dates_where_times_are_some(capsys, last, dates):
    times = {"name": "obstime", "type": "float64", "unit": "d", "canonical": "obstime"}
    table = {"name": "exposures", "rows": 2, "columns": [{**times, "min": 62202.0, "max": last}]}
    nothing = {"defects": [], "problems": [], "counts": {}}
    print_inspection([{"file": "a.csv", "kind": "observation", "tables": [table], **nothing}])
    assert f"62202.0 to {last} d{dates}  (obstime)" in capsys.readouterr().out


def test_inspect_of_an_unreadable_file_exits_with_two(run, tmp_path):
    (tmp_path / "x.fits").write_text("no table")
    code, out, _ = run("inspect", tmp_path / "x.fits", "--json")
    assert code == 2
    assert json.loads(out)[0]["problems"]


def test_serve_refuses_a_folder_without_a_survey(run, tmp_path):
    code, _, err = run("serve", tmp_path, "--port", "0", "--no-open")
    assert code == 2
    assert "survey.toml" in err


def test_serve_refuses_a_port_in_use(run, tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        code, _, err = run("serve", tmp_path, "--port", taken.getsockname()[1], "--no-open")
    assert code == 2
    assert "expected an address and a port that are free" in err
    assert "--port 0 selects a free port" in err


SMALL = ("--orbits", "1", "--stars", "2000")


def test_simulate_writes_a_survey_whose_orbit_can_be_read(run, tmp_path):
    folder = tmp_path / "survey"
    code, out, _ = run("simulate", folder, *SMALL, "--json")
    assert code == 0
    assert json.loads(out) | {"seconds": 0} == {"output": str(folder), "orbits": 1, "seconds": 0}
    made = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert {"survey.toml", "reference.parquet", "truth.parquet", "exposures.parquet"} <= made
    assert "measurements/orbit=0000.parquet" in made
    data = SurveyFolder(str(folder)).read(0)
    assert len(data.measurements) > 0
    assert data.truth is not None


def test_simulate_puts_defects_in_and_inspect_names_them(run, tmp_path):
    folder = tmp_path / "survey"
    defects = ("--defect", "noise=10 %", "--defect", "distortion-drift=100nm", "--magnitudes")
    assert run("simulate", folder, *SMALL, *defects)[0] == 0
    code, out, _ = run("inspect", folder)
    assert re.search(r"obstime .* d, \d{4}-\d\d-\d\d \d\d:\d\d to .* TCB", out)
    assert code == 0
    assert "  simulated with the defect distortion-drift=0.1um\n" in out
    assert "  simulated with the defect noise=10%\n" in out
    measurements = SurveyFolder(str(folder)).read(0).measurements
    assert f"  orbits: 1\n  measurements: {len(measurements):,}\n" in out
    assert measurements["magnitude"].notna().all()


def test_simulate_refuses_an_unknown_defect_and_makes_nothing(run, tmp_path):
    code, _, err = run("simulate", tmp_path / "survey", *SMALL, "--defect", "noize=10%")
    assert code == 2
    assert "expected a defect out of distortion-drift=0.1um, " in err
    assert not (tmp_path / "survey").exists()


def test_simulate_prints_the_number_of_orbits(run, tmp_path):
    code, out, _ = run("simulate", tmp_path / "survey", *SMALL)
    assert code == 0
    assert "survey of 1 orbit, simulated in" in out


def test_simulate_refuses_a_survey_with_other_settings(run, tmp_path):
    run("simulate", tmp_path / "survey", *SMALL)
    before = (tmp_path / "survey" / "survey.toml").read_bytes()
    code, _, err = run("simulate", tmp_path / "survey", *SMALL, "--seed", "5")
    assert code == 2
    assert "expected no survey there yet, found a finished one" in err
    assert (tmp_path / "survey" / "survey.toml").read_bytes() == before


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--orbits", "0"], "--orbits"),
        (["--stars", "none"], "--stars"),
        (["--catalog", "none.fits"], "none.fits"),
    ],
    ids=["no-orbits", "no-number", "no-catalogue"],
)
def test_simulate_with_an_invalid_option_writes_nothing(run, tmp_path, options, message):
    code, _, err = run("simulate", tmp_path / "survey", *options)
    assert code == 2
    assert message in err
    assert not (tmp_path / "survey" / "survey.toml").exists()


def test_simulate_refuses_a_file_as_directory(run, tmp_path):
    (tmp_path / "survey").write_text("a letter")
    code, _, err = run("simulate", tmp_path / "survey", *SMALL)
    assert code == 2
    assert str(tmp_path / "survey") in err
    assert (tmp_path / "survey").read_text() == "a letter"


def test_demo_with_a_port_in_use_makes_no_survey(run, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        code, _, err = run("demo", "--port", taken.getsockname()[1], "--no-open")
    assert code == 2
    assert "port" in err
    assert list(tmp_path.rglob("survey.toml")) == []


def test_fit_excludes_measurements(run, sample, tmp_path):
    output = tmp_path / "r.fits"
    code, out, _ = run("fit", *sample[:2], "-o", output, "--exclude", "detector=1", "--json")
    assert code == 0
    assert 0 < json.loads(out)["n_measurements"] < 36_312
    assert 1 not in set(read_result(output).residuals["detector_id"])


def test_fit_compares_orders(run, sample, tmp_path, compared, monkeypatch):
    monkeypatch.setattr("solver.fit.compare_orders", lambda *_: compared.orders)
    output = tmp_path / "r.fits"
    code, out, _ = run("fit", *sample[:2], "-o", output, "--compare-orders", "--json")
    summary = json.loads(out)
    assert code == 0
    assert [row["order"] for row in summary["orders"]] == list(range(10))
    best = [row["order"] for row in summary["orders"] if row["evidence_below_best"] == 0.0]
    assert best == [5]
    assert "Order 5 has the highest evidence" in summary["preferred_order"]
    assert read_result(output).orders.equals(compared.orders)


@pytest.mark.parametrize(
    ("arguments", "called", "words"),
    [
        (("survey", "DIR"), "plateviz.cli.survey.run_survey", "the same command continues"),
        (
            ("simulate", "DIR"),
            "solver.simulate.survey.simulate_survey",
            "the same command continues",
        ),
        (("fit", "O", "R", "-o", "X"), "plateviz.cli.fit.run_fit", "no solution is written"),
    ],
    ids=["survey", "simulate", "fit"],
)
def test_interrupted_command_says_what_to_do_next(run, monkeypatch, arguments, called, words):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(called, interrupt)
    code, _, err = run(*arguments)
    assert code == 130
    assert f"plateviz: interrupted; {words}" in err
