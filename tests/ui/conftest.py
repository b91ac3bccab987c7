"""A served dashboard and a real Chromium; skipped, with the reason, where there is none."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import expect, sync_playwright

from plateviz.plots.gallery import diagnostics, source_figures, survey_figures
from plateviz.plots.workspace import OrbitWorkspace, title_of

_WORKSPACES = {
    figure.name: figure.workspace
    for figure in (*diagnostics(), *survey_figures(), *source_figures())
}
_FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
]
# Chromium's software renderer remarks on its own speed; that is no fault of the page.
_HARMLESS = re.compile(r"GL Driver Message|GPU stall")

# The views of Bokeh that are on the page: a document keeps models that are no longer drawn.
VIEWS = """
  const views = [];
  const walk = view => { views.push(view); (view.child_views ?? []).forEach(walk); };
  for (const view of Bokeh.index) walk(view);
  const card = view => {
    for (let e = view.el; e; e = e.parentElement ?? e.getRootNode().host)
      for (const name of e.classList ?? []) if (name.startsWith('figure-')) return name.slice(7);
  };
  const figures = views.filter(view => view.model.type === 'Plot'
    && view.el.checkVisibility({ visibilityProperty: true }));
  const column = (source, name) => source.data[name] ?? source.data.get?.(name);
