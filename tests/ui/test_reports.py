"""Reports in a real Chromium, with the network off: drawn whole, nothing fetched, printed."""

import csv
import re
from dataclasses import replace

import pytest

from plateviz.plots.gallery import source_figures, survey_figures
from plateviz.reports.orbit import orbit_report
from plateviz.reports.page import page_of
from plateviz.reports.pdf import print_pdf
from plateviz.reports.report import Report, ReportFigure
from plateviz.tables.survey_tables import SourceTables, SurveyTables
from plateviz.verdict.verdict import Verdict
from solver.data.instrument import MINI_MOCK
from tests.plateviz.conftest import synthetic_fit
from tests.plateviz.survey_tables import synthetic_survey

pytestmark = [pytest.mark.ui, pytest.mark.slow]


@pytest.fixture(scope="module")
def orbit_page(tmp_path_factory):
    """A report of an orbit, compared with another solution."""
    (result, _), (other, _) = synthetic_fit(1), synthetic_fit(2)
    path = tmp_path_factory.mktemp("reports") / "orbit.html"
    path.write_text(page_of(orbit_report(result, MINI_MOCK, {}, other=other)), "utf-8")
    return path


@pytest.fixture(scope="module")
def survey():
    return synthetic_survey()


@pytest.fixture(scope="module")
def survey_page(survey, tmp_path_factory):
    """A report with every figure of a survey and of a source."""
    tables = SurveyTables(survey.orbits, survey.motions, survey.catalogue, survey.truth)
    tables = replace(tables, other=tables)
    source = SourceTables(*survey.source("other"))
    drawn = [
        ReportFigure(f.name, f.title, f.caption, {"All": lambda f=f, t=t: f.plot(t)})
        for figures, t in ((survey_figures(), tables), (source_figures(), source))
        for f in figures
    ]
    path = tmp_path_factory.mktemp("reports") / "survey.html"
    path.write_text(page_of(Report("S", "", Verdict("good", "", [], []), [], drawn)), "utf-8")
    return path


@pytest.fixture
def open_report(browser):
    """Open a report with the network off; what it asks for or complains of fails the test."""
    complaints, contexts = [], []

    def open_at(path, scheme="light"):
        context = browser.new_context(offline=True, color_scheme=scheme, accept_downloads=True)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(90_000)
        page.on("console", lambda m: m.type in ("error", "warning") and complaints.append(m.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", lambda r: r.url == path.as_uri() or complaints.append(r.url))
        page.goto(path.as_uri())
        page.wait_for_selector(f"body[data-drawn={scheme}]", state="attached")
        return page

    yield open_at
    for context in contexts:
        context.close()
    assert complaints == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("name", ["orbit_page", "survey_page"])
def test_report_draws_every_figure_and_fetches_nothing(open_report, request, name, scheme):
    page = open_report(request.getfixturevalue(name), scheme)
    figures = page.locator("figure")
    assert figures.count() > 5
    for i in range(figures.count()):
        canvases = figures.nth(i).locator(".plot canvas")
        assert canvases.count() > 0
        assert canvases.first.evaluate("canvas => canvas.width * canvas.height") > 10_000


def test_reader_changes_theme_and_chooses_among_what_is_embedded(open_report, orbit_page):
    page = open_report(orbit_page)
    figure = page.locator("#figure-residual-map")
    titles = "() => Bokeh.documents.flatMap(d => [...d._all_models.values()]).map(m => m.text)"
    assert "Residuals on detector 0, measured minus predicted" not in page.evaluate(titles)
    figure.locator("select").select_option(index=1)
    page.wait_for_selector("#figure-residual-map[data-drawn='1 light']")
    assert "Residuals on detector 0, measured minus predicted" in page.evaluate(titles)
    page.click("#theme")
    page.wait_for_selector("body[data-drawn=dark]", state="attached")
    background = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert background == "rgb(18, 18, 18)"


def test_values_behind_a_figure_can_be_saved(open_report, survey_page, tmp_path, survey):
    page = open_report(survey_page)
    with page.expect_download() as waiting:
        page.click("#figure-orbit-health button.values")
    waiting.value.save_as(tmp_path / "values.csv")
    rows = csv.reader((tmp_path / "values.csv").read_text(encoding="utf-8").splitlines())
    found = {value for row in rows for value in row}
    fitted = survey.orbits.loc[survey.orbits["status"] == "complete", "orbit_id"]
    assert set(fitted.astype(str)) <= found


def test_report_is_printed_with_all_its_figures(orbit_page, chromium_path, tmp_path):
    print_pdf(orbit_page, tmp_path / "r.pdf")
    content = (tmp_path / "r.pdf").read_bytes()
    assert content.startswith(b"%PDF-")
    assert len(re.findall(rb"/Type\s*/Page\b", content)) > 4
    # Each figure is a canvas, printed as an image or more.
    assert len(re.findall(rb"/Subtype\s*/Image", content)) > 10
