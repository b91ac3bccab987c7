"""What a page shows while its scripts are loaded, in a real Chromium."""

import pytest
from playwright.sync_api import expect

from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey
from tests.ui.conftest import serving

expect.set_options(timeout=60_000)
pytestmark = [pytest.mark.ui, pytest.mark.slow]


@pytest.fixture(scope="module")
def address(tmp_path_factory, chromium_path):
    """The address of a survey of one sparse orbit with a name that is not to be trusted."""
    directory = tmp_path_factory.mktemp("survey") / "<b>sky & stars"
    simulate_survey(directory, SurveySettings(orbits=1).scaled(2_000))
    with serving("serve", str(directory), "--port", "0") as address:
        yield address


@pytest.mark.parametrize(
    ("colours", "background"), [("light", "rgb(255, 255, 255)"), ("dark", "rgb(18, 18, 18)")]
)
def test_page_has_its_name_before_its_scripts_have_run(address, browser, colours, background):
    held = []
    with browser.new_context(color_scheme=colours) as context:
        page = context.new_page()
        page.route("**/panel.min.js*", lambda route: held.append(route))  # noqa: PLW0108 Playwright marks it
        page.goto(address, wait_until="commit")
        opening = page.locator("#opening")
        expect(opening).to_have_css("background-color", background)
        expect(opening.get_by_text("plateviz · <b>sky & stars", exact=True)).to_be_visible()
        expect(opening.get_by_text("Opening the survey", exact=True)).to_be_visible()
        until_held(page, held)
        held[0].continue_()
        expect(page.locator(".solution")).to_have_count(1)
        expect(opening).to_have_count(0)


def until_held(page, held):
    """Wait until the browser has asked for what is held."""
    while not held:
        page.wait_for_timeout(50)
