"""What people do on pages of the dashboard one after the other, and how long each answer takes."""

import asyncio
import random
import time
from collections import defaultdict
from collections.abc import Awaitable, Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count

from playwright.sync_api import ConsoleMessage, Error, Page

from plateviz.plots.gallery import diagnostics
from plateviz.plots.workspace import OrbitWorkspace, title_of
from tests.benchmarks.bench_browser import (
    Taken,
    answered,
    finished,
    next_exposure_or_detector,
    next_orbit,
    next_prior,
    next_selection,
)
from tests.benchmarks.page_client import PageClient, PageError

_MANY = 1000
_EXPOSURES, _PRIOR, _ORDER = "Exposures of the field", "source positions", "Distortion order"
_AT_ONCE = "What-if at every change"
# What comes of figures; one that has not been drawn yet is drawn with the answer.
_FIGURES = frozenset({"data", "drawn"})
_PATIENCE_OF_FIT = 600.0
# Chromium's software renderer remarks on its own speed; that is no fault of the page.
_HARMLESS = ("GL Driver Message", "GPU stall")


@dataclass
class Record:
    """What a part has found.

    Attributes
    ----------
    seconds : until each answer was complete, by action
    errors : in words
    fits : number of fits that ended
    """

    seconds: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    errors: list[str] = field(default_factory=list)
    fits: int = 0

    @property
    def all_seconds(self) -> list[float]:
        """The seconds of all actions."""
        return [one for many in self.seconds.values() for one in many]


@dataclass
class Pace:
    """When clicking ends, as from `time.monotonic`, and how long a person looks at an answer, s.

    Attributes
    ----------
    numbers : no what-if of any page has the prior of another, so that each is computed
    """

    end: float
    pause: float
    numbers: Iterator[int] = field(default_factory=count)

    @property
    def is_over(self) -> bool:
        """Whether no more actions are to begin."""
        return time.monotonic() > self.end

    @property
    def look(self) -> float:
        """A duration, s, for which a person looks at an answer."""
        return self.pause * random.uniform(0.5, 1.5)  # noqa: S311 no secret

    def prior(self) -> str:
        """Return a width of a prior that no page has had."""
        return f"{2.0 + 0.001 * next(self.numbers):.3f}"


async def _exposure(client: PageClient, number: int, pace: Pace) -> float:
    del pace
    first, last = (int(one) for one in client.value(_EXPOSURES) or (0, 0))
    at = number % 8
    at += (at, at) == (first, last)
    return await client.answered([client.put(_EXPOSURES, [at, at])], _FIGURES)


async def _detector(client: PageClient, number: int, pace: Pace) -> float:
    del pace
    return await _choose(client, "Detector", number)


async def _orbit(client: PageClient, number: int, pace: Pace) -> float:
    del pace
    return await _choose(client, "Orbit", number)


async def _selection(client: PageClient, number: int, pace: Pace) -> float:
    del pace
    return await client.answered([client.select_rows(_MANY, number)], {"selected"})


async def _prior(client: PageClient, number: int, pace: Pace) -> float:
    del number
    if not client.has(_PRIOR):
        await client.send([client.put("Priors", False, "collapsed")])
        await client.until(lambda: client.has(_PRIOR))
    return await client.answered([client.put(_PRIOR, pace.prior())], _FIGURES)


async def _order(client: PageClient, number: int, pace: Pace) -> float:
    del pace
    orders = [one for one in (2, 3, 4, 5) if one != client.value(_ORDER)]
    chosen = client.put(_ORDER, orders[number % len(orders)])
    return await client.answered([chosen], _FIGURES)


async def _workspace(client: PageClient, number: int, pace: Pace) -> float:
    del number, pace
    other = client.exchange(title_of(OrbitWorkspace.VERDICT), title_of(OrbitWorkspace.RESIDUALS))
    return await client.answered([other], _FIGURES | {"shown"})


async def _choose(client: PageClient, label: str, number: int) -> float:
    offered = client.value(label, "options")
    # Messages leave out the value of a control that has never been changed.
    now = client.value(label) or offered[0]
    others = [one for one in offered if one != now]
    return await client.answered([client.put(label, others[number % len(others)])], _FIGURES)


Act = Callable[[PageClient, int, Pace], Awaitable[float]]
ACTIONS: Sequence[tuple[str, Act]] = (
    ("next exposure", _exposure),
    ("detector", _detector),
    ("what-if: prior", _prior),
    ("what-if: order", _order),
    ("selection of 1,000 sources", _selection),
    ("workspace", _workspace),
    ("workspace", _workspace),
    ("orbit", _orbit),
)


