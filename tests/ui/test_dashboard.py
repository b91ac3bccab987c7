"""The Orbit page in a real Chromium: its figures, what-ifs, fits, theme and address."""

import re
from functools import partial
from xml.etree import ElementTree as ET
from zipfile import ZipFile

import pytest
from playwright.sync_api import expect

from plateviz.plots.gallery import diagnostics
from plateviz.plots.workspace import OrbitWorkspace
from solver.io.formats import read_tables
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey
from tests.ui.accessibility import require_accessible
from tests.ui.conftest import (
    BACKGROUNDS,
    LARGE,
    VIEWS,
    drag,
    explored,
    is_faded,
    metrics_of,
    opening_pages,
    require_room,
    residual_arrows,
    rests,
    see,
    serving,
    turn_dark,
    turn_to_workspace,
    until,
)
from tests.ui.painted import LAYOUTS_OF_TEN, require_marks_where_they_are, require_only_changes

expect.set_options(timeout=60_000)
pytestmark = [pytest.mark.ui, pytest.mark.slow]

# Rows of the longest data source of each figure on the page, by the figure's title.
ROWS = """() => Object.fromEntries(
  Bokeh.documents.flatMap(d => [...d._all_models.values()])
    .filter(m => m.type === 'Plot')
    .map(f => [f.above.concat(f.title ? [f.title] : []).map(t => t.text ?? '').join(' | '),
               Math.max(0, ...f.renderers.map(r => r.data_source?.get_length() ?? 0))]))"""

SELECTED = f"""([name, by]) => {{ {VIEWS}
  const renderers = figures.find(figure => card(figure) === name)?.model.renderers ?? [];
  const source = renderers.map(r => r.data_source).find(s => column(s, by));
  return source ? [source.selected.indices.length, column(source, by).length] : [-1, -1]; }}"""


@pytest.fixture(scope="module")
def served(tmp_path_factory, chromium_path):
    """The address of a survey of one orbit with as many sources as every figure needs."""
    directory = tmp_path_factory.mktemp("survey") / "sky"
    simulate_survey(directory, SurveySettings(orbits=1, seed=0).scaled(18_000))
    with serving("serve", str(directory), "--port", "0") as address:
        yield address


def opened(served, open_at):
    """Open the dashboard and wait for a figure."""
    page = open_at(served)
    page.locator(".figure-residual-map:visible canvas").first.wait_for(state="attached")
    return page


@pytest.fixture
def page(served, open_page):
    return opened(served, open_page)


def button(page, name):
    """The button on the screen: figures of the Verdict workspace are in another one as well."""
    return page.get_by_role("button", name=name).filter(visible=True)


def value(page, name):
    cell = page.locator(".cell").filter(has_text=name).first
    return cell.locator(".value").inner_text()


def set_order(page, order):
    slider = page.get_by_role("slider", name="Distortion order")
    current = int(slider.get_attribute("aria-valuenow"))
    for _ in range(abs(order - current)):
        slider.press("ArrowRight" if order > current else "ArrowLeft")
    expect(slider).to_have_attribute("aria-valuenow", str(order))


def chi2(page):
    return value(page, "χ² per degree of freedom")


def shown(page):
    return page.locator(".solution").first


@pytest.fixture(scope="module")
def walked(served, browser):
    """A page on which every figure has been drawn; tests leave it as it was, the last one dark."""
    with opening_pages(browser) as open_at:
        page = opened(served, open_at)
        assert page.locator(".figure-convergence").count() == 0
        usual = page.viewport_size
        page.set_viewport_size(LARGE)
        # The first is on the screen already, and the address has it only when it is shown again.
        for workspace in reversed(OrbitWorkspace):
            turn_to_workspace(page, workspace)
            page.wait_for_url(f"**workspace={workspace.value}**")
            require_room(page, workspace)
            for diagnostic in diagnostics():
                if diagnostic.workspace is workspace:
                    see(page, diagnostic.name)
        page.set_viewport_size(usual)
        turn_to_workspace(page, OrbitWorkspace.VERDICT)
        yield page


