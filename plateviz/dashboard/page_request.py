"""The page as it is first sent: its scripts, and a token with which it asks for its session.

Bokeh and Panel make a whole session for each request of a page, whoever sends it and whether or
not anything follows. Here the session is made when the page opens its websocket.
"""

import secrets
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import panel_material_ui as pmui
from bokeh.document import Document
from bokeh.server.session import ServerSession
from bokeh.util.token import generate_jwt_token, generate_session_id
from panel.io.resources import Resources
from panel.io.server import DocHandler, server_html_page_for_session
from tornado.web import Application, RequestHandler, authenticated

from plateviz.dashboard.limits import Limits

_FULL = Path(__file__).with_name("full.html")


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
        reason = self._limits.pages.reason(self._limits.client_of(self.request))
        if reason:
            self.set_status(503)
            self.set_header("Retry-After", "30")
            self.render(str(_FULL), reason=reason)
            return
        self.set_header("Content-Type", "text/html")
        self.write(self._page.with_token(self._token()))

    def _token(self) -> str:
        """Return a new token, which has what the page's address requests."""
        own = self.application
        key: dict[str, Any] = {"secret_key": own.secret_key, "signed": own.sign_sessions}
        return generate_jwt_token(
            generate_session_id(**key),
            expiration=own.session_token_expiration,
            extra_payload={"arguments": self.request.arguments, "app_path": "/"},
            **key,
        )


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
        self._before, self._after = html.split(token)

    def with_token(self, token: str) -> str:
        """Return the HTML for one request."""
        return f"{self._before}{token}{self._after}"


def send_empty_pages(application: Application, page: pmui.Page, limits: Limits) -> None:
    """Let the server of `application` answer requests of its page without making sessions.

    Parameters
    ----------
    page : the page of any session, of which only what is around its contents is taken
    limits : of the pages that are open
    """
    own: Any = application
    empty = EmptyPage(page, Resources.from_bokeh(own.resources()))
    arguments = {
        "page": empty,
        "limits": limits,
        "application_context": own.applications["/"],
        "bokeh_websocket_path": f"{own.prefix}/ws",
    }
    application.add_handlers(
        r".*",
        [
            (rf"{own.prefix}/?", PageHandler, arguments),
            (rf"{own.prefix}/autoload\.js", NoScript),
        ],
    )
