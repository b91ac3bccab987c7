"""A solution as code: what is read back equals the settings, and makes the same numbers."""

import shlex
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import plateviz
from plateviz.cli.main import main
from plateviz.cli.options import fit_settings, takes_settings
from plateviz.dashboard.saving.as_code import (
    as_command,
    as_python,
    explored_as_python,
    figures_as_python,
    report_command,
)
from plateviz.notebook.keywords import settings_with
from plateviz.plots.diagnostic import Chosen
from plateviz.plots.explore.explore import explored_figure
from plateviz.plots.explore.explored_rows import ExploredColumns
from plateviz.plots.explore.explored_text import text_of
from plateviz.plots.gallery import diagnostics
from plateviz.reports.summary_strip import strip
from plateviz.runs.run import open_run
from plateviz.solving.origin import OrbitFiles, SurveyFolder
from plateviz.tables import summary_strip
from plateviz.tables.explore import EXPLORABLE
from solver.data.engine_settings import engine_settings
from solver.data.instrument import MINI_MOCK
from solver.data.settings import SETTINGS, FitSettings
from solver.data.subset import Subset

SURVEY = SurveyFolder("/data/my sky")
FILES = OrbitFiles("/data/o'b.fits", "/data/ref.fits", truth="/data/t.fits", orbit=7)
OF_SURVEYS = [
    FitSettings(),
    FitSettings(order=7, aberration=False, robust=True, thin=3),
    FitSettings(prior_widths={"distortion_x": 1 / 3, "position_angle": float("inf")}),
    FitSettings(prior_shifts={"focal_length": 100.0, "detector_x[2]": -5.25, "sources[ra]": 0.1}),
    FitSettings(
        exclusions=Subset(
            sources=frozenset({-(2**62), 12}),
            exposures=frozenset({(0, 3)}),
            detectors=frozenset({1}),
        )
    ),
    FitSettings(engine="nuts", **engine_settings(seed=4)),
    FitSettings(
        focal_anisotropy=True,
        drift=2,
        drift_in_time=3,
        drift_walk=2,
        breathing=3,
        breathing_period=90.5,
        field_distortion=4,
        detector_distortion=3,
        detector_motion=True,
        charge_transfer=True,
        magnitude_shift=True,
        pixel_phase=True,
        noise_floor=True,
        reference_scale=True,
    ),
    FitSettings(noise_by_exposure=True, noise_by_magnitude=True, noise_scale=True),
]
OF_FILES = [
    FitSettings(compare_orders=True),
    FitSettings(engine="svi", **engine_settings(seed=2, steps=30)),
    FitSettings(engine="svi", **engine_settings(steps=2000, compat="warpfield")),
]


def words_of(command):
    """The words of a command as a shell would read them."""
    return shlex.split(command.replace("\\\n", ""))


def read_options(words, command):
    """The settings that a command's options give."""
    taken = []

    @takes_settings(command)
    def take(**values):
        taken.append(fit_settings(values))

    app = typer.Typer()
    app.command()(take)
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    return taken[0]


@pytest.mark.parametrize("settings", OF_SURVEYS)
def test_command_of_a_survey_has_the_settings(settings):
    program, command, directory, *words = words_of(as_command(SURVEY, 12, settings))
    assert (program, command, directory) == ("plateviz", "survey", "/data/my sky")
    assert words[:4] == ["--run", "reproduced", "--orbits", "12"]
    assert read_options(words[4:], "survey") == settings


@pytest.mark.parametrize("settings", OF_SURVEYS + OF_FILES)
def test_command_of_files_has_the_settings(settings):
    words = words_of(as_command(FILES, 7, settings))
    assert words[:6] == [
        "plateviz",
        "fit",
        "/data/o'b.fits",
        "/data/ref.fits",
        "-o",
        "reproduced.fits",
    ]
    assert words[6:10] == ["--truth", "/data/t.fits", "--orbit", "7"]
    assert read_options(words[10:], "fit") == settings