async def use(client: PageClient, number: int, pace: Pace, record: Record) -> None:
    """Do one action after the other on a page; pages with other numbers begin with other ones."""
    for n in count(number):
        if pace.is_over:
            break
        name, act = ACTIONS[n % len(ACTIONS)]
        try:
            seconds = await act(client, n // len(ACTIONS) + number, pace)
            record.seconds[name].append(seconds)
        except PageError as error:
            record.errors.append(f"{name}: {error}")
            if client.is_lost:
                return
        await asyncio.sleep(pace.look)
    if client.errors:
        record.errors.append(f"the server could not carry out {client.errors} messages")


async def keep_fitting(client: PageClient, pace: Pace, record: Record) -> None:
    """Ask for one long fit after the other, until time is over."""
    await client.send([client.put(_AT_ONCE, False), client.put("Engine", "svi")])
    while not pace.is_over:
        order = client.put(_ORDER, 2 + record.fits % 4)
        left = min(max(pace.end - time.monotonic(), 1.0), _PATIENCE_OF_FIT)
        try:
            await client.send([order])
            await client.answered([client.click("Fit")], _FIGURES, left)
            record.fits += 1
        except PageError as error:
            if not pace.is_over:
                record.errors.append(f"fit: {error}")
            return


def use_page(page: Page, pace: Pace, record: Record) -> None:
    """Do the same on a page in a browser."""
    for n in count():
        if pace.is_over:
            return
        name, act = _PAGE_ACTIONS[n % len(_PAGE_ACTIONS)]
        try:
            taken = act(page, n // len(_PAGE_ACTIONS), pace)
            record.seconds[f"{name}, in Chromium"].append((taken.end - taken.begin) / 1e3)
        except Error as error:
            record.errors.append(f"{name}, in Chromium: {error}")
        page.wait_for_timeout(1e3 * pace.look)


def listen_to(page: Page, errors: list[str]) -> None:
    """Note errors and warnings in the console of a page."""

    def note(message: ConsoleMessage) -> None:
        if message.type in {"error", "warning"} and not any(
            words in message.text for words in _HARMLESS
        ):
            errors.append(f"console: {message.text}")

    page.on("console", note)
    page.on("pageerror", lambda error: errors.append(f"page: {error}"))


def _page_exposure(page: Page, number: int, pace: Pace) -> Taken:
    del pace
    thumb = page.get_by_role("slider", name=_EXPOSURES).last
    thumb.focus()
    key = "ArrowRight" if number % 2 == 0 else "ArrowLeft"
    return answered(page, lambda: thumb.press(key), "residual-map", words=False)


def _page_detector(page: Page, number: int, pace: Pace) -> Taken:
    del pace
    return next_exposure_or_detector(page, 2 * number + 1)


def _page_prior(page: Page, number: int, pace: Pace) -> Taken:
    del number
    # Beyond those of the clients.
    return next_prior(page, next(pace.numbers), least=20.0)


def _page_order(page: Page, number: int, pace: Pace) -> Taken:
    del pace
    slider = page.get_by_role("slider", name=_ORDER)
    slider.focus()
    key = "ArrowLeft" if number % 2 == 0 else "ArrowRight"
    return answered(page, lambda: slider.press(key))


def _page_selection(page: Page, number: int, pace: Pace) -> Taken:
    del pace
    return next_selection(page, number)


def _page_workspace(workspace: OrbitWorkspace) -> Callable[[Page, int, Pace], Taken]:
    is_first = workspace is OrbitWorkspace.VERDICT
    names = [d.name for d in diagnostics() if (d.is_key if is_first else d.workspace is workspace)]

    def turn(page: Page, number: int, pace: Pace) -> Taken:
        del number, pace
        page.evaluate(
            """names => {
              const { plots, until } = window.plateviz;
              const cards = () => new Set(plots().map(one => one.card));
              window.answer = until(() => names.every(name => cards().has(name)));
            }""",
            names,
        )
        page.get_by_role("button", name=title_of(workspace), exact=True).click()
        return finished(page)

    return turn


def _page_orbit(page: Page, number: int, pace: Pace) -> Taken:
    del pace
    return next_orbit(page, number)


_PAGE_ACTIONS: Sequence[tuple[str, Callable[[Page, int, Pace], Taken]]] = (
    ("next exposure", _page_exposure),
    ("detector", _page_detector),
    ("what-if: prior", _page_prior),
    ("what-if: order", _page_order),
    ("selection of 1,000 sources", _page_selection),
    ("workspace", _page_workspace(OrbitWorkspace.RESIDUALS)),
    ("workspace", _page_workspace(OrbitWorkspace.VERDICT)),
    ("orbit", _page_orbit),
)
