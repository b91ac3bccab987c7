"""Pages of reports: their content, reproducible bytes, and no external resources."""

import re
from dataclasses import replace
from datetime import UTC, datetime

import pandas as pd
import pytest

from plateviz.plots.gallery import diagnostics
from plateviz.reports.orbit import failed_orbit_report, orbit_report
from plateviz.reports.page import page_of
from plateviz.reports.report import Report
from plateviz.verdict.verdict import Verdict
from solver.data.orbit import OrbitData
from solver.errors import InputError

OF_COMPARISON = {"comparison", "distortion-comparison", "distortion-truth", "orders"}
FACTS = {"Report": {"Command": "plateviz report <b>here</b>"}}
MADE = datetime(2030, 1, 2, 3, 4, 5, tzinfo=UTC)
_ADDRESS = re.compile(r"""(?:src|href)=["']?(?!data:)[^"'\s>]+|@import|url\(""")


@pytest.fixture(scope="module")
def report(fit_result, instrument):
    return orbit_report(fit_result, instrument, FACTS)


@pytest.fixture(scope="module")
def page(report):
    return page_of(report, made=MADE)


def shell_of(page):
    """Return the page without scripts and documents."""
    return re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)


def test_page_is_reproducible_except_for_its_time(fit_result, instrument, few_figures):
    report = orbit_report(fit_result, instrument, FACTS)
    page, later = (page_of(report, made=MADE.replace(year=year)) for year in (2030, 2031))
    assert later != page
    assert later.replace("2031-01-02", "2030-01-02") == page


def test_page_has_no_external_resources(page):
    assert _ADDRESS.findall(shell_of(page)) == []


def test_page_has_every_figure_with_data_and_its_caption(report, page, fit_result):
    shell = shell_of(page)
    for diagnostic in diagnostics():
        there = f'id="figure-{diagnostic.name}"' in shell
        assert there == (diagnostic.name not in OF_COMPARISON)
    assert all(figure.title in shell for figure in report.figures)


def test_choices_can_be_left_out(fit_result, instrument, report):
    plain = orbit_report(fit_result, instrument, FACTS, has_choices=False)
    assert [f.name for f in plain.figures] == [f.name for f in report.figures]
    assert all(len(figure.choices) == 1 for figure in plain.figures)
    assert any(len(figure.choices) > 1 for figure in report.figures)


def test_page_has_command_settings_and_hashes(fit_result, instrument, few_figures):
    hashed = replace(fit_result, provenance={"obs.fits": "0123abcd"})
    shell = shell_of(page_of(orbit_report(hashed, instrument, FACTS)))
    for text in ("plateviz report &lt;b&gt;here&lt;/b&gt;", "0123abcd", "gauss-newton"):
        assert text in shell


def test_text_is_escaped():
    verdict = Verdict("warn", "<script>alert(1)</script>", [], [])
    report = Report("a & b", "", verdict, [], [], {"T": pd.DataFrame({"<i>": ["</table>"]})})
    shell = page_of(report)
    assert "<script>alert(1)" not in shell
    assert "a &amp; b" in shell
    assert "&lt;/table&gt;" in shell


def test_coordinates_have_ten_decimals_and_nan_is_empty():
    table = pd.DataFrame({"RA [deg]": [266.12345678912], "σ": [float("nan")]})
    shell = page_of(Report("t", "", Verdict("good", "", [], []), [], [], {"T": table}))
    assert "<td>266.1234567891</td><td></td>" in shell


def test_report_without_a_truth_has_no_deviation_and_a_remark(fit_result, instrument):
    summary = {k: v for k, v in fit_result.summary.items() if k != "truth"}
    blind = replace(fit_result, true_places=None, summary=summary)
    report = orbit_report(blind, instrument, {})
    assert "deviation" not in [figure.name for figure in report.figures]
    assert any("no truth" in sentence for sentence in report.verdict.notable)


def test_two_solutions_are_compared(fit_result, instrument):
    report = orbit_report(fit_result, instrument, {}, other=fit_result)
    assert "comparison" in [figure.name for figure in report.figures]


def test_selections_are_all_then_each_detector_then_the_farthest_exposures(report):
    choices = next(f.choices for f in report.figures if f.name == "residual-map")
    labels = list(choices)
    assert labels[0] == "All exposures and detectors"
    assert labels[1:5] == [f"All exposures, detector {number}" for number in (0, 1, 2, 3)]
    assert all("χ²/dof" in label for label in labels[5:])
    assert len(labels) == 8


def test_report_of_a_failed_orbit_has_the_reason(made_survey):
    from plateviz.solving.origin import SurveyFolder

    data: OrbitData = SurveyFolder(str(made_survey)).read(1)
    report = failed_orbit_report(data, "orbit 1: singular", {})
    page = page_of(report)
    assert "This orbit has no solution." in page
    assert "orbit 1: singular" in page
    assert f"{len(data.measurements):,} measurements" in page


def test_solution_of_another_instrument_is_not_compared(fit_result, instrument):
    other = replace(fit_result, instrument=replace(instrument, distortion_scale_um=4.2e4))
    with pytest.raises(InputError, match="two solutions with the same instrument to compare"):
        orbit_report(fit_result, instrument, {}, other=other)
