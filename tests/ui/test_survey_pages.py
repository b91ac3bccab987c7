"""The three views of a fitted survey in a real Chromium: from an orbit to a source and back."""

import re

import pytest
from playwright.sync_api import expect

from plateviz.plots.gallery import diagnostics, source_figures, survey_figures
from plateviz.plots.workspace import SourceWorkspace, SurveyWorkspace
from plateviz.runs.fit_survey import fit_survey
from solver.data.settings import FitSettings
from solver.io.survey import read_survey_orbit
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey
from tests.fitting import fitting_in_this_process
from tests.ui.accessibility import require_accessible
from tests.ui.conftest import (
    VIEWS,
    drag,
    explored,
    see,
    serving,
    turn_dark,
    turn_to_workspace,
    until,
)

expect.set_options(timeout=60_000)
pytestmark = [pytest.mark.ui, pytest.mark.slow]

N_ORBITS = 3
# They ask for more orbits, or for more of a source, than a small survey has.
EMPTY = {"reference-scatter", "motion-pulls", "calibration-trends", "zonal-errors"}

# Rows of the longest data source of a figure, words apart, in a list: empty until it is drawn.
ROWS_OF = f"""name => {{ {VIEWS}
  const drawn = figures.filter(view => card(view) === name);
  const shown = drawn.flatMap(view => view.model.renderers)
    .filter(r => r.visible && r.glyph?.type !== 'Text');
  const rows = shown.map(r => r.data_source?.get_length() ?? 0);
  return drawn.length ? [Math.max(0, ...rows)] : []; }}"""
# Where the first point of a figure that links somewhere is on the screen, and its value.
POINT = f"""([name, key]) => {{ {VIEWS}
  for (const figure of figures.filter(view => card(view) === name))
    for (const renderer of figure.model.renderers) {{
      const source = renderer.data_source, values = source && column(source, key);
      if (!values) continue;
      const box = figure.canvas_view.el.getBoundingClientRect();
      const [x, y] = ['x', 'y'].map(axis => column(source, renderer.glyph[axis].field)[0]);
      return {{value: String(values[0]), x: box.x + figure.frame.x_scale.compute(x),
               y: box.y + figure.frame.y_scale.compute(y)}};
    }} }}"""


@pytest.fixture(scope="module")
def simulated(tmp_path_factory, chromium_path):
    directory = tmp_path_factory.mktemp("survey") / "sky"
    simulate_survey(directory, SurveySettings(orbits=N_ORBITS, seed=5).scaled(6_000))
    return directory


@pytest.fixture(scope="module")
def served(simulated):
    with fitting_in_this_process():
        for run, settings in (("default", FitSettings()), ("low", FitSettings(order=3))):
            assert not fit_survey(simulated, run, settings).failed
    with serving("serve", str(simulated), "--port", "0") as address:
        yield address


@pytest.fixture
def page(served, open_page):
    return open_page(served)


def turn_to(page, view):
    page.get_by_role("button", name=view, exact=True).click()
    page.wait_for_url(f"**view={view.lower()}**")


def drawn(page, figures):
    """Go to each figure and wait for it; give the rows of each."""
    rows = {}
    for figure in figures:
        see(page, figure.name)
        [rows[figure.name]] = until(page, lambda name=figure.name: page.evaluate(ROWS_OF, name))
    return rows


def tap(page, name, key):
    """Tap the first point of a figure; give the value of its column `key`."""
    see(page, name)
    page.wait_for_timeout(500)
    point = until(page, lambda: page.evaluate(POINT, [name, key]))
    page.mouse.click(point["x"], point["y"])
    return point["value"]


def heading(page, text):
    return page.locator(".solution").filter(has_text=text)


def row(page, number):
    return page.locator(".tabulator-row:visible").nth(number)


def test_the_run_is_shown_first_in_both_themes_and_leads_to_an_orbit(page):
    expect(heading(page, "Run: default")).to_be_visible()
    expect(page.locator(".tabulator-row:visible")).to_have_count(N_ORBITS)
    expect(row(page, 0)).to_contain_text("complete")
    require_accessible(page)
    rows = drawn(page, survey_figures())
    assert [name for name, n in rows.items() if n == 0 and name not in EMPTY] == []
    turn_dark(page, survey_figures())
    require_accessible(page)
    orbit = tap(page, "orbit-health", "orbit_id")
    expect(heading(page, f"Solution of orbit {orbit}")).to_be_visible()


