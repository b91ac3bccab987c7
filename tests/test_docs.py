"""The page on uncertainties: its script predicts correctly, and the page quotes its output."""

import contextlib
import importlib.util
import io
import re
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent
DOCS = REPOSITORY / "assets" / "docs"
PAGE = (DOCS / "uncertainties.md").read_text("utf-8")
MARKED = r"<!-- output of: (.+?) -->\n```text\n(.+?)```\n<!-- end of output -->"
BLOCK = re.search(MARKED, PAGE, re.DOTALL)
PROSE = " ".join(PAGE[: PAGE.index("## Output")].split())
KINDS = ("reference", "non-reference", "artificial")
LABEL = 62

# Quotations of the prose, with {} for the number from the output.
QUOTED = [
    ("reported sigma: conditional, median", "reference", "{} µas, from 143 to 291"),
    ("scatter over orbits, predicted", "reference", "{} µas predicted"),
    ("scatter over orbits, measured", "reference", "{} µas measured"),
    ("  of one star alone, sigma_conditional^2 / sigma_d", "reference", "one star alone, {} µas"),
    ("scatter over orbits, changes of the offset", "reference", "by {} µas rms"),
    ("scatter over orbits, predicted", "non-reference", "scatter, {} µas"),
    ("marginal sigma, rms", "non-reference", "marginal sigma, {} µas"),
    ("  of which the catalogue's errors", "non-reference", "$H^{{-1}} P H^{{-1}}$, {} µas"),
    ("offset from the catalogue's errors, rms", "non-reference", "{} µas with the true errors"),
    ("  of which the same in every orbit", "non-reference", "{} µas are the same"),
    ("normalised deviation, measured", "reference", "measured {}"),
    ("normalised deviation, expected", "reference", "in the survey {},"),
    ("scatter, measured over predicted", "reference", "{} ± "),
    ("scatter, measured over predicted", "non-reference", "{} ± "),
    ("pull by the marginal sigma, rms", "reference", "rms of {}."),
    ("  its marginal error, rms", "non-reference", "marginal error is {} µas"),
    ("  its deviation from the truth, rms over orbits", "non-reference", "was {} µas"),
    ("  largest correlation of alpha* and delta", "non-reference", "in the survey is {},"),
]


def rows_of(text):
    """Return label -> columns of all rows."""
    lines = [line for line in text.splitlines()[2:] if line.strip()]
    return {line[:LABEL].rstrip(): line[LABEL:].split() for line in lines}


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("uncertainties", DOCS / "uncertainties.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def printed(script):
    """The output for the small survey that the page also names."""
    with contextlib.redirect_stdout(io.StringIO()) as output:
        script.main(["--orbits", "4", "--stars", "4000"])
    return rows_of(output.getvalue())


@pytest.fixture(scope="module")
def quoted():
    return rows_of(BLOCK[2])


def number(rows, label, kind):
    return float(rows[label][KINDS.index(kind)])


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_scatter_over_orbits_is_as_predicted(printed, kind):
    found = number(printed, "scatter, measured over predicted", kind)
    error = number(printed, "  its sampling error", kind)
    assert found == pytest.approx(1.0, abs=4.0 * error)
    assert error < 0.25


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_deviation_without_catalogue_part_scatters_by_noise(printed, kind):
    label = "pull of what the catalogue leaves, by noise, rms"
    assert number(printed, label, kind) == pytest.approx(1.0, abs=0.2)


@pytest.mark.slow
def test_few_references_raise_the_other_sigmas_by_a_fifth(printed):
    found = number(printed, "marginal over conditional sigma, median", "non-reference")
    assert found == pytest.approx(1.20, abs=0.03)
    assert "by 20 % where some 50 reference stars" in PROSE


@pytest.mark.slow
def test_few_references_make_a_reference_star_scatter_less(printed):
    assert number(printed, "scatter over orbits, noise", "reference") == pytest.approx(67, abs=2)
    alone = "  of one star alone, sigma_conditional^2 / sigma_d"
    assert number(printed, alone, "reference") == pytest.approx(79, abs=2)
    assert "with some 50 it is 67 instead of 79 µas" in PROSE
    count = "mean of all sources of an orbit: number of sources, median"
    assert number(printed, count, "reference") == pytest.approx(50, abs=3)


@pytest.mark.slow
def test_output_in_the_page_has_the_rows_that_the_script_prints(printed, quoted):
    assert list(quoted) == list(printed)
    assert BLOCK[1].startswith("python assets/docs/uncertainties.py")


@pytest.mark.parametrize(("label", "kind", "words"), QUOTED)
def test_prose_quotes_the_output(quoted, label, kind, words):
    assert words.format(quoted[label][KINDS.index(kind)]) in PROSE


def test_measured_and_predicted_scatter_in_the_page_agree(quoted):
    for kind in KINDS:
        found = number(quoted, "scatter, measured over predicted", kind)
        error = number(quoted, "  its sampling error", kind)
        assert found == pytest.approx(1.0, abs=4.0 * error)


def test_files_named_in_the_page_exist():
    named = set(re.findall(r"`((?:solver|tests)/[\w/]+\.py)`", PAGE))
    assert len(named) >= 6
    assert not {name for name in named if not (REPOSITORY / name).is_file()}


def test_readme_links_to_the_page():
    assert "(assets/docs/uncertainties.md)" in (REPOSITORY / "README.md").read_text("utf-8")


def test_one_orbit_has_no_scatter(script, capsys):
    with pytest.raises(SystemExit, match="2"):
        script.main(["--orbits", "1"])
    assert "expected at least 2 orbits, found 1" in capsys.readouterr().err
