"""A served dashboard without a browser: what makes a session, and what one client may ask for."""

import asyncio
import gc
import json
import logging
import re
import socket
import warnings
import weakref
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress

import panel as pn
import pytest
from bokeh.core.serialization import Serializer
from bokeh.events import DocumentReady
from bokeh.models import Plot
from bokeh.protocol import Protocol
from bokeh.server.urls import per_app_patterns
from panel.io import document as panel_document
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.websocket import WebSocketClosedError, websocket_connect

from plateviz.dashboard.app import empty_page
from plateviz.dashboard.server import Endpoint, begin, check_address
from plateviz.dashboard.serving import limits
from plateviz.dashboard.serving.limits import Rate
from plateviz.dashboard.serving.rooms import Rooms
from plateviz.dashboard.serving.websocket import CheckedWebsocket
from tests.plateviz.dashboard.fake_survey import SurveyStore


@pytest.fixture(autouse=True)
def libraries(monkeypatch):
    """Leave Bokeh and Panel to other tests as they were."""
    monkeypatch.setattr(panel_document, "_dispatch_msgs", panel_document._dispatch_msgs)
    before = list(per_app_patterns)
    yield
    per_app_patterns[:] = before


@pytest.fixture
def store(fit_result, run):
    made = SurveyStore(fit_result, [run])
    made.orbits = [0, 1]
    return made


def with_server(store, scenario, **options):
    """Serve a store, and run a coroutine function with its address and its server."""

    async def scene():
        endpoint = Endpoint(check_address("127.0.0.1", 0), "127.0.0.1", **options)
        server = begin(store, endpoint)
        try:
            path = f"{endpoint.prefix}/" if endpoint.prefix else ""
            await scenario(f"http://127.0.0.1:{endpoint.port}/{path}", server)
        finally:
            # The session of a connection that has just closed is told so by this loop.
            await asyncio.sleep(0.1)
            server.stop()

    # Playwright, in the process of other tests, has an event loop in this thread.
    with ThreadPoolExecutor(1) as thread, warnings.catch_warnings():
        # Panel makes the coroutine of a change before it may enter the document, so that a server
        # that ends meanwhile leaves one behind that nothing has awaited.
        warnings.filterwarnings("ignore", "coroutine .* was never awaited", RuntimeWarning)
        thread.submit(asyncio.run, scene()).result()
        gc.collect()


async def get(address, **options):
    """Return the status and the text of an answer."""
    answer = await AsyncHTTPClient().fetch(address, raise_error=False, **options)
    return answer.code, answer.body.decode()


def token_of(page):
    return re.search(r'"token":"([^"]+)"', page)[1]


@asynccontextmanager
async def opened(address, query=""):
    """Get the page and open its websocket as the page does; give the connection."""
    token = token_of((await get(address + query))[1])
    request = HTTPRequest(f"{address.replace('http', 'ws', 1)}ws{query}")
    connection = await websocket_connect(request, subprotocols=["bokeh", token])
    for _ in range(3):
        # The parts of the message that says that the session is there.
        await connection.read_message()
    try:
        yield connection
    finally:
        connection.close()


async def send(connection, message):
    for part in (message.header_json, message.metadata_json, message.content_json):
        await connection.write_message(part)


def event_message(event):
    """Return the message of a page in which something happens, as JSON."""
    sent = {"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": event}
    message = Protocol().create("SERVER-INFO-REQ")
    message.header["msgtype"], message.content = "PATCH-DOC", {"events": [sent]}
    return message


async def ended(connection):
    """Wait for the end of a connection; return its status code."""
    while await asyncio.wait_for(connection.read_message(), 20) is not None:
        pass
    return connection.close_code


def test_request_of_the_page_makes_no_session(store):
    async def scenario(address, server):
        for _ in range(20):
            status, page = await get(address)
            assert status == 200
            assert "<title>plateviz · " in page
            # No session has a table yet whose scripts a notebook would have to send.
            assert "tabulator.min.js" in page
            # The browser loads the components itself, and begins at once.
            assert re.search("<script[^>]*es-module-shims", page) is None
            assert page.index("importShim(") < page.index("bokeh.min.js")
        assert (await get(f"{address}autoload.js?bokeh-autoload-element=1"))[0] == 404
        assert server.get_sessions() == []
        tokens = {token_of((await get(address))[1]) for _ in range(3)}
        assert len(tokens) == 3

    with_server(store, scenario)


