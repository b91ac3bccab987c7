"""Texts of files, folders and clients that pretend to be HTML: shown, and never run."""

import shutil
import subprocess
import sys
from urllib.parse import quote

import pytest

from plateviz.runs.fit_survey import fit_survey
from solver.data.settings import FitSettings
from solver.io.survey import measurement_path
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey
from tests.fitting import fitting_in_this_process
from tests.ui.conftest import see, serving

pytestmark = [pytest.mark.ui, pytest.mark.slow]

# A file name may hold anything but a slash.
HOSTILE = 'a"><img src=x onerror="window.ran = 1"><b class=hostile>'
# Whether a script of such a text ran, or an element of it is anywhere on the page.
FOUND = """() => {
  const walk = root => [...root.querySelectorAll('*')].some(
    e => e.matches('img[src=x], b.hostile, a[href*=evil]') || (e.shadowRoot && walk(e.shadowRoot)));
  return Boolean(window.ran) || walk(document); }"""


@pytest.fixture(scope="module")
def survey(tmp_path_factory, chromium_path):
    """A survey in a hostile folder, with two runs of which one orbit cannot be read."""
    directory = tmp_path_factory.mktemp("surveys") / HOSTILE
    simulate_survey(directory, SurveySettings(orbits=2, seed=5).scaled(3_000))
    measurement_path(directory, 1).write_bytes(b"PAR1")
    with fitting_in_this_process():
        assert list(fit_survey(directory, "default", FitSettings()).failed) == [1]
    # The command refuses such a name, and a folder may be copied to it.
    shutil.copytree(directory / "runs" / "default", directory / "runs" / HOSTILE)
    return directory


def assert_harmless(page):
    page.wait_for_timeout(500)
    assert not page.evaluate(FOUND)


def test_dashboard_shows_hostile_names_as_text(survey, open_page):
    with serving("serve", str(survey), "--port", "0") as address:
        page = open_page(f"{address}?view=survey")
        see(page, "orbit-health")
        assert HOSTILE in page.title()
        assert page.locator("meta[name=title]").get_attribute("content").endswith(HOSTILE)
        assert_harmless(page)
        page.get_by_role("button", name="Orbit", exact=True).click()
        see(page, "residual-map")
        assert_harmless(page)
        failed = open_page(f"{address}?orbit=1")
        failed.get_by_text("orbit=0001.parquet").first.wait_for()
        assert_harmless(failed)
        copied = open_page(f"{address}?view=survey&run={quote(HOSTILE)}")
        see(copied, "orbit-health")
        copied.get_by_text(HOSTILE).first.wait_for(state="attached")
        assert_harmless(copied)
        client = open_page(f"{address}?view=source&source={HOSTILE}&run={HOSTILE}&orbit={HOSTILE}")
        client.get_by_text("plateviz").first.wait_for()
        assert_harmless(client)
        link = open_page(f"{address}?view=survey&run=[log in](https://evil.example)&unit=__own__")
        link.get_by_text("found '[log in](https://evil.example)'").wait_for()
        link.get_by_text("found '__own__'").wait_for()
        assert_harmless(link)
        for one in (page, failed, copied, client, link):
            one.context.close()


def test_report_shows_hostile_names_as_text(survey, browser, tmp_path):
    command = [sys.executable, "-m", "plateviz.cli.main", "report", str(survey), "--orbit", "0"]
    subprocess.run([*command, "-o", str(tmp_path / "r.html")], check=True, capture_output=True)
    page = browser.new_page()
    page.goto((tmp_path / "r.html").as_uri())
    page.get_by_text(HOSTILE).first.wait_for(state="attached")
    assert_harmless(page)
    page.close()
