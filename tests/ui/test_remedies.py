"""A flaw, its cause and what to do about it, in a real Chromium."""

import pytest
from playwright.sync_api import expect

from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey
from tests.ui.conftest import serving

expect.set_options(timeout=60_000)
pytestmark = [pytest.mark.ui, pytest.mark.slow]


@pytest.fixture
def served(tmp_path, chromium_path):
    """The address of a survey of one sparse orbit, whose distortion drifts by much."""
    settings = SurveySettings(orbits=1, defects=("distortion-drift=0.5um",)).scaled(6_000)
    simulate_survey(tmp_path / "sky", settings)
    with serving("serve", str(tmp_path / "sky"), "--port", "0") as address:
        yield address


def test_cause_is_named_and_its_remedy_is_a_click(served, open_page):
    page = open_page(served)
    expect(page.locator("details.verdict")).to_contain_text("the distortion drifts")
    row = page.locator("p.cause").first
    expect(row).to_contain_text("change steadily from the first exposure to the last")
    expect(row).to_contain_text("It spoils the positions")
    expect(row).not_to_contain_text("It is not noise")
    page.get_by_role("button", name="Try it: solve the orbit with --drift 2.").click()
    expect(page.locator(".outdated").first).to_contain_text("Another solution is being computed: ")
    solutions = page.locator(".solution")
    expect(solutions.nth(0)).to_contain_text("what if: order 5, drift 2")
    expect(solutions.nth(1)).to_contain_text("order 5")
    expect(page.locator("details.verdict")).not_to_contain_text("drifts")
    assert page.get_by_role("button", name="Try it: solve the orbit with --drift").count() == 0
