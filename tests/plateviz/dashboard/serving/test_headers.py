"""Security headers: numbers of the scripts of a page, and who may show it in a frame."""

import re

import pytest
from tornado.httputil import HTTPHeaders

from plateviz.dashboard.serving.headers import NotebookHeaders, SecurityHeaders

PAGE = b"""<html><head><script src="a.js"></script></head><body>
<script type="application/json">{"text": "<script>no tag</ script>"}</script>
<SCRIPT>
run("<script>")
</SCRIPT></body></html>"""


def sent(kind, chunk=PAGE, content="text/html; charset=UTF-8", finishing=True):
    """Return the headers and the body of a response that a transform was given."""
    headers = HTTPHeaders({"Content-Type": content, "Content-Length": str(len(chunk))})
    headers["Access-Control-Allow-Origin"] = "*"
    _, headers, body = kind(None).transform_first_chunk(200, headers, chunk, finishing)
    return headers, body


def test_every_script_of_a_page_bears_the_number_of_its_policy():
    headers, body = sent(SecurityHeaders)
    (nonce,) = re.findall(r"'nonce-([^']+)'", headers["Content-Security-Policy"])
    assert body.count(f'<script nonce="{nonce}"'.encode()) == 3
    # Within a script the same letters are left alone.
    assert b'"<script>no tag</ script>"' in body
    assert b'run("<script>")' in body
    assert headers["Content-Length"] == str(len(body))
    assert "Access-Control-Allow-Origin" not in headers


def test_every_page_has_another_number():
    assert sent(SecurityHeaders)[1] != sent(SecurityHeaders)[1]


def test_other_files_are_sent_as_they_are():
    headers, body = sent(SecurityHeaders, content="application/javascript")
    assert body == PAGE
    assert "unsafe" not in headers["Content-Security-Policy"].split("style-src")[0]


@pytest.mark.parametrize(
    ("kind", "has_option", "ancestors"),
    [
        (SecurityHeaders, True, "frame-ancestors 'self'"),
        (NotebookHeaders, False, "frame-ancestors 'self' http://127.0.0.1:* http://localhost:*"),
    ],
)
def test_frames_of_other_sites_are_refused(kind, has_option, ancestors):
    headers, _ = sent(kind)
    assert ("X-Frame-Options" in headers) == has_option
    assert ancestors in headers["Content-Security-Policy"]