@pytest.mark.parametrize("prefix", ["", "stars/plateviz"])
def test_websocket_makes_the_session_that_the_address_requests(store, prefix):
    async def scenario(address, server):
        async with opened(address, "?view=orbit&orbit=1"):
            (session,) = server.get_sessions()
            # Orbit 1 is not in the run.
            assert [orbit for orbit, *_ in store.requested] == [1]
            location = next(m for m in session.document.roots if hasattr(m, "pathname"))
            assert location.pathname == (f"/{prefix}/" if prefix else "/")
            assert "orbit=1" in location.search
            # Relative to the page, also behind a proxy that does not hand on the host's name.
            dist = session.document.template_variables["dist_url"]
            assert dist == "static/extensions/panel/"

    with_server(store, scenario, prefix=prefix)


def asked(token, window):
    return {"method": "POST", "body": json.dumps({"token": token, "window": window})}


WINDOW = {"width": 1920, "height": 1080, "is_dark": True}


def esm_models(document):
    return [one for one in document.models if hasattr(one, "esm")]


def test_page_that_loads_its_scripts_has_its_session_made(store):
    async def scenario(address, server):
        page = (await get(f"{address}?view=orbit&orbit=0"))[1]
        token = token_of(page)
        assert store.pauses == 0
        assert (await get(f"{address}session", **asked(token, WINDOW)))[0] == 204
        assert store.pauses == 1
        (session,) = server.get_sessions()
        location = next(m for m in session.document.roots if hasattr(m, "pathname"))
        assert (location.pathname, location.search) == ("/", "?view=orbit&orbit=0")
        whole = next(m for m in session.document.roots if hasattr(m, "esm"))
        assert whole.data.dark_theme
        # What is straight in the body does not colour it.
        assert page.count("<body>\n<style>") == page.count('</div>\n<div id="page"></div>') == 1
        assert page.count(f'{{"token":"{token}","elementid":"page"') == 1
        # One that is light would turn the page light.
        themes = [getattr(m.data, "dark_theme", True) for m in esm_models(session.document)]
        assert len(themes) > 10
        assert all(themes)
        # The page has begun to load what all its components are in.
        assert f'importShim("{whole.esm}")' in page
        connection = await websocket_connect(
            HTTPRequest(f"{address.replace('http', 'ws', 1)}ws"), subprotocols=["bokeh", token]
        )
        assert '"ACK"' in await connection.read_message()
        assert server.get_sessions() == [session]
        connection.close()

    with_server(store, scenario)


def test_session_is_made_for_a_valid_token_only(store):
    async def scenario(address, server):
        good = token_of((await get(address))[1])
        for token in (good[:-1], "", "e30.e30", None):
            assert (await get(f"{address}session", **asked(token, WINDOW)))[0] == 403
        for body in ("", "[]", "[" * 2**15, "x" * 2**20):
            assert (await get(f"{address}session", method="POST", body=body))[0] == 403
        assert server.get_sessions() == []
        # A window that is none is as if it had not been told.
        assert (await get(f"{address}session", **asked(good, {"width": -1})))[0] == 204

    with_server(store, scenario)


def test_client_opens_so_many_pages_a_minute(store, monkeypatch):
    monkeypatch.setattr(limits, "OPENINGS", Rate(at_once=1, per_second=0.01))

    async def scenario(address, server):
        first, second = [token_of((await get(address))[1]) for _ in range(2)]
        assert (await get(f"{address}session", **asked(first, WINDOW)))[0] == 204
        assert (await get(f"{address}session", **asked(second, WINDOW)))[0] == 429
        request = HTTPRequest(f"{address.replace('http', 'ws', 1)}ws")
        with pytest.raises(HTTPClientError, match="429"):
            await websocket_connect(request, subprotocols=["bokeh", second])
        # The first one has its session already.
        connection = await websocket_connect(request, subprotocols=["bokeh", first])
        connection.close()

    with_server(store, scenario)


class KnownRooms(Rooms):
    """Rooms as if another page had told them."""

    def of(self, window, cards):
        return dict.fromkeys(cards, (500, 300))


@pytest.mark.parametrize(("rooms", "n_drawn"), [(Rooms, 0), (KnownRooms, 1)])
def test_first_figure_is_drawn_before_the_page_is_shown(store, monkeypatch, rooms, n_drawn):
    monkeypatch.setattr("plateviz.dashboard.server.Rooms", rooms)

    async def scenario(address, server):
        token = token_of((await get(f"{address}?view=orbit&orbit=0"))[1])
        assert (await get(f"{address}session", **asked(token, WINDOW)))[0] == 204
        (session,) = server.get_sessions()
        assert len(list(session.document.select({"type": Plot}))) == n_drawn

    with_server(store, scenario)


def test_server_does_not_keep_a_page(store):
    page = weakref.ref(empty_page(store))
    gc.collect()
    assert page() is None


