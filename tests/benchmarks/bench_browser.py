"""Time what a person waits for in the dashboard, in headless Chromium.

    python tests/benchmarks/bench_browser.py DIR [--repeat 20] [--only WORD...] [--stages]

DIR is a survey with a run, such as `plateviz simulate DIR && plateviz survey DIR` make. The script
serves it, and times each action in the browser: from the event that a person causes to the first
picture of the screen on which the answer is complete. It prints the median and the 95th percentile
in milliseconds, with the time of ten million additions in Python, which tells how fast and how
quiet the machine was. No what-if is asked twice, so that none is answered from memory. With
`--stages` it also prints where the time of each action goes, as `timed_server.py` notes it.
"""

import argparse
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple, TextIO

from playwright.sync_api import Locator, Page, sync_playwright

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from plateviz.runs.run import survey_runs
from tests.benchmarks.action_stages import report_stages
from tests.benchmarks.machine import cpu_model, usable_cores, write

_FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"]
_SIZE = {"width": 1920, "height": 1080}
_PATIENCE_MS = 20_000
_PROBE = (Path(__file__).parent / "page_probe.js").read_text(encoding="utf-8")
_ORBIT = "?view=orbit&orbit=0&field=0&plates=0-0&detector=0"
_ADDRESS = "a warm server's address"
# Visits after which a browser has kept what it has compiled of the page.
_FIRST_VISITS = 3
# Time in which all other figures of a page are drawn, so that the next visit finds the server idle.
_VISIT_MS = 3000
# Between two keys of a person who types.
_KEY_MS = 200
# Exposures that are turned to in one direction; a field has 24.
_TURNS = 20
# Sources in the box that is drawn in the footprint.
_MANY = 1000
_ALL_NEW = "strip and all visible figures"
_EXPLORE = "?view=survey&workspace=explore&rows=measurements"
# More columns of the residuals than the server keeps in memory.
_COLUMNS = (
    *("nx", "residual_y", "ny", "leverage", "focal_x", "residual_x", "ideal_x"),
    *("standardised_x", "focal_y", "standardised_y", "ideal_y", "sx", "model_x", "sy"),
)


class Taken(NamedTuple):
    """When a person acted, and when the answer was complete: milliseconds since 1970."""

    begin: float
    end: float


class Action(NamedTuple):
    """What a person does on the page at an address, and what is to come of it."""

    start: str
    end: str
    address: str
    act: Callable[[Page, int], Taken]


def main() -> None:
    arguments = parse_arguments()
    with (
        TemporaryDirectory() as folder,
        served(arguments.survey, Path(folder) / "stages" if arguments.stages else None) as address,
        chromium() as open_page,
    ):
        write(f"{cpu_model()}, {usable_cores()} cores; ten million additions {additions():.2f} s")
        write(f"{'from':<36}{'to':<34}{'median':>9}{'95 %':>9}{'n':>5}")
        visited(open_page(), f"{address}?view=orbit&orbit=0")
        if is_wanted(_ADDRESS, arguments.only):
            times = []
            for _ in range(arguments.repeat):
                page = open_page()
                times.append(visited(page, f"{address}?view=orbit&orbit=0"))
                page.close()
            report(_ADDRESS, "first useful picture", times)
            page = open_page()
            visits = _FIRST_VISITS + arguments.repeat
            times = [visited(page, f"{address}?view=orbit&orbit=0") for _ in range(visits)]
            report(_ADDRESS, "the same, known to the browser", times[_FIRST_VISITS:])
            page.close()
        for action in actions(arguments.survey):
            if not is_wanted(action.start, arguments.only):
                continue
            page = open_page()
            opened(page, f"{address}{action.address}")
            page.wait_for_timeout(5000)
            # The first answer is not counted: the solver may have to fit the orbit for it.
            taken = [action.act(page, number) for number in range(arguments.repeat + 1)][1:]
            report(action.start, action.end, [one.end - one.begin for one in taken])
            if arguments.stages:
                messages = page.evaluate("() => window.plateviz.messages")
                report_stages(Path(folder) / "stages", taken, messages)
            page.close()


def actions(survey: Path) -> list[Action]:
    """Return the rows of the table but the first, which opens pages."""
    run, *_ = survey_runs(survey)
    sources = run.counts().sort_values("n_orbits", ascending=False)["source_id"].tolist()

    def next_source(page: Page, number: int) -> Taken:
        entry = page.get_by_role("textbox", name="Source id")
        entry.fill(str(sources[1 + number]))
        return answered(page, lambda: entry.press("Enter"))

    first_source = f"?view=source&source={sources[0]}"
    return [
        Action("exposure or detector", "residual map", _ORBIT, next_exposure_or_detector),
        Action("what-if: another order", _ALL_NEW, _ORBIT, next_order),
        Action("what-if: another prior", _ALL_NEW, _ORBIT, next_prior),
        Action(f"a box of {_MANY:,} sources", "selected in all figures", _ORBIT, next_selection),
        Action("what-if: a corner left out", _ALL_NEW, _ORBIT, leave_out),
        Action("another orbit", _ALL_NEW, _ORBIT, next_orbit),
        Action("another source", "its page whole", first_source, next_source),
        Action("zoom over all residuals", "new picture", _EXPLORE, next_zoom),
        Action("another pair of their columns", "new picture", _EXPLORE, next_pair),
    ]