"""
# Colour behind each figure that is drawn, by its name.
BACKGROUNDS = f"""() => {{ {VIEWS}
  const colours = {{}};
  for (const figure of figures)
    (colours[card(figure)] ??= new Set()).add(figure.model.background_fill_color);
  for (const name in colours) colours[name] = [...colours[name]].join();
  return colours; }}"""

ARROWS = f"""() => {{ {VIEWS} return figures.filter(view => card(view) === 'residual-map')
  .flatMap(view => view.model.renderers.filter(r => r.glyph?.type === 'Segment'))
  .map(r => JSON.stringify(Object.values(r.data_source.data).map(c => Array.from(c))))
  .join() }}"""


@pytest.fixture(scope="session")
def chromium_path():
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        reason = "there is no Chromium on this machine (Debian: apt-get install chromium)"
        if os.environ.get("PLATEVIZ_REQUIRE_BROWSER"):
            pytest.fail(reason)
        pytest.skip(reason)
    return path


@pytest.fixture(scope="session")
def browser(chromium_path):
    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=chromium_path, args=_FLAGS)
        yield launched
        launched.close()


@contextmanager
def serving(*arguments, env=None, program=("-m", "plateviz.cli.main")):
    """Run a command of plateviz that serves; gives the address it announces.

    It says what it has to say into a file, since a pipe that nobody reads would fill up and hold
    it; what it says may be neither a traceback nor a warning of Bokeh.
    """
    with tempfile.NamedTemporaryFile("a") as said:
        process = subprocess.Popen(
            [sys.executable, *program, *arguments, "--no-open"],
            stdout=said,
            stderr=subprocess.STDOUT,
            env={**os.environ, **(env or {}), "PYTHONUNBUFFERED": "1"},
        )
        try:
            yield _announced(process, Path(said.name))
        finally:
            process.terminate()
            process.wait(30)
        text = Path(said.name).read_text(encoding="utf-8")
        assert "Traceback" not in text
        # Of a model that the browser sends back.
        assert "reference already known" not in text


def _announced(process, said):
    while process.poll() is None:
        if found := re.search(r"http://\S+(?=\s)", said.read_text(encoding="utf-8")):
            return found[0]
        time.sleep(0.1)
    pytest.fail(f"the server ended: {said.read_text(encoding='utf-8')}")


# Each workspace fits it without scrolling.
LARGE = {"width": 1920, "height": 1080}


def turn_to_workspace(page, workspace):
    """Show a workspace of the page on the screen."""
    switch = page.get_by_role("button", name=title_of(workspace), exact=True)
    if switch.get_attribute("aria-pressed") != "true":
        switch.click()


def require_room(page, workspace):
    """Fail if a card of a workspace is not within a large screen."""
    cards = page.locator(".card:visible")
    cards.locator("canvas").first.wait_for(state="attached")
    boxes = cards.evaluate_all("cards => cards.map(card => card.getBoundingClientRect())")
    assert len(boxes) > (workspace is not OrbitWorkspace.EXPLORE)
    assert all(box["x"] + box["width"] <= LARGE["width"] for box in boxes), workspace
    assert all(box["y"] + box["height"] <= LARGE["height"] for box in boxes), workspace


def see(page, name):
    """Go to a figure in its workspace, and wait until it is drawn."""
    turn_to_workspace(page, _WORKSPACES[name])
    card = page.locator(f".figure-{name}:visible")
    # For a moment, the workspace before is there as well, which may have the same figure.
    expect(card).to_have_count(1)
    card.scroll_into_view_if_needed()
    card.locator("canvas").first.wait_for(state="attached")


def until(page, condition):
    """Wait for what only the models of the page can tell, and give it.

    Figures are drawn in batches, and while Bokeh builds some it may not list its others: what was
    found once may be missing in the next moment.
    """
    for _ in range(300):
        if found := condition():
            return found
        page.wait_for_timeout(100)
    pytest.fail("it did not come about in 30 s")


def residual_arrows(page):
    """Wait until the residual map is drawn, and give its arrows as text."""
    return until(page, lambda: page.evaluate(ARROWS))


def is_faded(locator):
    """Whether what is on the screen there is of a solution that is no longer shown."""
    return locator.evaluate(
        """element => {
          for (let e = element; e; e = e.parentElement ?? e.getRootNode().host)
            if (getComputedStyle(e).opacity !== '1') return true;
          return false }"""
    )


def rests(page):
    """Whether the browser works less than one second in two, at the latest after half a minute."""
    metric = metrics_of(page)

    def works_little():
        before = metric("TaskDuration")
        page.wait_for_timeout(2000)
        return metric("TaskDuration") - before < 1.0

    return any(works_little() for _ in range(15))


def metrics_of(page):
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable")

    def metric(name):
        metrics = session.send("Performance.getMetrics")["metrics"]
        return next(m["value"] for m in metrics if m["name"] == name)

    return metric


def drag(page, name, start, end, rest=0):
    """Drag across a figure, from one place to another in shares of its width and height.

    The hand may rest before it drags, ms.
    """
    canvas = page.locator(f".figure-{name}:visible canvas").first
    canvas.scroll_into_view_if_needed()
    box = _resting_box(page, canvas)
    (x, y), last = (
        (box["x"] + across * box["width"], box["y"] + down * box["height"])
        for across, down in (start, end)
    )
    page.mouse.move(x, y)
    page.mouse.down()
    page.wait_for_timeout(rest)
    page.mouse.move(*last, steps=8)
    page.mouse.up()


def _resting_box(page, canvas):
    """Where a canvas is once the page has laid it out: the same twice."""
    before = None
    while (box := canvas.bounding_box()) != before:
        before = box
        page.wait_for_timeout(100)
    return box


def explored(page):
    """Title of the figure of the Explore workspace."""
    return page.evaluate(
        f"""() => {{ {VIEWS}
          return figures.find(view => card(view) === 'explore')?.model.title.text }}"""
    )


def turn_dark(page, figures):
    """Change the theme from light to dark and go to each figure until it is drawn in it."""
    until(page, lambda: set(page.evaluate(BACKGROUNDS).values()) == {"#ffffff"})
    page.get_by_label("Toggle theme").click()
    for figure in figures:
        see(page, figure.name)
        until(page, lambda name=figure.name: page.evaluate(BACKGROUNDS).get(name) == "#121212")


@pytest.fixture
def open_page(browser):
    """Open a page of a size and colour scheme; what it complains of fails the test."""
    with opening_pages(browser) as open_at:
        yield open_at


@contextmanager
def opening_pages(browser):
    """Give the function that opens a page; fail in the end if one has complained."""
    complaints, contexts = [], []

    def complain(message):
        if message.type in ("error", "warning") and not _HARMLESS.search(message.text):
            complaints.append(f"{message.type}: {message.text}")

    def open_at(address, width=1500, height=1000, colours="light"):
        viewport = {"width": width, "height": height}
        context = browser.new_context(viewport=viewport, color_scheme=colours)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(90_000)
        page.on("console", complain)
        page.on("pageerror", lambda error: complaints.append(f"page error: {error}"))
        page.on("requestfailed", lambda request: complaints.append(f"not loaded: {request.url}"))
        page.goto(address)
        return page

    yield open_at
    for context in contexts:
        context.close()
    assert complaints == []
