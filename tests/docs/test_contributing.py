"""The recipes of the contributing page: applied to a copy of the code, and run there."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from astropy.io import fits
from astropy.table import Table

from solver.io.result import read_result
from tests.docs.pages import DOCS, REPOSITORY, blocks_of, section_of
from tests.test_architecture import FOLDERS

PAGE = DOCS / "contributing.md"
PACKAGES = ("plateviz", "solver")
# Prints the number of points that Bokeh draws of a column of the example's figure.
COUNTED = """
from bokeh.models import GlyphRenderer
from plateviz.figures.bokeh_figure import BokehFigure

drawn = BokehFigure(figure, "light").model.select({"type": GlyphRenderer})
print(max(len(one.data_source.data.get("rms", ())) for one in drawn), "points")
"""
_PATH = re.compile(r"`((?:plateviz|solver)/[\w/]+\.py|[\w.]+\.toml)`")


# The files that the recipe of a parameter group touches.
GROUP_FILES = {"solver/data/parameters.py", "solver/model/forward.py"}
# What the dashboard and the notebook make of the setting of the example.
CONTROLS = """
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.fit_choices import ANSWERED_AT_ONCE, FitChoices
from plateviz.dashboard.views.controls.refit import RefitView
from plateviz.notebook.keywords import settings_with
from solver.data.settings import FitSettings

choices = FitChoices(min_obs=3)
assert choices.settings() == settings_with(FitSettings(), {"min_obs": 3})
print("min_obs", "at once" if "min_obs" in ANSWERED_AT_ONCE else "on request")
"""


def blocks_in(heading, language):
    section = section_of(PAGE, heading)
    return [block for block in blocks_of(PAGE, language) if block.text in section]


def files_in(heading):
    """Return the Python blocks that are whole files: those that begin with a docstring."""
    return [block for block in blocks_in(heading, "python") if block.text.startswith('"""')]


def uses_in(heading):
    """Return the Python blocks that use what was added."""
    return [block for block in blocks_in(heading, "python") if not block.text.startswith('"""')]


def named_path(block):
    """Return the path that the paragraph before a block names."""
    before = PAGE.read_text("utf-8").split(block.text)[0]
    return _PATH.findall(before)[-1]


@pytest.fixture
def tree(tmp_path):
    """A copy of both packages, with their settings of the linter."""
    folder = tmp_path / "tree"
    folder.mkdir()
    shutil.copy(REPOSITORY / "pyproject.toml", folder)
    for package in PACKAGES:
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(REPOSITORY / package, folder / package, ignore=ignored)
    return folder


