"""Try a served dashboard with many people, long days and clients that mean harm.

    python tests/benchmarks/bench_load.py DIR [--only PART...] [--minutes 10] [options]

DIR is a survey with a run, such as `plateviz simulate DIR && plateviz survey DIR` make. The parts:

- `sessions`: ten pages on which somebody does one thing after the other, while fits with svi run;
- `opening`: twenty pages that are opened at the same moment, on a first visit;
- `soak`: the ten pages for an hour, with another one that is opened and closed again and again;
- `closed`: the memory that 200 pages leave, opened and closed as fast as the server allows, after
  the first six;
- `gets`: the memory that 500 requests of the page leave;
- `few`: three pages without any harm, to compare with the next two;
- `flood`: three pages while another client sends as many requests as it can;
- `malformed`: three pages while a client sends 1,000 messages that are wrong.

On two cores ten browsers would be measured and not the server, which has one core for itself when
ten people have machines of their own. So one page is in Chromium, and measured until it has drawn
the answer; the others are clients that speak Bokeh's protocol over their websockets (see
`page_client.py`), and are measured until the last message of the answer has come. All run on the
machine of the server and take some of its time. A person looks at each answer for `--pause` seconds
on average, after the second that tells that no more of it comes.

Each part has a server of its own, whose standard error may have no traceback; the console of the
browser may have no error and no warning. Requests go to 127.0.0.1 only.
"""

import argparse
import asyncio
import json
import subprocess
import sys
import time
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile

from playwright.sync_api import Page
from tornado.httpclient import AsyncHTTPClient

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.benchmarks.bench_browser import chromium, is_wanted, opened, server
from tests.benchmarks.clicking import Pace, Record, keep_fitting, listen_to, use, use_page
from tests.benchmarks.load_report import (
    report_errors,
    report_heading,
    report_memory,
    report_seconds,
)
from tests.benchmarks.machine import (
    cpu_model,
    memory_mb,
    processor_seconds,
    usable_cores,
    write,
)
from tests.benchmarks.page_client import PageClient, PageError

_ORBIT = "?view=orbit&orbit=0"
_IN_TIME = 1.5
_WHOLE = 15.0
_PATIENCE_OF_MANY = 120.0
_MORE_MB = 20.0
# Pages that others disturb, or do not.
_FEW = 3
# How often a soak looks at the memory after its first minutes.
_TIMES = 10
# After so long the server has ended the session of a page that was closed, and given memory back.
_FORGOTTEN_SECONDS = 45
# Pages that are opened and closed before any is counted; of those that are, one in so many is
# closed when its figures are drawn, and the others as soon as they are there.
_FIRST, _ONE_IN = 6, 4
# What is no message, no message that there is, and a message about nothing.
_WRONG = ("x", '{"msgtype": "no such message"}', "[" * 10_000, '{"msgid": 1}', "\x00")


@dataclass
class Scene:
    """One part: a server, what is found, and how long and how much."""

    address: str
    process: int
    record: Record
    asked: argparse.Namespace


Part = Callable[[Scene], None]


def main() -> None:
    asked = parse_arguments()
    write(f"{cpu_model()}, {usable_cores()} cores; {asked.pause:g} s between actions")
    report_heading()
    for name, part in PARTS.items():
        if not is_wanted(name, asked.only):
            continue
        with TemporaryFile("w+") as said, server(asked.survey, errors=said) as one:
            scene = Scene(one.address, one.process, Record(), asked)
            part(scene)
            said.seek(0)
            report_errors(scene.record.errors, said.read())


def sessions(scene: Scene) -> None:
    """Click on ten pages while fits run."""
    _click(scene, scene.asked.sessions, 60 * scene.asked.minutes, with_fits=not scene.asked.no_fits)
    _report_actions(scene, "sessions")
    write(f"    {scene.record.fits} fits with svi ended meanwhile")


def opening(scene: Scene) -> None:
    """Open twenty pages at the same moment."""
    whole: list[float] = []

    async def open_all() -> None:
        first = await _opened(scene, _ORBIT)
        n_figures = first.count("Plot")
        await first.close()
        used = processor_seconds(scene.process)
        pages = await asyncio.gather(
            *(open_one(n_figures) for _ in range(scene.asked.opening)), return_exceptions=True
        )
        used = processor_seconds(scene.process) - used
        write(f"    the server's process took {used:.1f} s of a core for that")
        for page in pages:
            if isinstance(page, PageClient):
                await page.close()
            else:
                scene.record.errors.append(f"opening: {page}")

    async def open_one(n_figures: int) -> PageClient:
        begin = time.perf_counter()
        page = PageClient(scene.address, _ORBIT)
        await page.open(with_files=True)
        await page.ready(n_figures, _PATIENCE_OF_MANY)
        whole.append(page.last_drawing - begin)
        return page

    # A browser has six connections of its own.
    AsyncHTTPClient.configure(None, max_clients=6 * scene.asked.opening)
    asyncio.run(open_all())
    report_seconds(f"opening: {scene.asked.opening} at once, whole", whole, f"{_WHOLE:g} s")