@pytest.mark.parametrize("settings", OF_SURVEYS + OF_FILES)
@pytest.mark.parametrize("origin", [SURVEY, FILES])
def test_python_has_the_settings(origin, settings, monkeypatch):
    opened, fitted = [], []
    orbit = SimpleNamespace(fit=lambda **changes: fitted.append(changes))
    survey = SimpleNamespace(orbit=lambda number: opened.append(number) or orbit, fit=orbit.fit)
    monkeypatch.setattr(
        plateviz, "open", lambda *paths, **files: opened.append((paths, files)) or survey
    )
    exec(as_python(origin, 12, settings), {})
    if origin is SURVEY:
        assert opened == [(("/data/my sky",), {}), 12]
    else:
        assert opened == [
            (("/data/o'b.fits", "/data/ref.fits"), {"truth": "/data/t.fits", "orbit": 7})
        ]
    assert settings_with(FitSettings(), fitted[0]) == settings


def test_every_option_and_keyword_is_of_a_setting_that_is_tried():
    tried = OF_SURVEYS + OF_FILES
    for name, one in SETTINGS.items():
        if one.option or one.keyword:
            assert len({repr(getattr(settings, name)) for settings in tried}) > 1, name


def test_survey_needs_an_orbit():
    with pytest.raises(ValueError, match="expected an orbit_id"):
        as_command(SURVEY, None, FitSettings())


@pytest.mark.parametrize(
    ("origin", "words"),
    [
        (SURVEY, ["/data/my sky", "--run", "reproduced", "--orbit", "12", "--other", "second"]),
        (FILES, ["reproduced.fits", "--other", "second.fits"]),
        (
            OrbitFiles("o.fits", "r.fits", instrument="a camera.toml"),
            ["reproduced.fits", "--instrument", "a camera.toml", "--other", "second.fits"],
        ),
    ],
    ids=["survey", "files", "camera"],
)
def test_report_is_of_what_the_commands_make(origin, words):
    found = words_of(report_command(origin, 12, "second"))
    assert found == ["plateviz", "report", *words, "-o", "reproduced.html"]
    assert "second" in as_command(origin, 12, FitSettings(), "second")


@pytest.mark.slow
@pytest.mark.usefixtures("few_figures")
def test_command_and_python_make_the_same_numbers(small_survey, tmp_path, monkeypatch):
    survey = tmp_path / "a sky"
    survey.symlink_to(small_survey)
    origin = SurveyFolder(str(survey))
    settings = FitSettings(order=6, prior_widths={"distortion_x": 2.5})
    command = words_of(as_command(origin, 1, settings))
    subprocess.run([sys.executable, "-m", "plateviz.cli.main", *command[1:]], check=True)
    by_command = open_run(Path(survey), "reproduced").result(1)
    namespace = {}
    drawn = figures_as_python("solution", [("residual-map", {"exposures": [(0, 3)]})])
    exec(f"{as_python(origin, 1, settings)}\n{drawn}", namespace)
    explored = ExploredColumns(
        "n_obs", "sigma_ra_marginal", only="dof", lowest=20.0, has_median=True
    )
    more = explored_as_python("solution", "sources", explored, "dark")
    exec(more.replace("figures", "more"), namespace)
    by_python = namespace["solution"].sources
    for name in ("ra", "dec"):
        # Degrees; the number of threads of the linear algebra changes the last digit.
        np.testing.assert_allclose(by_command.sources[name], by_python[name], rtol=0, atol=1e-12)
    (diagnostic,) = [one for one in diagnostics() if one.name == "residual-map"]
    expected = diagnostic.plot(Chosen(by_command, MINI_MOCK, ((0, 3),)))[0]["tails"].columns
    found = namespace["figures"][0]._plot()[0]["tails"].columns
    assert len(expected["x"]) > 10
    for name, values in expected.items():
        if values.dtype.kind == "f":
            np.testing.assert_allclose(found[name], values, rtol=1e-6, atol=1e-6)
        else:
            np.testing.assert_array_equal(found[name], values)
    (frame,) = explored_figure(EXPLORABLE["sources"](by_command), explored)
    marks = namespace["more"][0]._plot()[0]["rows by class"]
    np.testing.assert_allclose(marks.values("y"), frame["rows by class"].values("y"), rtol=1e-6)
    monkeypatch.chdir(tmp_path)
    more = ["--explore", text_of("sources", explored)]
    monkeypatch.setattr(sys, "argv", words_of(report_command(origin, 1, more=more)))
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    page = (tmp_path / "reproduced.html").read_text(encoding="utf-8")
    assert "<title>Orbit 1 " in page
    assert 'id="figure-explore-0"' in page
    assert strip(summary_strip(by_command)) in page
