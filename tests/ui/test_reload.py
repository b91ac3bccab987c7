"""A fit that runs while its page is loaded again, in a real Chromium."""

import pytest
from playwright.sync_api import expect

from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey
from tests.ui.conftest import serving

expect.set_options(timeout=60_000)
pytestmark = [pytest.mark.ui, pytest.mark.slow]


@pytest.fixture
def served(tmp_path, chromium_path):
    """The address of a survey of one sparse orbit."""
    simulate_survey(tmp_path / "sky", SurveySettings(orbits=1).scaled(6_000))
    with serving("serve", str(tmp_path / "sky"), "--port", "0") as address:
        yield address


def test_fit_is_followed_after_a_reload_and_can_be_cancelled(served, open_page):
    page = open_page(served)
    expect(page.locator(".solution")).to_have_count(1)
    page.get_by_role("combobox", name="Engine").click()
    page.locator(".MuiMenuItem-root").get_by_text("nuts", exact=True).click()
    page.get_by_role("button", name="Fit", exact=True).click()
    outdated = page.locator(".outdated").first
    expect(outdated).to_contain_text("Another solution is being computed: ")
    page.reload()
    expect(outdated).to_contain_text("Another solution is being computed: ")
    # Earlier, the server would hold the fit for the page that was left.
    page.get_by_role("button", name="Cancel").click()
    words = "The fit was cancelled; the last solution stays."
    expect(page.get_by_text(words, exact=True)).to_be_visible()
    expect(page.locator(".solution")).to_have_count(1)