@pytest.fixture
def without_logs():
    """Nothing is logged: pytest keeps what is, with the pages that it is about."""
    logging.disable(logging.CRITICAL)
    yield
    logging.disable(logging.NOTSET)


@pytest.mark.slow
@pytest.mark.usefixtures("without_logs")
def test_pages_that_are_closed_leave_nothing(store, monkeypatch):
    monkeypatch.setattr("plateviz.dashboard.server._LOST_MILLISECONDS", 1)
    monkeypatch.setattr("plateviz.dashboard.server.Rooms", KnownRooms)
    # As in a new process, where Panel begins its task within the first page.
    monkeypatch.setattr(type(pn.state), "_busy_cleanup_scheduled", None)
    documents = []

    async def see(address, server):
        token = token_of((await get(f"{address}?view=orbit&orbit=0"))[1])
        assert (await get(f"{address}session", **asked(token, WINDOW)))[0] == 204
        request = HTTPRequest(f"{address.replace('http', 'ws', 1)}ws")
        connection = await websocket_connect(request, subprotocols=["bokeh", token])
        for _ in range(3):
            await connection.read_message()
        (session,) = server.get_sessions()
        documents.append(weakref.ref(session.document))
        await send(connection, event_message(Serializer().encode(DocumentReady())))
        # What the page does in its first moments; its answers come in between.
        await asyncio.sleep(0.3)
        connection.close()
        await ended(connection)

    async def scenario(address, server):
        for _ in range(3):
            await see(address, server)
            for _ in range(100):
                await server._tornado._cleanup_sessions()
                if not server.get_sessions():
                    break
                await asyncio.sleep(0.05)
            assert server.get_sessions() == []
        # A timer that was set just before a page was closed keeps it until its time has come.
        for _ in range(20):
            gc.collect()
            if not any(document() for document in documents):
                break
            await asyncio.sleep(0.05)
        assert [document() for document in documents] == [None] * 3

    with_server(store, scenario)


@pytest.mark.parametrize(("code", "n_kept"), [(1001, 0), (None, 1)], ids=["left", "lost"])
def test_session_of_a_page_that_is_left_ends_and_that_of_a_lost_one_stays(store, code, n_kept):
    async def scenario(address, server):
        page = (await get(f"{address}?view=orbit&orbit=0"))[1]
        request = HTTPRequest(f"{address.replace('http', 'ws', 1)}ws")
        protocols = ["bokeh", token_of(page)]
        connection = await websocket_connect(request, subprotocols=protocols)
        assert '"ACK"' in await connection.read_message()
        sessions = server.get_sessions()
        if code is None:
            # The message that says that it is closed does not arrive.
            connection.protocol.stream.close()
        connection.close(code)
        while sessions[0].connection_count:
            await asyncio.sleep(0.02)
        await server._tornado._cleanup_sessions()
        assert len(server.get_sessions()) == n_kept
        if n_kept:
            again = await websocket_connect(request, subprotocols=protocols)
            assert '"ACK"' in await again.read_message()
            assert server.get_sessions() == sessions
            again.close()

    with_server(store, scenario)


def test_page_without_its_last_slash_is_sent_to_its_path(store):
    async def scenario(address, server):
        answer = await AsyncHTTPClient().fetch(
            f"{address.removesuffix('/')}?orbit=1", raise_error=False, follow_redirects=False
        )
        assert (answer.code, answer.headers["Location"]) == (302, "/stars/?orbit=1")

    with_server(store, scenario, prefix="stars")


def test_one_page_too_many_is_told_so_until_another_is_closed(store):
    async def scenario(address, server):
        async with opened(address) as first, opened(address):
            token = token_of((await get(f"{address}"))[1])
            async with opened(address):
                status, page = await get(address)
                assert status == 503
                assert "shows 3 pages at once to one address" in page
                request = HTTPRequest(f"{address.replace('http', 'ws', 1)}ws")
                with pytest.raises(HTTPClientError, match="503"):
                    await websocket_connect(request, subprotocols=["bokeh", token])
                first.close()
                await ended(first)
                assert (await get(address))[0] == 200

    with_server(store, scenario, pages_per_address=3)


def test_behind_a_proxy_the_clients_are_those_that_it_states(store):
    async def scenario(address, server):
        async with opened(address):
            for client, status in (("192.0.2.1", 200), (None, 200)):
                headers = {} if client is None else {"X-Real-IP": client}
                assert (await get(address, headers=headers))[0] == status
        server._tornado.settings["plateviz_limits"].pages.enter("192.0.2.1")
        for client, status in (("192.0.2.1", 503), ("192.0.2.2", 200)):
            assert (await get(address, headers={"X-Real-IP": client}))[0] == status

    with_server(store, scenario, pages_per_address=1, proxies=("astro.example.org",))