def test_the_table_of_orbits_fits_a_small_screen_and_is_readable_below_the_mouse(served, open_page):
    page = open_page(served, width=1366, height=768)
    rows = page.locator(".tabulator-tableholder")
    row = rows.locator(".tabulator-row").first
    row.scroll_into_view_if_needed()
    row.hover()
    # It is no wider than the page, and a little narrower where that has a bar to scroll with.
    width, inner = until(page, lambda: rows.evaluate("e => [e.clientWidth, e.scrollWidth]"))
    assert inner <= width <= 1366 - 264 - 15
    # What is in a column begins below its heading.
    column = page.locator(".tabulator-col:visible", has_text="status")
    begins = [
        one.evaluate(
            "e => e.getBoundingClientRect().x + parseFloat(getComputedStyle(e).paddingLeft)"
        )
        for one in (
            column.locator(".tabulator-col-content"),
            row.locator('.tabulator-cell[tabulator-field="status"]'),
        )
    ]
    assert begins[0] == pytest.approx(begins[1], abs=1.0)
    # Its mark of the order stands beside the heading, and none where there is no column.
    title, mark = (
        column.locator(part).evaluate("""e => { const r = document.createRange();
          r.selectNodeContents(e); const box = (e.textContent ? r : e).getBoundingClientRect();
          return [box.left, box.right]; }""")
        for part in (".tabulator-col-title", ".tabulator-arrow")
    )
    assert mark[0] - title[1] > 2.0
    expect(page.locator(".tabulator-col.empty .tabulator-arrow:visible")).to_have_count(0)
    # A grey through which the colours of the numbers are seen.
    behind = row.evaluate("e => getComputedStyle(e).backgroundColor")
    assert float(re.search(r"/ ([\d.]+)\)", behind)[1]) < 0.2


def test_from_the_survey_to_an_orbit_to_a_source_and_back(page):
    row(page, 2).click()
    expect(heading(page, "Solution of orbit 2")).to_be_visible()
    expect(page.get_by_role("combobox", name="Orbit", exact=True)).to_have_text("2")
    rows = drawn(page, diagnostics())
    assert rows["footprint"] > 0
    source = tap(page, "deviation", "id")
    expect(page.get_by_text("1 source selected")).to_be_visible()
    page.get_by_role("button", name="Open", exact=True).click()
    expect(heading(page, f"source: {source}")).to_be_visible()
    expect(page.get_by_label("Source id")).to_have_value(source)
    assert 0 not in drawn(page, source_figures()).values()
    require_accessible(page)
    turn_to_workspace(page, SourceWorkspace.ORBITS)
    require_accessible(page)
    row(page, 0).click()
    expect(heading(page, "Solution of orbit")).to_be_visible()
    turn_to(page, "Survey")
    expect(heading(page, "Run: default")).to_be_visible()
    expect(page.get_by_role("combobox", name="Run")).to_be_visible()
    open_the_worst_orbit(page)
    turn_to(page, "Survey")
    explore_all_orbits(page)


def explore_all_orbits(page):
    """Draw the residuals of all orbits, choose another column, and select in an area."""
    turn_to_workspace(page, SurveyWorkspace.EXPLORE)
    until(page, lambda: explored(page) == "residual_x against focal_x")
    page.get_by_role("combobox", name="x", exact=True).click()
    page.locator(".MuiMenuItem-root").get_by_text("orbit_id", exact=True).click()
    until(page, lambda: explored(page) == "residual_x against orbit_id")
    expect(page.locator(".MuiMenuItem-root")).to_have_count(0)
    drag(page, "explore", (0.3, 0.3), (0.6, 0.7))
    expect(page.get_by_text(re.compile(r"^\d[\d,]+ sources selected$"))).to_be_visible()
    page.wait_for_url("**x=orbit_id**")


def open_the_worst_orbit(page):
    """Sort the orbits and open the first."""

    def column(name):
        return page.locator(f".tabulator-cell[tabulator-field={name}]:visible").all_inner_texts()

    expect(page.locator(".tabulator-row:visible")).to_have_count(N_ORBITS)
    worst_first = sorted(column("chi2_per_dof"), reverse=True)
    header = page.locator(".tabulator-col[tabulator-field=chi2_per_dof]:visible").first
    header.click()
    until(page, lambda: column("chi2_per_dof") == worst_first[::-1])
    header.click()
    until(page, lambda: column("chi2_per_dof") == worst_first)
    orbit = column("orbit_id")[0]
    row(page, 0).click()
    expect(heading(page, f"Solution of orbit {orbit}")).to_be_visible()


