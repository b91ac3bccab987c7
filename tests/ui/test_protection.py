"""A served dashboard with a password: what it sends, what it refuses, and who gets in."""

import asyncio
import json
import re
import secrets
from concurrent.futures import ThreadPoolExecutor
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from bokeh.util.token import generate_jwt_token, get_session_id
from playwright.sync_api import expect
from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey
from tests.ui.conftest import see, serving

pytestmark = [pytest.mark.ui, pytest.mark.slow]

PASSWORD = "seven red plates"


@pytest.fixture(scope="module")
def survey(tmp_path_factory):
    directory = tmp_path_factory.mktemp("survey") / "sky"
    simulate_survey(directory, SurveySettings(orbits=1, seed=5).scaled(2_000))
    return directory


@pytest.fixture(scope="module")
def address(survey):
    """A server without a password."""
    with serving("serve", str(survey), "--port", "0") as address:
        yield address


def answer(address, headers=None):
    """Return the status and headers of a response, and its text."""
    try:
        with urlopen(Request(address, headers=headers or {})) as response:
            return response.status, response.headers, response.read().decode()
    except HTTPError as error:
        return error.code, error.headers, error.read().decode()


async def websocket(address, token, origin=None):
    """Open a websocket as a page does, and wait for the first message of the server."""
    headers = {"Origin": origin or address.rstrip("/")}
    request = HTTPRequest(f"{address.replace('http', 'ws', 1)}ws", headers=headers)
    connection = await websocket_connect(request, subprotocols=["bokeh", token])
    await connection.read_message()
    return connection


def done(coroutine):
    """Run a coroutine in a thread, since Playwright has an event loop in this one."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, coroutine).result()


def token_of(page):
    """Return the token that the server wrote into a page."""
    return re.search(r'"token":"([^"]+)"', page)[1]


def test_every_response_has_the_security_headers(address):
    for path in ("", "static/js/bokeh.min.js", "nowhere", "autoload.js?bokeh-autoload-element=1"):
        _, headers, _ = answer(address + path, {"Origin": "http://evil.example"})
        policy = headers["Content-Security-Policy"]
        scripts = re.search(r"script-src ([^;]*)", policy)[1]
        assert "unsafe-inline" not in scripts
        assert "frame-ancestors 'self'" in policy
        assert headers["X-Frame-Options"] == "SAMEORIGIN"
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Referrer-Policy"] == "no-referrer"
        assert not [name for name in headers if name.startswith("Access-Control")]


def test_path_with_a_nul_character_is_not_found(address):
    for path in ("static/%00", "static/js/a%00.js", "%00", "static/extensions/panel/%00/x"):
        assert answer(address + path)[0] == 404


def test_long_address_is_answered_in_words_unless_it_can_be_shown(address, open_page):
    for length in (21_000, 200_000):
        status, _, page = answer(f"{address}?sources={'1' * length}")
        assert status == 414
        assert "This address is too long to be read: it has more than 20,000 characters." in page
    # The longest one that is read.
    numbers = "".join(secrets.choice("0123456789") for _ in range(19_950))
    page = open_page(f"{address}?orbit=0&sources={numbers}&unit=mas&unit=mpix")
    page.get_by_text("sources: expected 20 ids or fewer").wait_for()
    page.get_by_text("the address gives 'unit' 2 times, and the first one is shown").wait_for()


@pytest.mark.parametrize("query", ["orbit=%C2%B2", f"orbit={'1' * 5000}", "theme=%ff&orbit=x"])
def test_address_that_no_program_would_write_opens_a_page(address, open_page, query):
    open_page(f"{address}?{query}").get_by_text("orbit: expected one of 0, found").wait_for()


def test_websocket_needs_a_token_of_the_server(address):
    good = token_of(answer(address)[2])
    other = generate_jwt_token(get_session_id(good), secret_key="x", signed=True)
    unsigned = generate_jwt_token(get_session_id(good), signed=False)
    bad = ["", "x", "e30", "e30.x", "W10.e30", "AAAA.AAAA", other, unsigned, good[:-1], "%00"]
    for token in bad:
        with pytest.raises(HTTPClientError, match="403"):
            done(websocket(address, token))
    with pytest.raises(HTTPClientError, match="403"):
        done(websocket(address, good, "http://127.0.0.1.evil.example"))


def test_message_that_no_page_sends_ends_its_connection_only(address, open_page):
    async def send_too_much():
        connection = await websocket(address, token_of(answer(address)[2]))
        await connection.write_message(json.dumps({"a": "x" * 2**20}))
        while await asyncio.wait_for(connection.read_message(), 20) is not None:
            pass
        connection.close()

    page = open_page(address)
    see(page, "footprint")
    done(send_too_much())
    page.get_by_role("button", name="Survey", exact=True).click()
    page.locator("p.empty:visible", has_text="plateviz survey").wait_for()


def test_page_opens_with_the_password_only(survey, tmp_path, browser):
    file = tmp_path / "password"
    file.write_text(f"{PASSWORD}\n")
    options = ("--port", "0", "--address", "0.0.0.0", "--password-file", str(file))
    with serving("serve", str(survey), *options) as announced:
        address = announced.replace("0.0.0.0", "127.0.0.1")
        assert "docs_json" not in answer(address)[2]
        page = browser.new_page()
        page.goto(f"{address}?view=survey")
        page.get_by_label("Password").fill("seven blue plates")
        page.get_by_role("button").click()
        expect(page.get_by_role("alert")).to_contain_text("not the password")
        page.get_by_label("Password").fill(PASSWORD)
        page.get_by_role("button").click()
        page.locator("p.empty:visible", has_text="plateviz survey").wait_for()
        # A token of the server does not let in who has not given the password.
        token = token_of(page.request.get(address).text())
        with pytest.raises(HTTPClientError, match="403"):
            done(websocket(address, token))
        page.close()


def test_page_that_comes_with_too_many_others_asks_again(address, browser):
    refused = []

    def refuse_first(route):
        refused.append(route.request.url)
        if len(refused) == 1:
            route.fulfill(status=429)
        else:
            route.continue_()

    def close_first(websocket):
        if len(refused) == 1:
            websocket.close()
        else:
            websocket.connect_to_server()

    context = browser.new_context()
    page = context.new_page()
    page.set_default_timeout(90_000)
    page.route("**/session", refuse_first)
    page.route_web_socket("**/ws", close_first)
    page.goto(address)
    see(page, "residual-map")
    assert len(refused) == 2
    context.close()
