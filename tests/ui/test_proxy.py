"""The dashboard behind a reverse proxy, under a path and another host than its own."""

import re

import pytest
from playwright.sync_api import expect

from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey
from tests.ui.conftest import see, serving
from tests.ui.reverse_proxy import proxying

pytestmark = [pytest.mark.ui, pytest.mark.slow]

PREFIX = "groups/plateviz"


@pytest.fixture(scope="module")
def survey(tmp_path_factory, chromium_path):
    directory = tmp_path_factory.mktemp("survey") / "sky"
    simulate_survey(directory, SurveySettings(orbits=1, seed=5).scaled(2_000))
    return directory


@pytest.fixture(scope="module")
def proxy():
    with proxying() as running:
        yield running


def serve_behind(proxy, survey, *options):
    prefix = ("--prefix", f"/{PREFIX}/")
    return serving("serve", str(survey), "--port", "0", *prefix, *options)


def test_page_lives_behind_a_proxy(proxy, survey, open_page):
    with serve_behind(proxy, survey, "--allow-origin", f"127.0.0.1:{proxy.port}") as address:
        proxy.upstream, path = re.fullmatch(r"(http://[^/]+)/(.+)/", address).groups()
        assert path == PREFIX
        asked = []
        page = open_page("about:blank")
        page.on("request", lambda request: asked.append(request.url))
        page.goto(f"http://127.0.0.1:{proxy.port}/{PREFIX}/?view=survey")
        # What is asked for over the websocket is answered.
        expect(page.locator("p.empty:visible")).to_contain_text("plateviz survey", timeout=90_000)
        page.get_by_role("button", name="Orbit", exact=True).click()
        see(page, "footprint")
        # Before the server is gone, of which it would still ask for fonts.
        page.close()
        beyond = [url for url in asked if f":{proxy.port}/{PREFIX}/" not in url]
        assert not [url for url in beyond if not url.startswith(("blob:", "data:", "about:"))]


def test_page_of_another_host_is_refused(proxy, survey, browser):
    with serve_behind(proxy, survey) as address:
        proxy.upstream = re.match(r"http://[^/]+", address)[0]
        page = browser.new_page()
        said = []
        page.on("console", lambda message: said.append(message.text))
        page.goto(f"http://127.0.0.1:{proxy.port}/{PREFIX}/?view=survey")
        page.wait_for_timeout(5_000)
        assert page.locator("p.empty:visible").count() == 0
        assert any("onnection" in text for text in said)
        page.close()