def test_two_runs_are_compared_exchanged_and_carried_by_the_address(page, open_page):
    turn_to_workspace(page, SurveyWorkspace.COMPARE)
    changes = page.locator(".figure-run-changes")
    order = changes.locator("tr", has_text="Distortion order")
    expect(order).to_have_text("Distortion orderorder 3order 5–")
    page.get_by_role("combobox", name="Figure of both").click()
    page.locator(".MuiMenuItem-root").get_by_text("Orbits of each source", exact=True).click()
    expect(page.locator(".MuiMenuItem-root")).to_have_count(0)
    for name in ("both-runs", "motion-differences"):
        page.locator(f".figure-{name}:visible canvas").first.wait_for(state="attached")
    require_accessible(page)
    page.locator(".solution").first.click()
    steps = page.evaluate("history.length")
    page.keyboard.press("b")
    expect(heading(page, "Run: low")).to_be_visible()
    expect(order).to_have_text("Distortion orderorder 5order 3–")
    page.wait_for_url("**run=low&other=default&figure=orbit-counts")
    assert page.evaluate("history.length") == steps
    again = open_page(page.url)
    expect(heading(again, "Run: low")).to_be_visible()
    expect(again.locator(".figure-run-changes tr", has_text="Distortion order")).to_have_text(
        "Distortion orderorder 5order 3–"
    )


def test_back_and_forward_lead_through_the_solutions_of_an_orbit(served, open_page):
    page = open_page(f"{served}?view=orbit&workspace=verdict&orbit=0")
    order = page.get_by_role("slider", name="Distortion order")
    order.focus()
    head = page.locator(".head:visible")
    expect(head).to_contain_text("order 5")
    page.keyboard.press("ArrowLeft")
    page.wait_for_url(re.compile("solution=order=4"))
    page.go_back()
    expect(head).to_contain_text("Solution of orbit 0: order 5")
    assert "order=4" not in page.url
    page.go_forward()
    expect(head).to_contain_text("what if: order 4")


def test_titles_of_selected_sources_are_not_cut(served, open_page, simulated):
    rows = read_survey_orbit(simulated, 0).measurements
    page = open_page(f"{served}?view=orbit&orbit=0&sources={rows['source_id'].iloc[0]}")
    expect(heading(page, "Solution of orbit 0")).to_be_visible()
    page.get_by_role("button", name="List", exact=True).click()
    title = ".tabulator-col-group > .tabulator-col-content .tabulator-col-title"
    titles = page.get_by_role("dialog").locator(title)
    expect(titles).to_have_text(["minus prior, mas", "marginal σ, mas"])
    cut = "all => all.filter(one => one.scrollWidth > one.clientWidth).map(one => one.textContent)"
    assert titles.evaluate_all(cut) == []


def test_a_source_is_looked_for_and_carried_by_the_address(page, open_page, tmp_path):
    turn_to(page, "Source")
    expect(page.locator("p.empty:visible")).to_contain_text("Write a source's id")
    labels = page.locator("label.MuiInputLabel-root:visible")
    expect(labels.nth(1)).to_be_visible()
    assert len(set(labels.evaluate_all("all => all.map(e => getComputedStyle(e).fontSize)"))) == 1
    # The entry is as high as the choices beside it, and its label in the middle of it.
    frames = page.locator(".MuiOutlinedInput-root:visible")
    assert len({round(one.bounding_box()["height"]) for one in frames.all()}) == 1
    entry = page.get_by_label("Source id")
    middle = lambda box: box["y"] + box["height"] / 2  # noqa: E731
    label = labels.filter(has_text="Source id").bounding_box()
    assert abs(middle(label) - middle(entry.bounding_box())) < 1.5
    entry.fill("17")
    entry.press("Enter")
    expect(page.locator("p.empty:visible")).to_have_text("Run 'default' has no source 17.")
    source = row(page, 0).locator(".tabulator-cell[tabulator-field=id]").inner_text()
    row(page, 0).click()
    page.wait_for_url(f"**source={source}**")
    again = open_page(page.url)
    expect(heading(again, f"source: {source}")).to_be_visible()
    assert 0 not in drawn(again, source_figures()).values()
    with again.expect_download() as started:
        again.get_by_role("button", name="Report: the view on the screen").click()
    assert started.value.suggested_filename == f"source-{source}-report.html"
    started.value.save_as(tmp_path / "report.html")
    assert f"<title>Source {source} " in (tmp_path / "report.html").read_text("utf-8")


def test_a_survey_without_a_run_says_what_to_do(tmp_path, open_page, chromium_path):
    simulate_survey(tmp_path / "new", SurveySettings(orbits=1, seed=5).scaled(2_000))
    with serving("serve", str(tmp_path / "new"), "--port", "0") as address:
        page = open_page(f"{address}?view=survey")
        expect(page.locator("p.empty:visible")).to_contain_text("plateviz survey")
        turn_to(page, "Source")
        expect(page.locator("p.empty:visible")).to_contain_text("plateviz survey")
        expect(page.get_by_label("Source id")).to_be_disabled()
