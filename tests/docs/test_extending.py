"""The worked examples of the page on extending: put into a copy of the code, and run there."""

import os
import re
import shutil
import subprocess
import sys

import pytest

from tests.docs.pages import DOCS, REPOSITORY, blocks_of, section_of

PAGE = DOCS / "extending.md"
PACKAGES = ("plateviz", "solver")
# How many points the figure of the example has in Bokeh.
COUNTED = """
import holoviews as hv
from bokeh.models import GlyphRenderer

drawn = hv.render(figure, backend="bokeh").select(type=GlyphRenderer)
print(max(len(one.data_source.data.get("rms", ())) for one in drawn), "points")
"""
_PATH = re.compile(r"`((?:plateviz|solver)/[\w/]+\.py|[\w.]+\.toml)`")


def blocks_in(heading, language):
    section = section_of(PAGE, heading)
    return [block for block in blocks_of(PAGE, language) if block.text in section]


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


def apply(patch, folder):
    """Change a file as a diff says whose hunks are found by their text alone."""
    head, *hunks = re.split(r"^@@.*\n", patch, flags=re.MULTILINE)
    path = folder / re.search(r"^\+\+\+ b/(.+)$", head, flags=re.MULTILINE)[1]
    text = path.read_text("utf-8")
    for hunk in hunks:
        lines = hunk.splitlines(keepends=True)
        old = "".join(line[1:] for line in lines if line[0] in " -")
        new = "".join(line[1:] for line in lines if line[0] in " +")
        assert text.count(old) == 1, f"the page's change of {path.name} fits it no longer:\n{old}"
        text = text.replace(old, new)
    path.write_text(text, "utf-8")


@pytest.mark.slow
def test_diagnostic_is_found_and_drawn(tree, run_in):
    *files, use = blocks_in("Add a diagnostic", "python")
    assert len(files) == 2
    for block in files:
        (tree / named_path(block)).write_text(block.text, "utf-8")
    assert run_in(tree, "-c", use.text + COUNTED) == "12 points\n"


def test_diagnostic_keeps_to_the_style_of_the_house(tree, run_in):
    for block in blocks_in("Add a diagnostic", "python")[:2]:
        path = tree / named_path(block)
        path.write_text(block.text, "utf-8")
        run_in(tree, "-m", "ruff", "check", str(path))
        run_in(tree, "-m", "ruff", "format", "--diff", str(path))


@pytest.mark.slow
def test_parameter_group_is_fitted(tree, run_in):
    for block in blocks_in("Add a parameter group", "diff"):
        apply(block.text, tree)
    (use,) = blocks_in("Add a parameter group", "python")
    printed = run_in(tree, "-c", use.text)
    found, sigma = map(float, re.fullmatch(r"(\S+) ± (\S+) arcsec\n", printed).groups())
    assert found == pytest.approx(5.0, abs=4.0 * sigma)
    assert sigma < 4.0
    assert "detector_skew" in run_in(tree, "-m", "plateviz.cli.main", "fit", "--help")


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