@pytest.mark.newest
def test_every_figure_is_drawn_when_near_and_within_the_screen(walked):
    assert value(walked, "Converged") == "yes"
    expect(walked.locator("details.verdict summary").first).to_contain_text("This solution")
    assert 0.9 < float(chi2(walked).split()[0]) < 1.1
    rows = walked.evaluate(ROWS)
    assert len(rows) >= len(diagnostics())
    empty = [title for title, n in rows.items() if n == 0 and "Comparison" not in title]
    assert [t for t in empty if "Difference of" not in t] == []
    see(walked, "convergence")
    # What changed while it was out of sight is faded until it is drawn anew.
    until(walked, lambda: not is_faded(walked.locator(".figure-convergence canvas").first))
    # A part that asks without end whether it can be laid out would take a core.
    assert rests(walked)
    require_marks_where_they_are(walked)
    require_only_changes(walked)


def test_the_page_waits_for_no_typeface(walked):
    names = "[...document.fonts].filter(one => one.status !== 'unloaded').map(one => one.family)"
    assert walked.evaluate(names) == []


def test_what_is_drawn_keeps_its_layout(walked):
    """When other workspaces are shown: every figure has some forty."""
    assert rests(walked)
    metric = metrics_of(walked)
    before = metric("LayoutCount")
    for name in ("footprint", "weak-directions", "deviation"):
        see(walked, name)
    assert rests(walked)
    # Some two hundred: a few for each card, and those of the page while it is turned.
    assert metric("LayoutCount") - before < 300
    # What asks for a layout meanwhile is laid out with the page, once for a picture.
    assert walked.evaluate(LAYOUTS_OF_TEN) == [0, 0, 1]


def test_a_figure_is_explained_and_opens_as_large_as_the_window(walked):
    turn_to_workspace(walked, OrbitWorkspace.VERDICT)
    card = walked.locator(".figure-residual-map:visible")
    until(walked, lambda: card.locator("canvas").count() > 0)
    before = card.bounding_box()
    button(walked, "What this shows: Residual map").click()
    words = walked.get_by_text("Measured minus predicted position on the detector")
    words = words.filter(visible=True)
    expect(words).to_have_count(1)
    shown = walked.get_by_role("region", name="Explanation: Residual map").filter(visible=True)
    expect(shown).to_contain_text("r = n(measured) − n(predicted)")
    expect(shown).to_contain_text("assets/docs/diagnostics.md, “Residual map”")
    expect(shown).to_contain_text("Now: Residuals on detector 0")
    shown.get_by_role("button", name="Show the numbers as a table").click()
    expect(shown.locator("tbody tr").first).to_be_visible()
    figure = walked.get_by_role("figure", name="Residual map. Residuals on detector 0")
    expect(figure.filter(visible=True)).to_have_count(1)
    walked.keyboard.press("Escape")
    expect(words).to_have_count(0)
    button(walked, "Open large: Residual map").click()
    canvas = card.locator("canvas").first
    until(walked, lambda: canvas.bounding_box()["height"] > 800)
    assert card.bounding_box()["width"] > 1400
    walked.keyboard.press("Escape")
    until(walked, lambda: canvas.bounding_box()["height"] < before["height"])
    assert card.bounding_box() == before


def require_accessible_workspaces(page):
    for workspace in OrbitWorkspace:
        turn_to_workspace(page, workspace)
        require_accessible(page)


def test_every_workspace_is_accessible(walked):
    require_accessible_workspaces(walked)


