"""The documentation in a real Chromium, with the network off."""

import pytest

from tests.docs.pages import built_site

pytestmark = [pytest.mark.ui, pytest.mark.slow]


@pytest.fixture(scope="module")
def site(tmp_path_factory, chromium_path):
    return built_site(tmp_path_factory)


@pytest.mark.parametrize("name", ["index", "concepts", "diagnostics", "formats", "api"])
def test_page_is_whole_without_a_network(site, browser, name):
    context = browser.new_context(offline=True)
    page, complaints = context.new_page(), []
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("requestfailed", lambda request: complaints.append(request.url))
    page.goto((site / f"{name}.html").as_uri())
    broken = "() => [...document.images].filter(i => !i.naturalWidth).map(i => i.src)"
    assert page.evaluate(broken) == []
    heights = "() => [...document.querySelectorAll('svg.equation')].map(e => e.clientHeight)"
    assert all(height > 3 for height in page.evaluate(heights))
    context.close()
    assert complaints == []