def soak(scene: Scene) -> None:
    """Click for an hour; compare the memory at the end with that after the first minutes."""
    seconds = 60 * scene.asked.soak_minutes
    first = min(300.0, seconds / 4)
    memory: list[float] = []

    async def watch() -> None:
        for duration in (first, *_TIMES * [(seconds - first) / _TIMES]):
            await asyncio.sleep(duration)
            memory.append(memory_mb(scene.process))

    async def come_and_go(pace: Pace) -> None:
        while not pace.is_over:
            try:
                page = await _opened(scene, _ORBIT)
                await asyncio.sleep(pace.look)
                await page.close()
            except PageError as error:
                scene.record.errors.append(f"opened and closed: {error}")
            await asyncio.sleep(20.0)

    _click(
        scene,
        scene.asked.sessions,
        seconds,
        others=lambda pace: [watch(), come_and_go(pace)],
    )
    _report_actions(scene, "soak")
    report_memory("soak: memory after the first minutes", memory[0], "")
    report_memory("soak: memory at the end", memory[-1], "the same")
    write(f"    in equal steps between: {', '.join(f'{one:.0f}' for one in memory[1:-1])} MB")


def closed(scene: Scene) -> None:
    """Open and close 200 pages; see what memory they leave."""

    async def open_and_close() -> tuple[float, float]:
        for _ in range(_FIRST):
            await (await _opened(scene, _ORBIT)).close()
        await asyncio.sleep(_FORGOTTEN_SECONDS)
        before = most = memory_mb(scene.process)
        for number in range(scene.asked.closed):
            page = await _open_patiently(scene)
            if number % _ONE_IN == 0:
                await page.ready()
            most = max(most, memory_mb(scene.process))
            await page.close()
        await asyncio.sleep(_FORGOTTEN_SECONDS)
        return most - before, memory_mb(scene.process) - before

    most, left = asyncio.run(open_and_close())
    report_memory(f"closed: {scene.asked.closed} pages, most meanwhile", most, "")
    report_memory(f"closed: {_FORGOTTEN_SECONDS} s after the last", left, f"{_MORE_MB:g} MB")


def gets(scene: Scene) -> None:
    """Request the page 500 times; see what memory that leaves."""

    async def ask() -> float:
        await (await _opened(scene, _ORBIT)).close()
        client = AsyncHTTPClient()
        before = memory_mb(scene.process)
        for _ in range(scene.asked.gets):
            answer = await client.fetch(scene.address, raise_error=False)
            if answer.code != 200:
                scene.record.errors.append(f"GET: status {answer.code}")
        return memory_mb(scene.process) - before

    more = asyncio.run(ask())
    report_memory(f"gets: {scene.asked.gets} requests of the page", more, f"{_MORE_MB:g} MB")


def few(scene: Scene) -> None:
    """Click on a few pages that nobody disturbs."""
    _click(scene, _FEW, scene.asked.seconds)
    _report_actions(scene, "few")


def flood(scene: Scene) -> None:
    """Click on a few pages while another client sends as many requests as it can."""
    script = str(Path(__file__).with_name("flood.py"))
    seconds = scene.asked.seconds
    limits = ["--requests", str(scene.asked.flood), "--seconds", str(seconds)]

    @contextmanager
    def flooded() -> Iterator[None]:
        command = [sys.executable, script, scene.address, *limits]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        yield
        answers = json.loads(process.communicate(timeout=seconds + 60)[0])
        texts = ", ".join(f"{many:,} times {status}" for status, many in answers.items())
        write(f"    the flood was answered {texts}")

    _click(scene, _FEW, seconds, meanwhile=flooded)
    _report_actions(scene, "flood")


def malformed(scene: Scene) -> None:
    """Click on a few pages while a client sends messages that are wrong."""
    counts = {"sent": 0, "connections": 0, "refused": 0}

    async def harm() -> None:
        most = scene.asked.malformed
        while counts["sent"] < most and counts["refused"] < 20:
            page = PageClient(scene.address)
            try:
                await page.open()
                counts["connections"] += 1
                while counts["sent"] < most:
                    await page.send_text(_WRONG[counts["connections"] % len(_WRONG)])
                    counts["sent"] += 1
            except PageError:
                # Its connection was ended, or another one refused.
                counts["refused"] += page.is_unopened
                await asyncio.sleep(0.1)
            await page.close()

    _click(scene, _FEW, scene.asked.seconds, others=lambda _: [harm()])
    _report_actions(scene, "malformed")
    write(f"    {', '.join(f'{many:,} {what}' for what, many in counts.items())}")


