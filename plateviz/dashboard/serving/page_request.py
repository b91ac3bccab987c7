"""The page as it is first sent: its scripts, and a token with which it asks for its session.

Bokeh and Panel make a whole session for each request of a page, whoever sends it and whether or
not anything follows. Here the session is made when the page opens its websocket.
"""

import asyncio
import json
import re
import secrets
import time
from collections.abc import Callable
from html import escape
from http import HTTPStatus
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import panel_material_ui as pmui
from bokeh.document import Document
from bokeh.server.session import ServerSession
from bokeh.util.token import (
    generate_jwt_token,
    generate_session_id,
    get_session_id,
    get_token_payload,
)
from panel.io.resources import Resources
from panel.io.server import DocHandler, server_html_page_for_session
from tornado.web import Application, RequestHandler, authenticated

from plateviz.dashboard.serving.limits import Limits
from plateviz.dashboard.serving.unread_queries import readable
from plateviz.dashboard.serving.websocket import is_valid_token

WINDOW = "window"
"""Name under which a session's token has the window of its browser: `rooms.browser_window_from`."""

LONGEST_ADDRESS = 20_000
"""Most characters of an address: its websocket sends it once more, with a token that repeats it."""

# Tornado looks for templates beside this file.
_REFUSED = "refused.html"
_TOO_LONG = [
    f"This address is too long to be read: it has more than {LONGEST_ADDRESS:,} characters. "
    "Nothing of it is shown.",
    "A selection or settings too large for an address are kept under a name, or sent as the file "
    "that Save view in the bar of the page makes.",
]
_WHEN_FULL = "Close a page that is no longer needed. This one looks again every 30 seconds."
# After so long, a page for which there was no room looks again.
_AGAIN_SECONDS = 30
_BEGIN = Path(__file__).with_name("begin.js")
_COMPONENTS = Path(__file__).with_name("components.js")
_OPENING = Path(__file__).with_name("opening.html")
# The scripts with which Panel loads components in old browsers; `components.js` has another way.
_LOADER = re.compile(
    r'<script type="esms-options">.*?</script>|<script[^>]*/es-module-shims[^>]*></script>'
)
# Scripts in the head keep the browser from drawing anything before it has run them; deferred, they
# run in the same order, after the body is drawn.
_SCRIPT_FILE, _DEFERRED = re.compile(r'<script type="text/javascript" src='), "<script defer src="
# The level is that of Bokeh anyway; where it is written, Bokeh is not loaded yet.
_LOG_LEVEL = re.compile(r"<script[^>]*>\s*Bokeh\.set_log_level\([^<]*</script>")
# Id of the element that the page is put into.
_PLACE = "page"
_MOST_BYTES = 2**16
# Seconds without traffic after which a page has its files, and the longest wait for that.
_QUIET_SECONDS = 0.03
_MOST_SECONDS = 0.3


def has_own_scripts(document: Document | None) -> bool:
    """Return whether the page of a document is one that is sent here, with its scripts."""
    context = None if document is None else document.session_context
    # A page that Panel makes elsewhere has no token.
    return WINDOW in getattr(context, "token_payload", {})


class PageHandler(DocHandler):
    """Answers a request of the page without a session."""

    def initialize(self, page: "EmptyPage", limits: Limits, **_: object) -> None:
        """Take the page, the same for all requests but for its token, and the limits."""
        self._page, self._limits = page, limits

    @authenticated
    async def get(self, *_: object, **__: object) -> None:
        """Send the page with a token of its own."""
        # A token is good for one page, and not for long.
        self.set_header("Cache-Control", "no-store")
        prefix = self.application.prefix
        if prefix and self.request.path == prefix:
            # What the page loads has paths relative to its own.
            query = f"?{self.request.query}" if self.request.query else ""
            self.redirect(f"{prefix}/{query}")
            return
        if len(self.request.uri or "") > LONGEST_ADDRESS:
            self.set_status(HTTPStatus.REQUEST_URI_TOO_LONG)
            self._refuse("the address is too long", _TOO_LONG, page=f"{prefix}/")
            return
        reason = self._limits.pages.reason(self._limits.client_of(self.request))
        if reason:
            self.set_status(503)
            self.set_header("Retry-After", str(_AGAIN_SECONDS))
            self._refuse("all pages are open", [reason, _WHEN_FULL], seconds=_AGAIN_SECONDS)
            return
        self.set_header("Content-Type", "text/html")
        self.write(self._page.with_token(self._token()))

    def _refuse(
        self, title: str, sentences: list[str], *, seconds: int = 0, page: str = ""
    ) -> None:
        """Say why there is no page: it looks again after some seconds, or links another one."""
        words = {"title": title, "sentences": sentences, "seconds": seconds, "page": page}
        self.render(_REFUSED, **words)

    def _log(self) -> None:
        """Log no address that is too long to be read."""
        if self.get_status() != HTTPStatus.REQUEST_URI_TOO_LONG:
            super()._log()

    def _token(self) -> str:
        """Return a new token, which has what the page's address requests."""
        own = self.application
        key: dict[str, Any] = {"secret_key": own.secret_key, "signed": own.sign_sessions}
        return generate_jwt_token(
            generate_session_id(**key),
            expiration=own.session_token_expiration,
            extra_payload={
                "arguments": readable(self.request.arguments),
                "query": self.request.query,
                "app_path": "/",
            },
            **key,
        )


