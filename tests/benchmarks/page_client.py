"""A page of the dashboard without a browser: its websocket, and the models it has been sent.

`PageClient` does what the scripts of a page do: it asks for its session, opens the websocket, takes
the document, says how large the cards of figures are, and sends changes of controls as messages. It
draws nothing, so that ten of them leave the machine to the server.
"""

import asyncio
import json
import re
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from typing import Any, NamedTuple, Self
from urllib.parse import urljoin

from bokeh.protocol import Protocol
from bokeh.protocol.receiver import Receiver
from tornado.httpclient import AsyncHTTPClient, HTTPError, HTTPRequest
from tornado.websocket import WebSocketClosedError, websocket_connect

_PATIENCE_SECONDS = 20.0
# An answer is complete when nothing more of it has come for so long.
_QUIET_SECONDS = 1.0
_LOOK_SECONDS = 0.02
# Status code with which a browser closes the websocket of a page that is left.
_LEFT = 1001
_MOST_BYTES = 2**28
_WINDOW = {"width": 1920, "height": 1080, "is_dark": False}
# What a browser says of a card in a window of that size, screen pixels.
_ROOM = [510, 330]
_TOKEN = re.compile(r'"token":"([^"]+)"')
_FILE = re.compile(r'(?:src|href)="([^":]*static/[^"]+)"')

Event = dict[str, Any]


class PageError(Exception):
    """A page that was refused, has lost its connection, or waits in vain."""


class Mark(NamedTuple):
    """A change that the server has sent: its kind, and when it came."""

    kind: str
    at: float