def next_exposure_or_detector(page: Page, number: int) -> Taken:
    """Select the next exposure, to and fro, or another detector."""
    if number % 2:
        # The first option is all detectors.
        detector = unfolded(page, "Detector").nth(1 + (number + 1) // 2 % 4)
        return answered(page, detector.click, "residual-map", words=False)
    thumb = page.get_by_role("slider", name="Exposures of the field").last
    thumb.focus()
    key = "ArrowRight" if number // 2 // _TURNS % 2 == 0 else "ArrowLeft"
    return answered(page, lambda: thumb.press(key), "residual-map", words=False)


def next_order(page: Page, number: int) -> Taken:
    """Change the order of the distortion, under a prior that no what-if has had."""
    next_prior(page, number, least=1.2)
    slider = page.get_by_role("slider", name="Distortion order")
    slider.focus()
    return answered(page, lambda: slider.press("ArrowLeft" if number % 2 == 0 else "ArrowRight"))


def next_prior(page: Page, number: int, least: float = 2.0) -> Taken:
    """Change the width of the sources' prior to a factor that grows from `least`."""
    entry = page.get_by_role("textbox", name="source positions")
    if not entry.is_visible():
        page.get_by_role("button", name="show more: Priors").click()
    entry.fill("")
    entry.press_sequentially(f"{least + 0.02 * number:.2f}", delay=_KEY_MS)
    page.wait_for_timeout(_KEY_MS)
    return answered(page, lambda: entry.press("Enter"))


def next_selection(page: Page, number: int) -> Taken:
    """Drag a box across the footprint."""
    return select(page, "footprint", _MANY, number)


def select(page: Page, card: str, count: int, number: int) -> Taken:
    """Drag a box about some `count` sources of a figure, others for each number."""
    probe = "([card, count, row]) => window.plateviz.boxAround(card, count, row)"
    first, last = page.evaluate(probe, [card, count, 37 * number])
    page.mouse.move(first["x"], first["y"])
    page.mouse.down()
    page.mouse.move(last["x"], last["y"], steps=5)
    page.evaluate(
        """() => {
          const { agree, among, until } = window.plateviz;
          const before = `${among.selected.indices}`;
          window.answer = until(() => `${among.selected.indices}` !== before && agree(among));
        }"""
    )
    page.mouse.up()
    return finished(page)


def leave_out(page: Page, number: int) -> Taken:
    """Leave a selection out of the fit."""
    select(page, "residual-map", 40 + number, number)
    button = page.get_by_role("button", name="Leave out of the fit")
    taken = answered(page, button.click)
    page.get_by_role("button", name="Put back into the fit").click()
    button.wait_for()
    page.wait_for_timeout(3000)
    return taken


def next_orbit(page: Page, number: int) -> Taken:
    """Choose the next orbit, or after the last the first."""
    options = unfolded(page, "Orbit")
    return answered(page, options.nth((number + 1) % options.count()).click)


def next_zoom(page: Page, number: int) -> Taken:
    """Turn the wheel over all residuals; in at different places, so that the frame moves too."""
    box = page.locator(".figure-explore:visible canvas").first.bounding_box()
    if box is None:
        raise RuntimeError("expected a figure on the screen")
    across = 0.3 + 0.1 * (number % 5)
    page.mouse.move(box["x"] + across * box["width"], box["y"] + 0.5 * box["height"])
    turn = -150 if number % 2 == 0 else 150
    return answered(page, lambda: page.mouse.wheel(0, turn), "explore", words=False)


def next_pair(page: Page, number: int) -> Taken:
    """Choose two columns that are not in memory, at once: a hand needs seconds for two lists."""
    x, y = (_COLUMNS[(2 * number + one) % len(_COLUMNS)] for one in (0, 1))
    page.evaluate(
        """([x, y]) => {
          const { plots, until } = window.plateviz;
          const begin = performance.timeOrigin + performance.now();
          for (const each of Bokeh.documents)
            for (const { data } of each._all_models.values())
              if (data?.options && ["x", "y"].includes(data.label))
                data.value = data.label === "x" ? x : y;
          const isDrawn = one =>
            one.card === "explore" && one.model.title.text === `${y} against ${x}`;
          window.answer = until(() => plots().some(isDrawn)).then(([_, end]) => [begin, end]);
        }""",
        [x, y],
    )
    return finished(page)


def unfolded(page: Page, name: str) -> Locator:
    """Open the list of a control; return its options."""
    page.get_by_role("combobox", name=name, exact=True).click()
    options = page.locator(".MuiMenuItem-root")
    options.first.wait_for()
    page.wait_for_timeout(500)
    return options


def answered(
    page: Page, act: Callable[[], object], card: str | None = None, *, words: bool = True
) -> Taken:
    """Act, and wait until figures and, if asked for, words are others.

    Parameters
    ----------
    card : the figure that has to change; None for all of a solution on the screen
    """
    page.evaluate(
        """([wanted, words]) => {
          const { shown, texts, until } = window.plateviz;
          const of = rows => rows.filter(row => !wanted || wanted === row.split(';')[0]);
          const [before, text] = [of(shown()), texts()];
          window.answer = until(() => {
            const now = of(shown());
            return now.length > 0 && now.every(row => !before.includes(row))
              && (!words || texts() !== text);
          });
        }""",
        [card, words],
    )
    act()
    return finished(page)


def finished(page: Page) -> Taken:
    """Wait for the answer; let the page come to rest before the next action."""
    late = f"new Promise((_, fail) => setTimeout(fail, {_PATIENCE_MS}, 'no answer came'))"
    taken = Taken(*page.evaluate(f"() => Promise.race([window.answer, {late}])"))
    page.wait_for_timeout(1500)
    return taken


def opened(page: Page, address: str) -> float:
    """Open an address; return the milliseconds until the first figure shows something."""
    begin = time.perf_counter()
    page.goto(address, wait_until="commit")
    page.wait_for_function(
        "() => window.Bokeh?.index && window.plateviz.shown().some(row => row.length > 200)",
        timeout=_PATIENCE_MS,
        polling="raf",
    )
    return 1e3 * (time.perf_counter() - begin)


def visited(page: Page, address: str) -> float:
    """Open an address; return the milliseconds, once the server is done with the page."""
    taken = opened(page, address)
    page.wait_for_timeout(_VISIT_MS)
    return taken


def is_wanted(start: str, words: list[str]) -> bool:
    return not words or any(word in start for word in words)


def report(start: str, end: str, milliseconds: list[float]) -> None:
    ordered = sorted(milliseconds)
    high = ordered[min(len(ordered) - 1, round(0.95 * len(ordered)))]
    median = statistics.median(ordered)
    write(f"{start:<36}{end:<34}{median:9.0f}{high:9.0f}{len(ordered):5}")


def additions() -> float:
    """Return the seconds of ten million additions."""
    begin, total = time.perf_counter(), 0
    for number in range(10**7):
        total += number
    return time.perf_counter() - begin


class Server(NamedTuple):
    """The address of a server, and the id of its process."""

    address: str
    process: int


@contextmanager
def served(survey: Path, stages: Path | None = None) -> Iterator[str]:
    """Serve a survey; yield its address.

    Parameters
    ----------
    stages : file to which the server writes when stages of its work begin and end
    """
    with server(survey, stages) as one:
        yield one.address


@contextmanager
def server(
    survey: Path, stages: Path | None = None, errors: TextIO | None = None
) -> Iterator[Server]:
    """Serve a survey.

    Parameters
    ----------
    stages : as for `served`
    errors : file to which the server's standard error goes
    """
    program = ["-m", "plateviz.cli.main"]
    if stages is not None:
        program = [str(Path(__file__).with_name("timed_server.py")), str(stages)]
    command = [sys.executable, *program, "serve", str(survey), "--port", "0", "--no-open"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True)
    try:
        line = next(line for line in process.stdout or () if "http" in line)
        yield Server(next(word for word in line.split() if word.startswith("http")), process.pid)
    finally:
        process.terminate()
        process.wait()


@contextmanager
def chromium() -> Iterator[Callable[[], Page]]:
    """Yield the function that opens an empty page."""
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=_FLAGS)

        def open_page() -> Page:
            page = browser.new_page(viewport=_SIZE)
            page.set_default_timeout(_PATIENCE_MS)
            page.add_init_script(_PROBE)
            return page

        yield open_page
        browser.close()


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Time the dashboard in a browser.")
    parser.add_argument("survey", type=Path, metavar="DIR", help="a survey with a run")
    parser.add_argument("--repeat", type=int, default=20)
    parser.add_argument("--only", nargs="+", default=[], metavar="WORD", help="rows with a word")
    parser.add_argument("--stages", action="store_true", help="where the time goes, too")
    return parser.parse_args()


if __name__ == "__main__":
    main()
