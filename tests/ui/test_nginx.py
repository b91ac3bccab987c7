"""The dashboard behind nginx, configured by the very text of the serving page."""

import asyncio
import getpass
import re
import shutil
import socket
import ssl
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey
from tests.docs.pages import DOCS, blocks_of
from tests.ui.conftest import see, serving

pytestmark = [
    pytest.mark.ui,
    pytest.mark.full,
    pytest.mark.slow,
    pytest.mark.skipif(not shutil.which("nginx"), reason="there is no nginx on this machine"),
]

USER, PASSWORD = "alma", "seven red plates"
# What nginx needs around the text of the page, and nothing that changes it.
FRAME = """
daemon off; user {user}; pid {folder}/pid; error_log {folder}/error.log;
events {{}}
http {{
    access_log off; client_body_temp_path {folder}/body; proxy_temp_path {folder}/proxy;
    fastcgi_temp_path {folder}/f; uwsgi_temp_path {folder}/u; scgi_temp_path {folder}/s;
    {text}
}}
"""


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return probe.getsockname()[1]


def is_open(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Port of nginx, and that of the server behind it."""
    folder = tmp_path_factory.mktemp("nginx")
    outer, inner = free_port(), free_port()
    certificate = ["-keyout", folder / "plateviz.key", "-out", folder / "plateviz.crt"]
    subject = ["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"]
    new = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2"]
    subprocess.run([*new, *certificate, *subject], check=True, capture_output=True)
    hashed = subprocess.run(
        ["openssl", "passwd", "-apr1", PASSWORD], check=True, capture_output=True, text=True
    )
    (folder / "plateviz.htpasswd").write_text(f"{USER}:{hashed.stdout}")
    (text,) = (block.text for block in blocks_of(DOCS / "serving.md", "nginx"))
    text = text.replace("443 ssl", f"127.0.0.1:{outer} ssl").replace(":5006", f":{inner}")
    text = text.replace("/etc/nginx/", f"{folder}/").replace("astro.example.org", "localhost")
    (folder / "nginx.conf").write_text(
        FRAME.format(folder=folder, user=getpass.getuser(), text=text)
    )
    nginx = subprocess.Popen(["nginx", "-c", str(folder / "nginx.conf")])
    try:
        deadline = time.monotonic() + 20.0
        while not is_open(outer):
            assert nginx.poll() is None, (folder / "error.log").read_text()
            assert time.monotonic() < deadline
            time.sleep(0.1)
        yield outer, inner
    finally:
        nginx.terminate()
        nginx.wait(20)


@pytest.fixture(scope="module")
def dashboard(site, tmp_path_factory):
    """Address of the dashboard as browsers see it."""
    outer, inner = site
    survey = tmp_path_factory.mktemp("survey") / "sky"
    simulate_survey(survey, SurveySettings(orbits=1, seed=5).scaled(2_000))
    options = ("--port", str(inner), "--prefix", "plateviz", "--allow-origin", f"localhost:{outer}")
    with serving("serve", str(survey), *options):
        yield f"https://localhost:{outer}/plateviz/"


def websocket_status(address, token, **options):
    """Return the status with which a websocket is refused; None if it is opened."""

    async def opened():
        host = re.match(r"https://[^/]+", address)[0]
        request = HTTPRequest(
            f"{address.replace('https', 'wss')}ws",
            headers={"Origin": options.pop("origin", host)},
            ssl_options=ssl._create_unverified_context(),
            **options,
        )
        try:
            connection = await websocket_connect(request, subprotocols=["bokeh", token])
        except HTTPClientError as error:
            return error.code
        await connection.read_message()
        connection.close()
        return None

    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, opened()).result()


def test_dashboard_behind_nginx_opens_for_its_users_only(dashboard, browser):
    with_password = {"http_credentials": {"username": USER, "password": PASSWORD}}
    stranger = browser.new_context(ignore_https_errors=True)
    assert stranger.request.get(dashboard).status == 401
    user = browser.new_context(ignore_https_errors=True, **with_password)
    answer = user.request.get(dashboard)
    assert answer.status == 200
    assert "nonce-" in answer.headers["content-security-policy"]
    token = re.search(r'"token":"([^"]+)"', answer.text())[1]
    script = re.search(r'src="([^"]+\.js[^"]*)"', answer.text())[1]
    assert user.request.get(f"{dashboard}{script}").headers["content-encoding"] == "gzip"
    login = {"auth_username": USER, "auth_password": PASSWORD}
    assert websocket_status(dashboard, token) == 401
    assert websocket_status(dashboard, token, **login, origin="https://evil.example") == 403
    assert websocket_status(dashboard, "x", **login) == 403
    assert websocket_status(dashboard, token, **login) is None
    page = user.new_page()
    page.set_default_timeout(90_000)
    complaints = []
    page.on("console", lambda m: m.type == "error" and complaints.append(m.text))
    page.on("requestfailed", lambda request: complaints.append(request.url))
    page.goto(dashboard)
    for figure in ("footprint", "residual-map"):
        see(page, figure)
    page.get_by_role("button", name="Survey", exact=True).click()
    page.locator("p.empty:visible", has_text="plateviz survey").wait_for()
    assert complaints == []
    page.close()
    stranger.close()
    user.close()