class PageClient:
    """One page of the dashboard at `address`.

    Attributes
    ----------
    errors : number of messages that the server could not carry out
    is_lost : whether the server has ended the connection
    """

    def __init__(self, address: str, query: str = "") -> None:
        """Begin unopened."""
        self._address, self._query = address, query
        self._connection: Any = None
        self._listening: asyncio.Task | None = None
        self._models: dict[str, dict[str, Any]] = {}
        self._roots: list[Any] = []
        self._marks: list[Mark] = []
        # Changes of the orbit so far; and how many there had been when a table got its rows.
        self._n_turned, self._filled = 0, dict[str, int]()
        self._is_there = self._is_closing = self.is_lost = False
        self._seen_cards: set[str] = set()
        self._new_cards: list[str] = []
        self._telling: set[asyncio.Task] = set()
        self._writing = asyncio.Lock()
        self.errors = 0

    async def open(self, *, with_files: bool = False) -> Self:
        """Open the page as a browser does; return it.

        Parameters
        ----------
        with_files : whether to fetch the scripts and style sheets, as on a first visit
        """
        page = (await self._fetch(self._query)).decode()
        found = _TOKEN.search(page)
        if found is None:
            raise PageError("expected a page with a token")
        token = found[1]
        if with_files:
            await asyncio.gather(*(self._fetch(path) for path in set(_FILE.findall(page))))
        body = json.dumps({"token": token, "window": _WINDOW})
        await self._fetch("session", method="POST", body=body)
        request = HTTPRequest(f"{self._address.replace('http', 'ws', 1)}ws{self._query}")
        try:
            self._connection = await websocket_connect(
                request, subprotocols=["bokeh", token], max_message_size=_MOST_BYTES
            )
        except (HTTPError, OSError) as error:
            raise PageError(f"websocket: {error}") from error
        self._listening = asyncio.create_task(self._listen())
        await self.until(lambda: self._is_there)
        await self._write("PULL-DOC-REQ", {})
        await self.until(lambda: bool(self._models), _PATIENCE_SECONDS)
        return self

    async def ready(self, n_figures: int = 1, patience: float = _PATIENCE_SECONDS) -> None:
        """Say that the page is there; wait for so many figures, until no more come.

        The controls of a refit come after the figures.
        """
        self._marks.clear()
        event = {"type": "event", "name": "document_ready", "values": {}}
        await self.send([{"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": event}])
        await self.until(lambda: self.count("Plot") >= n_figures and self.has("Fit"), patience)
        await self._until_quiet({"drawn", "data"})

    async def close(self) -> None:
        """Close the page."""
        self._is_closing = True
        if self._connection is not None:
            self._connection.close(_LEFT)
        if self._listening is not None:
            await asyncio.wait([self._listening], timeout=_PATIENCE_SECONDS)

    @property
    def is_unopened(self) -> bool:
        """Whether the page has not had a connection."""
        return self._connection is None

    def count(self, kind: str) -> int:
        """Return the number of models of a kind."""
        return sum(one["name"] == kind for one in self._models.values())

    @property
    def last_drawing(self) -> float:
        """When the last figure came, as from `time.perf_counter`."""
        return max(mark.at for mark in self._marks if mark.kind in {"drawn", "data"})

    async def answered(
        self, events: list[Event], kinds: Collection[str], patience: float = _PATIENCE_SECONDS
    ) -> float:
        """Send events; return the seconds until the last change of some kinds has come."""
        self._marks.clear()
        begin = time.perf_counter()
        await self.send(events)
        await self.until(lambda: any(mark.kind in kinds for mark in self._marks), patience)
        return await self._until_quiet(kinds) - begin

    async def send(self, events: list[Event]) -> None:
        """Send events of the document."""
        for event in events:
            if event["kind"] == "ModelChanged":
                # The server does not send it back.
                self._models[event["model"]["id"]][event["attr"]] = event["new"]
        await self._write("PATCH-DOC", {"events": events})

    async def send_text(self, text: str) -> None:
        """Send a text, whether or not it is a part of a message."""
        try:
            await self._connection.write_message(text)
        except WebSocketClosedError as error:
            raise PageError("lost its connection") from error

    def has(self, label: str) -> bool:
        """Return whether there is such a control."""
        return self._find(label) is not None

    def put(self, label: str, value: object, attribute: str = "value") -> Event:
        """Return the event of a control that gets a value."""
        self._n_turned += label == "Orbit"
        return _changed(self._control(label), attribute, value)

    def click(self, label: str) -> Event:
        """Return the event of a button that is clicked."""
        data = self._control(label)
        owner = next(one for one, model in self._models.items() if _id(model.get("data")) == data)
        values = {"model": {"id": owner}, "node": "click", "data": {}}
        event = {"type": "event", "name": "dom_event", "values": values}
        return {"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": event}

    def value(self, label: str, attribute: str = "value") -> Any:  # noqa: ANN401 of any control
        """Return the value of a control."""
        return _plain(self._models[self._control(label)].get(attribute))

    def exchange(self, first: str, second: str) -> Event:
        """Return the event of the switch between two options; the second if another is chosen."""
        for one, model in self._models.items():
            options = _plain(model.get("options")) or []
            if {first, second} <= set(options):
                # Messages leave out the value of a control that has never been changed.
                now = _plain(model.get("value")) or options[0]
                return _changed(one, "value", first if now == second else second)
        raise PageError(f"expected a switch with {first!r} and {second!r}")

    def select_rows(self, count: int, number: int) -> Event:
        """Return the event of some `count` sources that are selected in the figure with most.

        A figure that is not in view may still show the orbit before.
        """
        tables = [
            (self._filled.get(table, 0), rows, _id(model["selected"]) or "")
            for table, model in self._tables_of_points()
            if (rows := _rows_with_id(model))
        ]
        _, rows, selected = max(tables, default=(0, 0, ""))
        if not selected:
            raise PageError("expected a figure with sources")
        first = 97 * number % max(rows - count, 1)
        return _changed(selected, "indices", list(range(first, min(first + count, rows))))

    def _tables_of_points(self) -> Iterator[tuple[str, dict[str, Any]]]:
        for model in map(self._models.__getitem__, self._in_document()):
            glyph, table = (_id(model.get(name)) for name in ("glyph", "data_source"))
            if glyph and table and self._models[glyph]["name"] == "Scatter":
                yield table, self._models[table]

    def _in_document(self) -> set[str]:
        """Return the models that the document has now; others have been replaced."""
        found, parts = set[str](), list(self._roots)
        while parts:
            part = parts.pop()
            if isinstance(part, list):
                parts += part
            elif isinstance(part, dict):
                model = part.get("id")
                if not isinstance(model, str) or model not in self._models:
                    parts += part.values()
                elif model not in found:
                    found.add(model)
                    parts += self._models[model].values()
        return found

    def _find(self, label: str) -> str | None:
        """Return the model with the value of a control; a symbol may follow its label."""

        def is_it(model: Mapping[str, Any]) -> bool:
            text = str(model.get("label") or model.get("title"))
            return text == label or text.startswith(f"{label} (")

        return next((one for one in reversed(self._models) if is_it(self._models[one])), None)

    def _control(self, label: str) -> str:
        found = self._find(label)
        if found is None:
            raise PageError(f"expected a control {label!r}")
        return found

    async def _fetch(self, path: str, **options: Any) -> bytes:  # noqa: ANN401 of Tornado
        address = urljoin(self._address, path) if path else self._address
        try:
            answer = await AsyncHTTPClient().fetch(
                address, raise_error=False, request_timeout=_PATIENCE_SECONDS, **options
            )
        except (HTTPError, OSError) as error:
            raise PageError(f"{path or 'page'}: {error}") from error
        if answer.code >= 400:
            raise PageError(f"{path or 'page'}: status {answer.code}")
        return answer.body

    async def _write(self, kind: str, content: Mapping[str, object]) -> None:
        header = {"msgid": f"{time.perf_counter_ns():x}", "msgtype": kind}
        # Another task may send a message meanwhile.
        async with self._writing:
            for part in (header, {}, content):
                await self.send_text(json.dumps(part))

    async def _listen(self) -> None:
        receiver = Receiver(Protocol())
        while (part := await self._connection.read_message()) is not None:
            message = await receiver.consume(part)
            if message is not None:
                self._take(message.msgtype, message.content, time.perf_counter())
        self.is_lost = not self._is_closing

    def _take(self, kind: str, content: Any, now: float) -> None:  # noqa: ANN401 from the server
        if kind == "ACK":
            self._is_there = True
        elif kind == "ERROR":
            self.errors += 1
        elif kind == "PULL-DOC-REPLY":
            self._roots = content["doc"]["roots"]
            self._gather(self._roots)
        elif kind == "PATCH-DOC":
            for event in content["events"]:
                self._marks += [Mark(one, now) for one in self._followed(event)]
        if self._new_cards:
            task = asyncio.create_task(self._tell_rooms(self._new_cards))
            self._new_cards = []
            self._telling.add(task)
            task.add_done_callback(self._telling.discard)

    def _followed(self, event: Event) -> Iterator[str]:
        """Take a change over; yield its kinds."""
        new = event.get("new", event.get("data"))
        if "Plot" in self._gather(new):
            yield "drawn"
        changed = _id(event.get("model")) or ""
        model = self._models.get(changed)
        if model is None:
            return
        attribute = event.get("attr", "data")
        model[attribute] = _merged(model.get(attribute), new, event)
        if attribute == "data" and model["name"] == "ColumnDataSource":
            self._filled[changed] = self._n_turned
            yield "data"
        if attribute == "indices":
            yield "selected"
        if attribute == "styles":
            yield "shown"

    def _gather(self, part: Any) -> set[str]:  # noqa: ANN401 from the server
        """Keep the models in a part of a message; return their names."""
        names: set[str] = set()
        parts = [part]
        while parts:
            one = parts.pop()
            if isinstance(one, list):
                parts += one
            elif isinstance(one, dict):
                if one.get("type") == "object" and "id" in one:
                    attributes = one.get("attributes", {})
                    self._models[one["id"]] = {**attributes, "name": one["name"]}
                    self._filled[one["id"]] = self._n_turned
                    names.add(one["name"])
                    self._note_card(attributes)
                parts += one.values()
        return names

    def _note_card(self, attributes: Mapping[str, Any]) -> None:
        """Remember the part of a card that reports its size."""
        if attributes.get("class_name") == "Visibility" and "data" in attributes:
            data = _id(attributes["data"])
            if data is not None and data not in self._seen_cards:
                self._seen_cards.add(data)
                self._new_cards.append(data)

    async def _tell_rooms(self, cards: list[str]) -> None:
        # A browser lays out what has come first.
        await asyncio.sleep(0.1)
        changes = [
            _changed(one, attribute, value)
            for one in cards
            for attribute, value in (("room", _ROOM), ("is_near", True))
        ]
        # The page may be closed by now.
        with suppress(PageError):
            await self.send(changes)

    async def until(self, is_done: Callable[[], bool], patience: float = _PATIENCE_SECONDS) -> None:
        """Wait; `PageError` if it does not come about or the connection is lost."""
        end = time.perf_counter() + patience
        while not is_done():
            if self.is_lost:
                raise PageError("lost its connection")
            if time.perf_counter() > end:
                raise PageError(f"no answer came in {patience:.0f} s")
            await asyncio.sleep(_LOOK_SECONDS)

    async def _until_quiet(self, kinds: Collection[str]) -> float:
        """Wait until no change of some kinds comes any more; return when the last one came."""

        begin = time.perf_counter()

        def last() -> float:
            return max((mark.at for mark in self._marks if mark.kind in kinds), default=begin)

        await self.until(
            lambda: time.perf_counter() - last() > _QUIET_SECONDS, 2 * _PATIENCE_SECONDS
        )
        return last()