def test_code_of_the_solution_on_the_screen_is_shown(walked):
    turn_to_workspace(walked, OrbitWorkspace.VERDICT)
    walked.get_by_role("button", name="Reproduce").click()
    window = walked.get_by_role("dialog", name="Reproduce")
    expect(window.get_by_text("--run reproduced --orbits 0")).to_be_visible()
    expect(window.get_by_text(".orbit(0).fit()")).to_be_visible()
    # Keys are the window's while it is open.
    walked.keyboard.press("4")
    walked.keyboard.press("Escape")
    expect(window).to_be_hidden()
    walked.keyboard.press(".")
    walked.wait_for_url("**workspace=verdict**plates=1-1**")
    walked.keyboard.press(",")
    walked.wait_for_url("**workspace=verdict**plates=0-0**")


def download(page, menu, label, folder):
    """Choose what to save in a menu and return the path of the file."""
    button(page, f"Save: {menu}").click()
    with page.expect_download() as started:
        page.get_by_role("menuitem", name=label, exact=True).filter(visible=True).click()
    path = folder / started.value.suggested_filename
    started.value.save_as(path)
    return path


def test_a_figure_is_saved_as_pictures_and_data(walked, tmp_path):
    turn_to_workspace(walked, OrbitWorkspace.RESIDUALS)
    saved = partial(download, walked, "Largest residuals", folder=tmp_path)
    assert saved("PNG").name == "orbit-0-largest-residuals.png"
    # The legend below the frame is as far from it in both, once the card has its size.
    height = lambda: ET.parse(saved("SVG")).getroot().attrib["height"]  # noqa: E731
    until(walked, lambda: int(height()) == int.from_bytes(saved("PNG").read_bytes()[20:24]))
    tables = read_tables(download(walked, "Residual map", "Data as FITS", tmp_path))
    assert len(tables["TAILS"]) == len(set(tables["TAILS"]["id"])) > 10
    # The picture was drawn in a document of its own, which goes after the file was made.
    until(walked, lambda: walked.evaluate("Bokeh.documents.length") == 1)


def test_figures_have_both_themes(walked):
    turn_dark(walked, diagnostics())
    require_accessible_workspaces(walked)


def selected(page, name, column="id"):
    """Numbers of selected and of all rows of a figure whose rows are selected by a column.

    Both are -1 while the figure is not on the screen, as after a workspace was chosen.
    """
    return page.evaluate(SELECTED, [name, column])


def test_sources_are_selected_in_one_figure_shown_in_all_saved_and_left_out(page, tmp_path):
    page.locator(".figure-footprint:visible canvas").first.wait_for(state="attached")
    bar = page.get_by_text(re.compile(r"^[\d,]+ sources? selected$"))
    # A drag that begins beside the frame selects nothing, and is no error.
    drag(page, "residual-map", (0.05, 0.05), (0.6, 0.7))
    expect(bar).to_have_count(0)
    drag(page, "residual-map", (0.45, 0.5), (0.7, 0.75))
    expect(bar).to_be_visible()
    [[n_selected, n_sources]] = until(
        page, lambda: [rows for rows in [selected(page, "footprint")] if rows[0] > 0]
    )
    assert 0 < n_selected < n_sources
    page.get_by_role("button", name="List", exact=True).click()
    window = page.get_by_role("dialog")
    expect(window.locator(".tabulator-row").first).to_contain_text(re.compile("reference|artif"))
    page.keyboard.press("Escape")
    expect(window).to_be_hidden()
    with ZipFile(download(page, "selection", "CSV", tmp_path)) as archive:
        archive.extractall(tmp_path)
    (sources,) = read_tables(tmp_path / "sources.csv").values()
    assert len(sources) == n_selected
    (measurements,) = read_tables(tmp_path / "measurements.csv").values()
    assert set(measurements["source_id"]) == set(sources["source_id"])
    page.get_by_role("button", name="Send: selected sources to TOPCAT or DS9").click()
    # Whoever runs the tests may have a hub.
    expect(page.get_by_text(re.compile("no SAMP hub runs on this|sent to "))).to_be_visible()
    page.get_by_role("button", name="Leave out of the fit").click()
    expect(shown(page)).to_contain_text("without ")
    until(page, lambda: selected(page, "footprint")[1] == n_sources - n_selected)
    page.get_by_role("button", name="Put back into the fit").click()
    expect(shown(page)).not_to_contain_text("without ")
    until(page, lambda: selected(page, "footprint") == [n_selected, n_sources])
    select_exposures_too(page)
    button(page, "Clear").click()
    until(page, lambda: selected(page, "footprint") == [0, n_sources])
    button(page, "Kept selections").click()
    page.get_by_role("dialog").get_by_role("button", name="Select again").click()
    page.keyboard.press("Escape")
    until(page, lambda: selected(page, "footprint") == [n_selected, n_sources])


