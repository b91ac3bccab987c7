"""The traffic of a real server, one of whose clients reads slowly."""

import asyncio
from concurrent.futures import ThreadPoolExecutor

from tornado.httpserver import HTTPServer
from tornado.testing import bind_unused_port
from tornado.web import Application, RequestHandler

from plateviz.dashboard.serving.limits import Limits, PageLimit
from plateviz.dashboard.serving.refused_requests import refuse_floods

# More than the system keeps for a client that does not read.
_MANY_BYTES = 30_000_000


class _Large(RequestHandler):
    async def get(self):
        self.write(b"x" * _MANY_BYTES)
        await self.flush()


async def _quiet(traffic, seconds):
    while traffic.quiet_seconds < seconds:
        await asyncio.sleep(0.01)


def test_answer_on_its_way_is_no_quiet():
    async def run():
        application, limits = Application([("/", _Large)]), Limits(PageLimit(10, 10))
        refuse_floods(application, limits)
        socket, port = bind_unused_port()
        server = HTTPServer(application)
        server.add_sockets([socket])
        assert limits.traffic.quiet_seconds > 1.0
        reader, writer = await asyncio.open_connection("127.0.0.1", port, limit=2**16)
        writer.write(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
        # It reads nothing, and the rest of the answer stays on its way.
        await asyncio.sleep(0.5)
        assert limits.traffic.quiet_seconds < 0.1
        left = _MANY_BYTES
        while left > 0:
            left -= len(await reader.read(2**20))
        await asyncio.wait_for(_quiet(limits.traffic, 0.1), 30.0)
        writer.close()
        server.stop()

    # In a thread without a loop of events, which browser tests leave behind in this one.
    with ThreadPoolExecutor(1) as thread:
        thread.submit(lambda: asyncio.run(run())).result()