PARTS: dict[str, Part] = {
    "sessions": sessions,
    "opening": opening,
    "soak": soak,
    "closed": closed,
    "gets": gets,
    "few": few,
    "flood": flood,
    "malformed": malformed,
}


def _click(
    scene: Scene,
    n_pages: int,
    seconds: float,
    *,
    with_fits: bool = False,
    others: Callable[[Pace], list[Awaitable]] = lambda _: [],
    meanwhile: Callable = nullcontext,
) -> None:
    """Let people click for some seconds, one of them in Chromium unless it is left out.

    Parameters
    ----------
    others : what else is done over the network meanwhile
    meanwhile : makes the context of it all
    """
    n_browsers = 0 if scene.asked.no_browser else 1
    record, pace = scene.record, Pace(0.0, scene.asked.pause)

    async def clients() -> None:
        pages = [await _opened(scene, _ORBIT) for _ in range(n_pages - n_browsers)]
        fits = [await _opened(scene, _ORBIT)] if with_fits else []
        is_open.set_result(None)
        while not pace.end:
            await asyncio.sleep(0.05)
        await asyncio.gather(
            *(use(page, number, pace, record) for number, page in enumerate(pages)),
            *(keep_fitting(page, pace, record) for page in fits),
            *others(pace),
        )
        for page in pages + fits:
            await page.close()

    with ThreadPoolExecutor(1) as thread, chromium() as open_page:
        is_open = Future[None]()
        running = thread.submit(asyncio.run, clients())
        try:
            page = _page(scene, open_page) if n_browsers else None
            wait([running, is_open], return_when=FIRST_COMPLETED)
        finally:
            # Without it, the clients would wait for ever.
            pace.end = time.monotonic() + seconds
        with meanwhile():
            if page is not None and not running.done():
                use_page(page, pace, record)
            running.result()


def _page(scene: Scene, open_page: Callable[[], Page]) -> Page:
    page = open_page()
    listen_to(page, scene.record.errors)
    opened(page, f"{scene.address}{_ORBIT}&field=0&plates=0-0&detector=0")
    page.wait_for_timeout(5000)
    return page


async def _opened(scene: Scene, query: str) -> PageClient:
    """Return a page that has drawn its figures; one that does not is closed."""
    page = PageClient(scene.address, query)
    try:
        await page.open()
        await page.ready()
    except PageError:
        await page.close()
        raise
    return page


async def _open_patiently(scene: Scene) -> PageClient:
    """Return a page, opened as soon as the server allows."""
    for _ in range(60):
        try:
            return await PageClient(scene.address, _ORBIT).open()
        except PageError as error:
            if "429" not in str(error):
                raise
            await asyncio.sleep(1.0)
    raise PageError("refused for a minute")


def _report_actions(scene: Scene, part: str) -> None:
    record = scene.record
    for name in sorted(record.seconds):
        report_seconds(f"{part}: {name}", record.seconds[name], "")
    report_seconds(f"{part}: all actions", record.all_seconds, f"{_IN_TIME:g} s")


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Try a dashboard with many people.")
    parser.add_argument("survey", type=Path, metavar="DIR", help="a survey with a run")
    parser.add_argument("--only", nargs="+", default=[], metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--sessions", type=int, default=10, help="pages of sessions and soak")
    parser.add_argument("--minutes", type=float, default=10.0, help="of sessions")
    parser.add_argument("--opening", type=int, default=20, help="pages opened at once")
    parser.add_argument("--soak-minutes", type=float, default=60.0)
    parser.add_argument("--closed", type=int, default=200, help="pages opened and closed")
    parser.add_argument("--gets", type=int, default=500, help="requests of the page")
    parser.add_argument("--flood", type=int, default=20_000, help="most requests of the flood")
    parser.add_argument("--malformed", type=int, default=1000, help="messages that are wrong")
    parser.add_argument("--seconds", type=float, default=60.0, help="of few, flood and malformed")
    parser.add_argument("--pause", type=float, default=3.0, help="seconds between actions")
    parser.add_argument("--no-fits", action="store_true", help="sessions without fits with svi")
    parser.add_argument("--no-browser", action="store_true", help="without a page in Chromium")
    return parser.parse_args()


if __name__ == "__main__":
    main()