class SessionHandler(DocHandler):
    """Makes the session of a page that loads its scripts, before it connects."""

    def initialize(self, limits: Limits, on_open: Callable[[], object], **_: object) -> None:
        """Take the limits of sessions, and what is called before one is made."""
        self._limits, self._on_open = limits, on_open

    @authenticated
    async def post(self, *_: object, **__: object) -> None:
        """Make a session for a valid token, with what the page tells of its window."""
        token, window = self._told()
        if not is_valid_token(token, self.application):
            self.set_status(403)
            return
        client = self._limits.client_of(self.request)
        if self._limits.pages.reason(client) or not self._limits.may_open(client):
            self.set_status(429)
            return
        self._on_open()
        await self._quiet()
        own = self.application
        payload = get_token_payload(token)
        left = payload.pop("session_expiry") - int(time.time())
        session = get_session_id(token)
        token = generate_jwt_token(
            session,
            secret_key=own.secret_key,
            signed=own.sign_sessions,
            expiration=max(left, 1),
            extra_payload={**payload, WINDOW: window},
        )
        self.request.path = f"{own.prefix}/"
        self.request.uri = f"{own.prefix}/?{payload['query']}"
        await self.application_context.create_session_if_needed(session, self.request, token)
        self.set_status(204)

    async def _quiet(self) -> None:
        """Let the files of the page go first, which the browser runs meanwhile."""
        end, traffic = time.monotonic() + _MOST_SECONDS, self._limits.traffic
        while traffic.quiet_seconds < _QUIET_SECONDS and time.monotonic() < end:
            await asyncio.sleep(_QUIET_SECONDS / 2)

    def _told(self) -> tuple[str, object]:
        """Return the token and the window of a request; nothing of what is not well-formed."""
        try:
            told = json.loads(self.request.body[:_MOST_BYTES])
            return str(told["token"]), told[WINDOW]
        except (ValueError, KeyError, TypeError, RecursionError):
            return "", None


class NoScript(RequestHandler):
    """The script that embeds the page in another site, which the headers forbid: status 404."""

    def prepare(self) -> None:
        """Refuse the request, for which Bokeh would make a session."""
        self.send_error(404)


class EmptyPage:
    """HTML of the page without its contents, made once for a server."""

    def __init__(self, page: pmui.Page, resources: Resources) -> None:
        """Write the HTML around the contents of `page`."""
        sample, document = Document(), Document()
        page.server_doc(sample, location=False)
        # The file of all components, which the page would only find in its session.
        components = str(page._render_esm(server=True))  # noqa: SLF001 a test notices a change
        document.title, document.template = sample.title, sample.template
        document.template_variables.update(sample.template_variables)
        sample.clear()
        token = secrets.token_hex()
        html = server_html_page_for_session(
            # It has a document and a token, and nothing else is used.
            cast("ServerSession", SimpleNamespace(document=document, token=token)),
            resources=resources,
            title=document.title,
            template=document.template,
            template_variables=document.template_variables,
        )
        begin = _BEGIN.read_text(encoding="utf-8").replace('"TOKEN"', json.dumps(token))
        of_components = _COMPONENTS.read_text(encoding="utf-8")
        load = f"importShim({json.dumps(components)}).catch(() => {{}})"
        scripts = "\n".join(f"<script>{one}</script>" for one in (begin, of_components, load))
        html = _LOADER.sub("", html).replace("</title>", f"</title>\n{scripts}", 1)
        html = _LOG_LEVEL.sub("", _SCRIPT_FILE.sub(_DEFERRED, html))
        opening = _OPENING.read_text(encoding="utf-8").replace("TITLE", escape(document.title))
        # A page straight in the body would be taken for a part of another page, and leave the
        # body without the colours of its theme.
        html = html.replace("<body>", f'<body>\n{opening}<div id="{_PLACE}"></div>', 1)
        html = html.replace('"use_for_title":', f'"elementid":"{_PLACE}","use_for_title":', 1)
        self._parts = html.split(token)

    def with_token(self, token: str) -> str:
        """Return the HTML for one request."""
        return token.join(self._parts)


def send_empty_pages(
    application: Application, page: pmui.Page, limits: Limits, on_open: Callable[[], object]
) -> None:
    """Let the server of `application` answer requests of its page without making sessions.

    Parameters
    ----------
    page : the page of any session, of which only what is around its contents is taken
    limits : of the pages that are open
    on_open : called when a page opens, before its session is made
    """
    own: Any = application
    empty = EmptyPage(page, Resources.from_bokeh(own.resources()))
    arguments = {
        "page": empty,
        "limits": limits,
        "on_open": on_open,
        "application_context": own.applications["/"],
        "bokeh_websocket_path": f"{own.prefix}/ws",
    }
    application.add_handlers(
        r".*",
        [
            (rf"{own.prefix}/?", PageHandler, arguments),
            (rf"{own.prefix}/session", SessionHandler, arguments),
            (rf"{own.prefix}/autoload\.js", NoScript),
        ],
    )
