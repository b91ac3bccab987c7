"""Security headers: what a browser may do with what the server sends.

A page may run the scripts of its server and those that the server wrote into it, which bear a
number that is drawn for each page; it may not be shown in a frame of another site, nor be read by
one. What Bokeh and Panel do not allow:

- Style sheets and `style` attributes written into a page are allowed, since both libraries write
  them at every change.
- Scripts may make a function of a text (`unsafe-eval`), since both libraries send callbacks
  as text.
- Scripts may come from `blob:` addresses, which only scripts of the page can make: Panel compiles
  its components in the browser.
- A `<script>` that got into the page on the server would bear the number too. What comes from
  files, names and clients is therefore escaped where a page is written.
"""

import re
import secrets

from tornado.httputil import HTTPHeaders
from tornado.web import OutputTransform

# Pages of a notebook's server are shown in frames of notebooks, which have other ports.
_NOTEBOOKS = "http://127.0.0.1:* http://localhost:* https://localhost:* vscode-webview:"
# Whole elements, so that the same letters within a script are left alone.
_SCRIPT = re.compile(rb"<script\b([^>]*>.*?</script>)", re.IGNORECASE | re.DOTALL)


class SecurityHeaders(OutputTransform):
    """Headers of every response; `add_transform` of a Tornado application takes this class."""

    frames = "'self'"

    def transform_first_chunk(
        self, status_code: int, headers: HTTPHeaders, chunk: bytes, finishing: bool
    ) -> tuple[int, HTTPHeaders, bytes]:
        """Return a response with its headers; called by Tornado, with all of a page at once."""
        # Bokeh lets every site read the script that embeds a page, with the visitor's cookies.
        for name in [name for name in headers if name.startswith("Access-Control-")]:
            del headers[name]
        nonce = ""
        if headers.get("Content-Type", "").startswith("text/html") and finishing:
            nonce = secrets.token_urlsafe()
            chunk = _SCRIPT.sub(rf'<script nonce="{nonce}"\1'.encode(), chunk)
            headers["Content-Length"] = str(len(chunk))
        headers["Content-Security-Policy"] = self._policy(nonce)
        headers["X-Content-Type-Options"] = "nosniff"
        headers["Referrer-Policy"] = "no-referrer"
        headers["Cross-Origin-Resource-Policy"] = "same-origin"
        if self.frames == "'self'":
            headers["X-Frame-Options"] = "SAMEORIGIN"
        return status_code, headers, chunk

    def _policy(self, nonce: str) -> str:
        scripts = f"'self' blob: 'unsafe-eval' 'nonce-{nonce}'" if nonce else "'self'"
        return "; ".join(
            [
                "default-src 'self'",
                f"script-src {scripts}",
                "style-src 'self' 'unsafe-inline'",
                "img-src 'self' data: blob:",
                "font-src 'self' data:",
                "connect-src 'self' blob:",
                "object-src 'none'",
                "base-uri 'none'",
                "form-action 'self'",
                f"frame-ancestors {self.frames}",
            ]
        )


class NotebookHeaders(SecurityHeaders):
    """The same for a page that a notebook of this machine shows in a frame."""

    frames = f"'self' {_NOTEBOOKS}"
