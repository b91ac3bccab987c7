"""The tour in JupyterLab, in Notebook 7 and under `panel serve`, in a real Chromium."""

import json
import os
import re
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.ui.conftest import see

REPOSITORY = Path(__file__).resolve().parents[2]
TOUR = REPOSITORY / "assets" / "tour.ipynb"
TOKEN = "of-this-test"
PATIENCE_MS = 240_000
# Every picture of the tour: figures of Bokeh have a canvas each, some pictures several figures.
LEAST_CANVASES = 9
OF_PANEL = "application/vnd.holoviews_exec.v0+json"
# Cells of the tour by what they display.
CARDS = {"survey", "orbit", "fit", "what-if", "survey-fit", "star-choice"}
TABLES = {"measurements", "tables", "detectors", "prior", "motion"}
FIGURES = {
    *("residuals", "uncertainty", "deviation", "comparison", "residuals-third", "prior-share"),
    *("health", "track", "series"),
}

pytestmark = [pytest.mark.ui, pytest.mark.slow, pytest.mark.timeout(600)]


@pytest.fixture(scope="module")
def folder(nbformat, tmp_path_factory):
    """A folder with the tour, of a survey that takes less time, and that the next test finds."""
    notebook = nbformat.read(TOUR, as_version=4)
    for cell in notebook.cells:
        cell.source = cell.source.replace("orbits=8, stars=12_000", "orbits=3, stars=6_000")
    made = tmp_path_factory.mktemp("notebooks") / "tour"
    made.mkdir()
    nbformat.write(notebook, made / "tour.ipynb")
    return made


@pytest.fixture
def open_jupyter(browser):
    """Open a page of a Jupyter; errors fail the test from when its complaints are cleared."""
    context, complaints = browser.new_context(viewport={"width": 1500, "height": 1000}), []

    def complain(message):
        if message.type == "error":
            complaints.append(message.text)

    def open_at(address):
        page = context.new_page()
        page.set_default_timeout(90_000)
        page.on("console", complain)
        page.on("pageerror", lambda error: complaints.append(f"page error: {error}"))
        page.on("requestfailed", lambda request: complaints.append(f"not loaded: {request.url}"))
        page.goto(address)
        return page, complaints

    yield open_at
    context.close()
    assert complaints == []


@contextmanager
def running(folder, *command):
    """Run a server in a folder; gives the first address that it announces."""
    places = ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR", "IPYTHONDIR")
    own = {name: str(folder.parent / name) for name in places}
    environment = {**os.environ, **own, "PYTHONPATH": str(REPOSITORY)}
    words = folder.parent / "words.txt"
    with words.open("w") as stream:
        process = subprocess.Popen(
            [sys.executable, "-m", *command],
            cwd=folder,
            stdout=stream,
            stderr=subprocess.STDOUT,
            env=environment,
        )
    try:
        yield _address(process, words)
    finally:
        process.terminate()
        process.wait(30)


def _address(process, words):
    for _ in range(600):
        if found := re.search(r"http://(?:127\.0\.0\.1|localhost):(\d+)/", words.read_text()):
            return f"http://127.0.0.1:{found[1]}"
        if process.poll() is not None:
            break
        time.sleep(0.1)
    pytest.fail(f"the server did not start: {words.read_text()}")


def jupyter(application, folder):
    options = ("--no-browser", "--allow-root", "--port=0", f"--IdentityProvider.token={TOKEN}")
    return running(folder, application, *options, "--ServerApp.ip=127.0.0.1")


def wait_for_kernel(page, address):
    """Wait until the notebook's kernel answers: who runs cells before is asked for a kernel."""
    for _ in range(600):
        kernels = page.request.get(f"{address}/api/kernels?token={TOKEN}").json()
        if any(kernel["execution_state"] == "idle" for kernel in kernels):
            # The page hears of it after the server.
            page.wait_for_timeout(2000)
            return
        page.wait_for_timeout(100)
    pytest.fail("the notebook's kernel did not start")