def select_exposures_too(page):
    """Select exposures in a figure and a table besides sources, and keep both under a name."""
    turn_to_workspace(page, OrbitWorkspace.CALIBRATION)
    box = page.locator(".tabulator-row:visible input[type=checkbox]")
    box.nth(1).click()
    expect(page.get_by_text(re.compile(r"sources?, exposure 0/1 selected$"))).to_be_visible()
    expect(box.nth(1)).to_be_checked()
    page.wait_for_url("**exposures=0/1**")
    see(page, "exposure-tracks")
    drag(page, "exposure-tracks", (0.45, 0.6), (0.95, 0.85))
    expect(page.get_by_text(re.compile(r"sources?, .*exposures .*selected$"))).to_be_visible()
    until(page, lambda: selected(page, "exposure-tracks", "exposure")[0] > 0)
    button(page, "Keep").click()
    window = page.get_by_role("dialog")
    window.get_by_role("textbox", name="Name").fill("<b>odd</b> corner")
    window.get_by_role("button", name="Keep", exact=True).click()
    expect(window.get_by_text("<b>odd</b> corner (")).to_be_visible()
    page.keyboard.press("Escape")
    turn_to_workspace(page, OrbitWorkspace.VERDICT)


def keep_reload_and_show(page):
    """Keep the what-if of order 4 on disk, load the page again, note upon it and show it."""
    kept = "orbit 0: lower: order 4 (what-if, kept)"
    page.get_by_role("button", name="All solutions").click()
    window = page.get_by_role("dialog", name="Solutions")
    window.get_by_role("radio", name="orbit 0: order 4 (what-if)").check()
    window.get_by_role("textbox", name="Name").fill("lower")
    window.get_by_role("textbox", name="Name").blur()
    window.get_by_role("button", name="Keep on disk").click()
    expect(window.get_by_role("radio", name=kept)).to_be_visible()
    page.reload()
    page.get_by_role("button", name="All solutions").click()
    expect(window.get_by_role("radio", name="orbit 0: order 3 (fit)")).to_be_visible()
    window.get_by_role("radio", name=kept).check()
    window.get_by_role("textbox", name="Note").fill("<i>as text</i>")
    window.get_by_role("textbox", name="Note").blur()
    window.get_by_role("button", name="Save the note").click()
    expect(window.get_by_text("The note is saved.")).to_be_visible()
    window.get_by_role("button", name="Show", exact=True).click()
    page.keyboard.press("Escape")
    expect(shown(page)).to_contain_text("lower: order 4")