@pytest.fixture
def run_in(workplace):
    """Return the function that runs Python with the packages of a folder: what it prints."""

    def run(folder, *arguments):
        environment = {**os.environ, "PYTHONPATH": str(folder), "JAX_ENABLE_X64": "1"}
        ended = subprocess.run(
            [sys.executable, *arguments],
            cwd=workplace,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert ended.returncode == 0, ended.stdout + ended.stderr
        return ended.stdout

    return run


@pytest.fixture
def plateviz_in(run_in):
    """Return the function that runs a command line of plateviz with the packages of a folder."""

    def run(folder, line, *options):
        _, *words = shlex.split(line)
        return run_in(folder, "-m", "plateviz.cli.main", *words, *options)

    return run


def apply(patch, folder):
    """Apply a diff to a file; each hunk is found by its text alone."""
    head, *hunks = re.split(r"^@@.*\n", patch, flags=re.MULTILINE)
    path = folder / re.search(r"^\+\+\+ b/(.+)$", head, flags=re.MULTILINE)[1]
    text = path.read_text("utf-8")
    for hunk in hunks:
        lines = hunk.splitlines(keepends=True)
        old = "".join(line[1:] for line in lines if line[0] in " -")
        new = "".join(line[1:] for line in lines if line[0] in " +")
        assert text.count(old) == 1, f"the page's change of {path.name} no longer applies:\n{old}"
        text = text.replace(old, new)
    path.write_text(text, "utf-8")


def add(heading, folder):
    """Write the files of a recipe and apply its diffs; return the paths that they touch."""
    touched = []
    for block in files_in(heading):
        (folder / named_path(block)).write_text(block.text, "utf-8")
        touched.append(named_path(block))
    for block in blocks_in(heading, "diff"):
        apply(block.text, folder)
        touched.append(re.search(r"^\+\+\+ b/(.+)$", block.text, flags=re.MULTILINE)[1])
    return touched


@pytest.mark.slow
def test_diagnostics_are_found_and_drawn(tree, run_in):
    assert len(add("Add a diagnostic", tree)) == 4
    of_orbit, of_survey = uses_in("Add a diagnostic")
    assert run_in(tree, "-c", of_orbit.text + COUNTED) == "12 points\n"
    assert run_in(tree, "-c", of_survey.text + COUNTED) == "2 points\n"


@pytest.mark.tools
def test_recipes_are_clean_code(tree, run_in):
    headings = (
        *("Add a diagnostic", "Add a parameter group", "Add a setting"),
        *("Add an engine", "Add a file format"),
    )
    paths = sorted({str(tree / path) for heading in headings for path in add(heading, tree)})
    run_in(tree, "-m", "ruff", "check", *paths)
    run_in(tree, "-m", "ruff", "format", "--diff", *paths)


@pytest.mark.full
@pytest.mark.slow
def test_parameter_group_is_fitted(tree, run_in):
    assert set(add("Add a parameter group", tree)) == GROUP_FILES
    (use,) = uses_in("Add a parameter group")
    printed = run_in(tree, "-c", use.text)
    found, sigma = map(float, re.fullmatch(r"(\S+) ± (\S+) ppm\n", printed).groups())
    assert found == pytest.approx(40.0, abs=4.0 * sigma)
    assert sigma < 10.0
    assert "detector_taper" in run_in(tree, "-m", "plateviz.cli.main", "fit", "--help")


@pytest.mark.full
@pytest.mark.slow
def test_group_on_exposures_is_fitted_and_published(tree, plateviz_in, workplace):
    add("Add a parameter group", tree)
    (block,) = blocks_in("Add a parameter group", "sh")
    (line,) = block.commands()
    assert json.loads(plateviz_in(tree, line, "--json"))["converged"]
    calibration = Table.read(workplace / "STRETCHED.fits", "CALIBRATION")
    rows = calibration[calibration["group"] == "focal_stretch"]
    assert (rows["prior_sigma"] == 20.0).all()
    assert rows["prior_centre"][0] == 5.0
    assert (rows["sigma_marginal"] < 20.0).all()
    telescope = Table.read(workplace / "STRETCHED.fits", "TELESCOPE")
    ratio = np.asarray(telescope["tel_f_loc_y"] / telescope["tel_f_loc_x"])
    np.testing.assert_allclose(1e6 * (ratio - 1.0), rows["value"], atol=1e-6)


@pytest.mark.full
@pytest.mark.slow
def test_setting_reaches_every_interface(tree, run_in, plateviz_in, workplace):
    assert set(add("Add a setting", tree)) == {
        "solver/data/settings.py",
        "solver/problem/problem_cache.py",
    }
    (use,) = uses_in("Add a setting")
    printed = run_in(tree, "-c", use.text)
    assert printed == "order 5, 20 measurements or more per source True\n"
    (block,) = blocks_in("Add a setting", "sh")
    (line,) = block.commands()
    summary = json.loads(plateviz_in(tree, line, "--json"))
    assert summary["n_sources"] < len(Table.read(workplace / "RESULT.fits", "RESULT"))
    assert fits.getheader(workplace / "FREQUENT.fits")["MINOBS"] == 20
    assert "--min-obs" in run_in(tree, "-m", "plateviz.cli.main", "survey", "--help")
    assert run_in(tree, "-c", CONTROLS) == "min_obs at once\n"


@pytest.mark.full
@pytest.mark.slow
def test_engine_agrees_with_gauss_newton(tree, plateviz_in, workplace):
    add("Add an engine", tree)
    (block,) = blocks_in("Add an engine", "sh")
    (line,) = block.commands()
    summary = json.loads(plateviz_in(tree, line, "--json"))
    assert summary["converged"]
    assert summary["engine"] == "undamped"
    # Only the copy knows the engine: `read_result` of the checkout refuses its settings.
    found = Table.read(workplace / "UNDAMPED.fits", "RESULT")
    expected = Table.read(workplace / "RESULT.fits", "RESULT")
    for axis in ("a", "d"):
        moved = np.abs(found[f"src_{axis}_loc"] - expected[f"src_{axis}_loc"])
        assert np.max(moved / expected[f"src_{axis}_marg"]) < 0.01


@pytest.mark.full
@pytest.mark.slow
def test_instrument_is_simulated_and_fitted(command, workplace, capsys):
    (file,) = blocks_in("Add an instrument", "toml")
    (workplace / named_path(file)).write_text(file.text, "utf-8")
    (use,) = blocks_in("Add an instrument", "python")
    exec(compile(use.text, use.name, "exec"), {})
    converged, chi2_per_dof = capsys.readouterr().out.split()
    assert converged == "True"
    assert float(chi2_per_dof) == pytest.approx(1.0, abs=0.05)
    (block,) = blocks_in("Add an instrument", "sh")
    survey, serve = block.commands()
    assert command(survey.split()) == 0
    assert (workplace / "CAMERA" / "runs" / "default" / "COMPLETE").is_file()
    assert command([*serve.split(), "--port", "0"]) == 0


@pytest.mark.full
@pytest.mark.slow
def test_file_format_is_read_and_fitted(tree, run_in, plateviz_in, workplace):
    assert add("Add a file format", tree) == ["solver/io/feather.py", "solver/io/formats.py"]
    (use,) = uses_in("Add a file format")
    rows = len(read_result(Path("RESULT.fits")).residuals)
    assert run_in(tree, "-c", use.text) == f"{rows} measurements\n"
    (block,) = blocks_in("Add a file format", "sh")
    inspect, fit = block.commands()
    plateviz_in(tree, inspect)
    assert json.loads(plateviz_in(tree, fit, "--json"))["n_measurements"] == rows


def test_every_folder_has_a_line_in_order():
    rows = re.findall(r"^\| (.+?) \|", section_of(PAGE, "Where a line belongs"), re.MULTILINE)
    named = [name for row in rows for name in re.findall(r"`(\w+/\w+(?:\.py)?)`", row)]
    wanted = [f"{package}/{folder}" for package in FOLDERS for folder in FOLDERS[package]]
    assert [name.removesuffix(".py") for name in named] == wanted
    assert all((REPOSITORY / name).exists() for name in named)