def _changed(model: str, attribute: str, value: object) -> Event:
    return {"kind": "ModelChanged", "model": {"id": model}, "attr": attribute, "new": value}


def _id(part: Any) -> str | None:  # noqa: ANN401 from the server
    return part.get("id") if isinstance(part, dict) else None


def _plain(part: Any) -> Any:  # noqa: ANN401 from the server
    """Return lists as they were before they were written as messages."""
    if isinstance(part, dict) and "entries" in part:
        return [_plain(one) for one in part["entries"]]
    return [_plain(one) for one in part] if isinstance(part, list) else part


def _merged(old: Any, new: Any, event: Event) -> Any:  # noqa: ANN401 from the server
    """Return a value after a change, which may be of some columns of a table only."""
    if event["kind"] != "ColumnDataChanged" or _columns(old) == {}:
        return new
    return {"type": "map", "entries": [*({**_columns(old), **_columns(new)}).items()]}


def _columns(part: Any) -> dict[str, Any]:  # noqa: ANN401 from the server
    return dict(part["entries"]) if isinstance(part, dict) and "entries" in part else {}


def _rows_with_id(model: Mapping[str, Any]) -> int:
    """Return the number of rows of a table of sources; 0 for other tables."""
    ids = _columns(model.get("data")).get("id")
    if isinstance(ids, dict) and "texts" in ids:
        return int(ids["numbers"]["shape"][0]) if "numbers" in ids else len(ids["texts"].split())
    if isinstance(ids, dict) and "shape" in ids:
        return int(ids["shape"][0])
    plain = _plain(ids)
    return len(plain) if isinstance(plain, list) else 0