def test_a_change_is_tried_at_once_listed_and_fitted(page):
    see(page, "convergence")
    canvas = page.locator(".figure-convergence canvas").first
    assert not is_faded(canvas)
    turn_to_workspace(page, OrbitWorkspace.VERDICT)
    # The server draws it anew at once until the browser has told that it is out of sight.
    expect(canvas).to_be_hidden()
    page.wait_for_timeout(500)
    fitted = chi2(page)
    set_order(page, 4)
    expect(shown(page)).to_contain_text("what if: order 4")
    until(page, lambda: chi2(page) != fitted)
    until(page, lambda: is_faded(canvas))
    see(page, "convergence")
    until(page, lambda: not is_faded(canvas))
    page.get_by_role("button", name="Add to the list").click()
    expect(shown(page)).not_to_contain_text("what if")
    expect(shown(page)).to_contain_text("order 4")
    expect(page.get_by_role("radio")).to_have_count(2)
    turn_to_workspace(page, OrbitWorkspace.VERDICT)
    until(page, lambda: len(residual_arrows(page)) > 100)
    kept, arrows = chi2(page), residual_arrows(page)
    set_order(page, 3)
    page.get_by_role("button", name="Fit", exact=True).click()
    expect(page.get_by_role("radio")).to_have_count(3)
    expect(page.locator(".solution:visible")).to_have_count(2)
    expect(shown(page)).to_contain_text("order 3")
    until(page, lambda: chi2(page) != kept)
    until(page, lambda: residual_arrows(page) != arrows)
    see(page, "comparison")
    keep_reload_and_show(page)


def test_what_is_left_out_is_left_out_and_a_wrong_prior_is_refused(page):
    before = int(value(page, "Measurements").replace(",", ""))
    entry = page.get_by_role("textbox", name="Leave out")
    entry.fill("detector=1")
    entry.press("Enter")
    expect(shown(page)).to_contain_text("without detector 1")
    assert int(value(page, "Measurements").replace(",", "")) < before
    page.get_by_role("button", name="show more: Priors").click()
    entry = page.get_by_role("textbox", name="distortion A")
    entry.fill("1 deg")
    entry.press("Enter")
    page.get_by_role("button", name="Fit", exact=True).click()
    words = "prior of distortion_x: expected a unit such as um"
    expect(page.get_by_role("alert").get_by_text(words)).to_be_visible()
    expect(page.locator(".outdated").get_by_text(words).first).to_be_visible()


def test_a_refit_can_be_cancelled_and_the_old_solution_stays(page):
    page.get_by_label("What-if at every change").click()
    before = chi2(page)
    set_order(page, 8)
    page.get_by_role("button", name="Fit", exact=True).click()
    page.get_by_role("button", name="Cancel").click()
    words = "The fit was cancelled; the last solution stays."
    expect(page.get_by_text(words, exact=True)).to_be_visible()
    assert chi2(page) == before
    expect(page.locator(".solution")).to_have_count(1)


def choose(page, label, option):
    page.get_by_role("combobox", name=label, exact=True).click()
    page.locator(".MuiMenuItem-root").get_by_text(option, exact=True).click()
    # While it closes, it covers the page.
    expect(page.locator(".MuiMenuItem-root")).to_have_count(0)


def test_any_column_is_drawn_against_any_other_and_selects(page, open_page):
    bar = page.get_by_text(re.compile(r"^[\d,]+ sources? selected$"))
    turn_to_workspace(page, OrbitWorkspace.EXPLORE)
    until(page, lambda: explored(page) == "residual_x against focal_x")
    # More measurements than are drawn one by one: an area of the cells is selected.
    drag(page, "explore", (0.3, 0.3), (0.4, 0.6), rest=500)
    expect(bar).to_be_visible()
    among_cells = bar.inner_text()
    choose(page, "Rows", "sources")
    choose(page, "y", "dec")
    choose(page, "x", "ra")
    choose(page, "Limit by", "is_reference")
    until(page, lambda: explored(page) == "dec against ra")
    drag(page, "explore", (0.2, 0.3), (0.8, 0.6))
    until(page, lambda: bar.inner_text() != among_cells)
    found, sources = selected(page, "explore")
    assert 0 < found < sources
    page.wait_for_url("**only=is_reference**")
    again = open_page(page.url)
    until(again, lambda: explored(again) == "dec against ra")
    expect(again.get_by_role("combobox", name="Limit by")).to_have_text("is_reference")


