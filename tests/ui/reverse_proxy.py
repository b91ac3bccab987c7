"""A reverse proxy as small as can be: it hands requests and websockets on, as nginx does."""

import asyncio
import threading
from contextlib import contextmanager

from tornado.httpclient import AsyncHTTPClient, HTTPRequest
from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, RequestHandler
from tornado.websocket import WebSocketHandler, websocket_connect

_NOT_HANDED_ON = {"connection", "content-length", "transfer-encoding", "content-encoding"}


class _Pages(RequestHandler):
    def initialize(self, upstream):
        self._upstream = upstream

    async def get(self):
        await self._hand_on()

    async def post(self):
        await self._hand_on(body=self.request.body)

    async def _hand_on(self, **contents):
        request = HTTPRequest(
            f"{self._upstream()}{self.request.uri}",
            method=self.request.method,
            **contents,
            headers=self.request.headers,
            follow_redirects=False,
        )
        answer = await AsyncHTTPClient().fetch(request, raise_error=False)
        self.set_status(answer.code)
        for name, value in answer.headers.get_all():
            if name.lower() not in _NOT_HANDED_ON:
                self.set_header(name, value)
        # An answer without contents may have no empty ones either.
        self.finish(answer.body or None)


class _Websockets(WebSocketHandler):
    def initialize(self, upstream):
        self._upstream = upstream
        self._inner = None

    def check_origin(self, origin):
        # The server behind is to judge it.
        return True

    def select_subprotocol(self, subprotocols):
        self._subprotocols = subprotocols
        return subprotocols[0] if subprotocols else None

    async def open(self):
        headers = {"Origin": self.request.headers["Origin"]}
        address = f"{self._upstream()}{self.request.uri}".replace("http", "ws", 1)
        self._inner = await websocket_connect(
            HTTPRequest(address, headers=headers),
            on_message_callback=self._hand_back,
            subprotocols=self._subprotocols,
        )

    def _hand_back(self, message):
        if message is None:
            self.close()
        else:
            asyncio.ensure_future(self.write_message(message, isinstance(message, bytes)))

    async def on_message(self, message):
        while self._inner is None:
            await asyncio.sleep(0.01)
        await self._inner.write_message(message, isinstance(message, bytes))

    def on_close(self):
        if self._inner is not None:
            self._inner.close()


class Proxy:
    """Where it listens, and what it hands on to once that is known."""

    def __init__(self, port):
        self.port = port
        self.upstream = ""


@contextmanager
def proxying():
    """Run a proxy on a free port of this machine."""
    sockets = bind_sockets(0, "127.0.0.1")
    proxy = Proxy(sockets[0].getsockname()[1])
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=_run, args=(loop, sockets, proxy))
    thread.start()
    try:
        yield proxy
    finally:
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        for one in sockets:
            one.close()


def _run(loop, sockets, proxy):
    asyncio.set_event_loop(loop)
    target = {"upstream": lambda: proxy.upstream}
    routes = [(r"/.*/ws", _Websockets, target), (r"/.*", _Pages, target)]
    server = HTTPServer(Application(routes, websocket_max_message_size=2**28))
    server.add_sockets(sockets)
    loop.run_forever()
    server.stop()
    loop.run_until_complete(server.close_all_connections())
    loop.close()
