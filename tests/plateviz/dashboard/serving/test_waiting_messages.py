"""No message to a page waits for another one to be sent."""

import asyncio
import inspect
from concurrent.futures import ThreadPoolExecutor

import pytest
from bokeh.document import Document
from panel.io import document as panel_document

from plateviz.dashboard.serving.waiting_messages import send_waiting_messages

pytestmark = pytest.mark.newest


class Socket:
    """A socket whose writes end when the test says so."""


class Protocol:
    def create(self, _kind, events):
        return events


class Connection:
    protocol = Protocol()

    def __init__(self):
        self._socket, self.sent, self.writing = Socket(), [], []

    def write(self, message):
        self.sent.append(message)
        self.writing.append(asyncio.get_running_loop().create_future())
        return self.writing[-1:]


@pytest.fixture
def connection(monkeypatch):
    monkeypatch.setitem(panel_document.extra_socket_handlers, Socket, lambda to, msg: to.write(msg))
    # A server of another test may have replaced it.
    of_panel = inspect.unwrap(panel_document._dispatch_msgs)
    monkeypatch.setattr(panel_document, "_dispatch_msgs", of_panel)
    return Connection()


async def send_while_another_message_arrives(connection):
    document = Document()

    def send(text):
        panel_document.schedule_write_events(document, [connection], [text])

    send("first")
    await asyncio.sleep(0.01)
    # The first one is sent, and the second one is asked for before Panel has noted that.
    connection.writing[0].set_result(None)
    send("second")
    await asyncio.sleep(0.05)
    return connection.sent


def sent_to(connection):
    # In a thread: a browser of another test may have an event loop in this one.
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, send_while_another_message_arrives(connection)).result()


def test_message_that_is_asked_for_as_another_arrives_is_sent(connection):
    send_waiting_messages()
    assert sent_to(connection) == [["first"], ["second"]]


def test_panel_leaves_it_waiting(connection):
    # Once this fails, `waiting_messages` can be removed.
    assert sent_to(connection) == [["first"]]


def test_nothing_is_done_twice(connection):
    send_waiting_messages()
    once = panel_document._dispatch_msgs
    send_waiting_messages()
    assert panel_document._dispatch_msgs is once