def test_flood_of_requests_is_refused_and_then_forgiven(store, monkeypatch, caplog):
    monkeypatch.setattr(limits, "REQUESTS", Rate(at_once=30, per_second=20))

    async def scenario(address, server):
        answers = await asyncio.gather(*(get(address) for _ in range(60)))
        refused = [status for status, _ in answers if status == 429]
        assert 10 < len(refused) < 40
        assert {status for status, _ in answers} == {200, 429}
        await asyncio.sleep(0.2)
        assert (await get(address))[0] == 200

    with_server(store, scenario)
    assert "429 GET" not in caplog.text


@pytest.mark.parametrize(
    "text", ['{"msgtype": "no such message"}', "no message", "[" * 10_000, '{"msgid": 1}']
)
def test_messages_that_are_wrong_end_their_connection_only(store, caplog, text):
    async def scenario(address, server):
        async with opened(address) as good, opened(address) as bad:
            with suppress(WebSocketClosedError):
                for _ in range(1000):
                    await bad.write_message(text)
            await ended(bad)
            await send(good, Protocol().create("SERVER-INFO-REQ"))
            answer = await asyncio.wait_for(good.read_message(), 20)
            assert '"SERVER-INFO-REPLY"' in answer

    with_server(store, scenario)
    assert "failed to parse" not in caplog.text


def test_small_messages_are_not_kept_back(store, monkeypatch):
    websockets = []
    opens = CheckedWebsocket.open

    def remember(websocket, *arguments, **named):
        opens(websocket, *arguments, **named)
        websockets.append(websocket)

    monkeypatch.setattr(CheckedWebsocket, "open", remember)

    async def scenario(address, server):
        async with opened(address):
            (websocket,) = websockets
            connection = websocket.ws_connection.stream.socket
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)

    with_server(store, scenario)


def test_message_before_the_session_ends_its_connection_only(store, monkeypatch, caplog):
    async def scenario(address, server):
        async def no_session_yet(*_):
            pass

        async with opened(address) as good:
            token = token_of((await get(address))[1])
            monkeypatch.setattr(CheckedWebsocket, "_async_open", no_session_yet)
            request = HTTPRequest(f"{address.replace('http', 'ws', 1)}ws")
            early = await websocket_connect(request, subprotocols=["bokeh", token])
            with suppress(WebSocketClosedError):
                await send(early, Protocol().create("SERVER-INFO-REQ"))
            assert await ended(early) == 1008
            early.close()
            await send(good, Protocol().create("SERVER-INFO-REQ"))
            answer = await asyncio.wait_for(good.read_message(), 20)
            assert '"SERVER-INFO-REPLY"' in answer

    with_server(store, scenario)
    assert "failed to parse" not in caplog.text


def test_client_that_sends_too_much_is_cut_off(store, monkeypatch):
    monkeypatch.setattr(limits, "MESSAGES", Rate(at_once=60, per_second=1))

    async def scenario(address, server):
        async with opened(address) as busy:
            for _ in range(30):
                await send(busy, Protocol().create("SERVER-INFO-REQ"))
            assert await ended(busy) == 1008

    with_server(store, scenario)


def test_messages_that_cannot_be_carried_out_end_the_connection_in_the_end(store, caplog):
    async def scenario(address, server):
        async with opened(address) as bad:
            events = [{"kind": "ModelChanged", "model": {"id": "none"}, "attr": "x", "new": 1}]
            for _ in range(100):
                message = Protocol().create("SERVER-INFO-REQ")
                message.header["msgtype"] = "PATCH-DOC"
                message.content = {"events": events}
                await send(bad, message)
            assert await ended(bad) == 1008

    with_server(store, scenario)
    assert caplog.text.count("none") < 200


@pytest.mark.newest
def test_button_of_a_page_that_is_being_drawn_is_answered(store, fit_result):
    source = fit_result.sources["source_id"].iloc[0]

    async def scenario(address, server):
        async with opened(address, f"?view=orbit&orbit=0&sources={source}") as connection:
            await send(connection, Protocol().create("PULL-DOC-REQ"))
            (session,) = server.get_sessions()
            button = next(
                one
                for one in esm_models(session.document)
                if getattr(one.data, "label", None) == "List"
            )
            # Only the browser says that the page is drawn, which it has not done yet.
            values = {"type": "map", "entries": [["model", button.ref], ["node", "click"]]}
            click = {"type": "event", "name": "dom_event", "values": values}
            await send(connection, event_message(click))
            while '"attr":"open","new":true' not in str(
                await asyncio.wait_for(connection.read_message(), 20)
            ):
                pass

    with_server(store, scenario)