def save(page, file):
    """Save the notebook from the menu, and return it once it lies there with its last output."""
    page.get_by_role("menuitem", name="File", exact=True).click()
    page.locator('li[data-command="docmanager:save"]').click()
    for _ in range(300):
        text = file.read_text("utf-8")
        # Jupyter writes into the file itself, and every two minutes without being asked.
        if text.endswith("}\n") and json.loads(text)["cells"][-1]["outputs"]:
            return text
        page.wait_for_timeout(100)
    pytest.fail("the notebook was not saved")


def assert_cells_show_what_they_are_to_show(notebook):
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    kinds = {o.output_type for cell in cells for o in cell.outputs}
    assert kinds == {"execute_result", "display_data"}
    shown = {
        cell.id: output.data
        for cell in cells
        for output in cell.outputs
        if output.output_type == "execute_result"
    }
    assert shown.keys() == CARDS | TABLES | FIGURES | {"pulls", "report", "dashboard"}
    for name in FIGURES:
        assert OF_PANEL in shown[name], name
        assert "Plot" in shown[name]["text/html"], name
    for name in CARDS:
        assert "class='strip'" in shown[name]["text/html"], name
    for name in TABLES:
        assert "<table" in shown[name]["text/html"], name
    assert "can be trusted" in shown["survey-fit"]["text/html"]
    assert "<iframe src='http://127.0.0.1:" in shown["dashboard"]["text/html"]


# What a notebook shows is tested without Jupyter, and its cells run as a served page below.
@pytest.mark.full
@pytest.mark.parametrize(
    ("application", "path"),
    [
        pytest.param("jupyterlab", "lab/tree", id="lab"),
        pytest.param("notebook", "notebooks", id="classic"),
    ],
)
def test_tour_runs_and_every_figure_is_drawn(nbformat, folder, open_jupyter, application, path):
    with jupyter(application, folder) as address:
        page, complaints = open_jupyter(f"{address}/{path}/tour.ipynb?token={TOKEN}")
        page.locator(".jp-Notebook .jp-CodeCell").first.wait_for()
        wait_for_kernel(page, address)
        # Notebook 7 complains of itself while it starts, of an empty notebook too.
        complaints.clear()
        page.get_by_role("menuitem", name="Run", exact=True).click()
        page.locator('[data-command="runmenu:run-all"]').click()
        frame = page.locator("iframe[src^='http://127.0.0.1']")
        frame.wait_for(state="attached", timeout=PATIENCE_MS)
        dashboard = page.frame_locator("iframe[src^='http://127.0.0.1']")
        expect(dashboard.locator(".strip")).to_have_count(1, timeout=PATIENCE_MS)
        frame.scroll_into_view_if_needed()
        dashboard.locator(".figure").first.scroll_into_view_if_needed()
        dashboard.locator(".figure canvas").first.wait_for(state="attached")
        assert page.locator(".jp-OutputArea canvas").count() >= LEAST_CANVASES
        assert page.locator(".jp-OutputArea .strip").count() >= 6
        assert page.locator("[data-mime-type='application/vnd.jupyter.stderr']").count() == 0
        saved = save(page, folder / "tour.ipynb")
        assert_cells_show_what_they_are_to_show(nbformat.reads(saved, as_version=4))
        names = {path.name for path in folder.iterdir() if not path.name.startswith(".")}
        assert names == {"tour.ipynb", "plateviz-tour", "plateviz-tour-star.html"}
        # Before its server ends, of which it would complain.
        page.close()


def test_served_tour_is_the_dashboard_of_its_survey(folder, open_page):
    (folder / "plateviz-tour-star.html").unlink(missing_ok=True)
    with running(folder, "panel", "serve", "tour.ipynb", "--port", "0") as address:
        page = open_page(f"{address}/tour")
        expect(page.locator(".strip").first).to_contain_text("Orbits complete")
        see(page, "orbit-health")
        page.get_by_role("button", name="Orbit", exact=True).click()
        see(page, "residual-map")
        assert (folder / "plateviz-tour-star.html").is_file()
        page.close()
