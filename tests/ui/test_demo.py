"""`plateviz demo` from an empty cache: first orbit, whole survey, and a second start."""

import re
import time

import pytest
from playwright.sync_api import expect

from plateviz.plots.workspace import SurveyWorkspace
from tests.ui.conftest import see, serving, turn_to_workspace

expect.set_options(timeout=60_000)
pytestmark = [pytest.mark.ui, pytest.mark.slow]

# The demo with fewer orbits and stars, whose number proves nothing here.
SMALL = """
import plateviz.cli.demo
from plateviz.cli.main import main
from solver.simulate.settings import SurveySettings

plateviz.cli.demo.DEMO = SurveySettings(orbits=6, seed=0).scaled(4_000)
main()
"""
# Several times what two idle cores take.
_PATIENCE_SECONDS = 400


@pytest.mark.full
def test_demo_shows_the_first_orbit_and_then_the_whole_survey(tmp_path, open_page):
    _see_demo(tmp_path, open_page, ("-c", SMALL), 6)


@pytest.mark.full
@pytest.mark.timeout(900)
def test_demo_of_full_size_is_shown_too(tmp_path, open_page):
    _see_demo(tmp_path, open_page, ("-m", "plateviz.cli.main"), 54)


def _see_demo(tmp_path, open_page, program, orbits):
    complete = re.compile(rf"{orbits} \(of {orbits}\)")
    env = {"XDG_CACHE_HOME": str(tmp_path)}
    with serving("demo", "--port", "0", env=env, program=program) as address:
        page = open_page(address)
        see(page, "residual-map")
        page.get_by_role("button", name="Survey", exact=True).click()
        # A few small orbits may all be fitted before a busy machine has drawn the page.
        growing = page.locator("p.caption").get_by_text("This page follows by itself")
        expect(growing.or_(page.get_by_text(complete)).first).to_be_visible()
        wait_for_file(tmp_path.glob, "plateviz/demo-*/demo/runs/default/COMPLETE")
        expect(page.get_by_text(complete).first).to_be_visible()
        expect(growing).to_have_count(0)
        see(page, "motion-pulls")
        turn_to_workspace(page, SurveyWorkspace.VERDICT)
        page.get_by_role("button", name="Most significant motion").first.click()
        see(page, "time-series")
        expect(page.locator(".strip").get_by_text("Rms from the truth")).to_be_visible()
        close(page)

    written = times_of(tmp_path)
    with serving("demo", "--port", "0", env=env, program=program) as address:
        page = open_page(address)
        expect(page.get_by_text(complete).first).to_be_visible()
        close(page)
    assert times_of(tmp_path) == written


def times_of(cache):
    """Return when each file of the demo was written."""
    folders = cache.glob("plateviz/demo-*")
    return {path: path.stat().st_mtime_ns for one in folders for path in one.rglob("*")}


def close(page):
    """Close a page before its server ends: what it could no longer load would be a complaint."""
    page.wait_for_load_state("networkidle")
    page.context.close()


def wait_for_file(glob, pattern):
    end = time.monotonic() + _PATIENCE_SECONDS
    while not list(glob(pattern)):
        assert time.monotonic() < end, f"expected {pattern}, found none"
        time.sleep(0.5)