def test_the_address_is_what_is_shown_and_the_browser_goes_back(page, open_page, tmp_path):
    choose(page, "Detector", "3")
    choose(page, "Field", "all")
    page.wait_for_url("**field=all**detector=3**")
    steps = page.evaluate("history.length")
    set_order(page, 4)
    expect(shown(page)).to_contain_text("what if: order 4")
    page.wait_for_url("**solution=order=4+what-if&against=order=5")
    # What a hand changes little by little is one step.
    assert page.evaluate("history.length") == steps + 1
    again = open_page(page.url)
    expect(again.get_by_role("combobox", name="Detector")).to_have_text("3")
    expect(again.get_by_role("combobox", name="Field")).to_have_text("all")
    expect(shown(again)).to_contain_text("what if: order 4")
    again.close()
    turn_to_workspace(page, OrbitWorkspace.SKY)
    page.wait_for_url("**workspace=sky**")
    assert page.evaluate("history.length") == steps + 2
    page.go_back()
    expect(page.get_by_role("button", name="Verdict", exact=True)).to_have_attribute(
        "aria-pressed", "true"
    )
    assert "solution=order=4+what-if" in page.url
    page.go_forward()
    sky = page.get_by_role("button", name="Sky", exact=True)
    expect(sky).to_have_attribute("aria-pressed", "true")
    with page.expect_download() as started:
        page.get_by_role("button", name="Save view").click()
    assert started.value.suggested_filename == "sky-view.json"
    started.value.save_as(tmp_path / "view.json")
    turn_to_workspace(page, OrbitWorkspace.VERDICT)
    page.wait_for_url("**workspace=verdict**")
    page.get_by_label("File of a saved view").set_input_files(tmp_path / "view.json")
    expect(sky).to_have_attribute("aria-pressed", "true")


def test_keys_do_what_their_list_says(page):
    page.keyboard.press("?")
    keys = page.get_by_role("dialog", name="Keys")
    expect(keys.get_by_text("Next exposure")).to_be_visible()
    page.keyboard.press(".")
    page.keyboard.press("Escape")
    expect(keys).to_be_hidden()
    before = residual_arrows(page)
    page.keyboard.press(".")
    # Once: while the list is open, keys mean nothing else.
    page.wait_for_url("**plates=1-1**")
    until(page, lambda: residual_arrows(page) != before)
    page.get_by_role("slider", name="Distortion order").press("5")
    page.wait_for_url("**workspace=sky**")
    assert "plates=1-1" in page.url
    # What is typed into a control is for the control.
    box = page.get_by_role("textbox", name="Leave out")
    box.press_sequentially("d,.5")
    expect(box).to_have_value("d,.5")
    assert "workspace=sky" in page.url
    assert "plates=1-1" in page.url
    assert "detector=0" in page.url


def test_an_address_of_nonsense_opens_the_page_in_the_theme_of_the_system(served, open_page):
    page = open_page(f"{served}?field=%FF&plates=1e9-x&detector=none&orbit=%00", colours="dark")
    page.locator(".figure-footprint canvas").first.wait_for(state="attached")
    # Another page has told its room, so that its card begins with it.
    again = open_page(f"{served}?orbit=0")
    card = again.locator(".figure-footprint:visible")
    until(again, lambda: card.bounding_box()["width"] > 200)
    again.close()
    expect(page.get_by_role("combobox", name="Field")).to_have_text("all")
    notice = page.get_by_role("alert").filter(has_text="Not all that was asked for can be shown")
    expect(notice).to_contain_text("plates: expected FIRST-LAST, found '1e9-x'")
    notice.get_by_role("button", name="Close").click()
    expect(notice).to_have_count(0)
    until(page, lambda: set(page.evaluate(BACKGROUNDS).values()) == {"#121212"})
    background = "getComputedStyle(document.body).backgroundColor"
    until(page, lambda: page.evaluate(background) == "rgb(18, 18, 18)")
