"""Time what a person waits for in the dashboard, in headless Chromium.

    python tests/benchmarks/bench_browser.py DIR [--repeat 20]

DIR is a survey with a run, such as `plateviz simulate DIR && plateviz survey DIR` make. The script
serves it, and times each action in the browser: from the event that a person causes to the first
picture of the screen on which the answer is complete. It prints the median and the 95th percentile
in milliseconds, with the time of ten million additions in Python, which tells how fast and how
quiet the machine was.
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

from playwright.sync_api import Page, sync_playwright

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.benchmarks.machine import cpu_model, usable_cores, write

_FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"]
_SIZE = {"width": 1920, "height": 1080}
_PATIENCE_MS = 120_000
# More columns of the residuals than the server keeps in memory.
_PAIRS = (
    "nx",
    "residual_y",
    "ny",
    "leverage",
    "focal_x",
    "residual_x",
    "ideal_x",
    "standardised_x",
    "focal_y",
    "standardised_y",
    "ideal_y",
    "sx",
    "model_x",
    "sy",
)
# Functions of the page: what is drawn in a card, and whether it is complete.
_PRELUDE = """
window.plateviz = (() => {
  const views = () => {
    const found = [];
    const walk = view => { found.push(view); (view.child_views ?? []).forEach(walk); };
    for (const view of Bokeh.index) walk(view);
    return found;
  };
  const card = view => {
    for (let e = view.el; e; e = e.parentElement ?? e.getRootNode().host)
      for (const name of e.classList ?? []) if (name.startsWith('figure-')) return name.slice(7);
  };
  const isOnScreen = view => {
    const box = view.el.getBoundingClientRect();
    return box.width > 0 && box.bottom > 0 && box.top < innerHeight
      && view.el.checkVisibility({ visibilityProperty: true });
  };
  const plots = () => views().filter(view => view.model.type === 'Plot' && isOnScreen(view));
  const total = column => Array.from(column).reduce(
    (sum, value, i) => typeof value === 'number' && isFinite(value) ? sum + (1 + i % 7) * value
      : ArrayBuffer.isView(value) || Array.isArray(value) ? sum + total(value) : sum, 0);
  // What the figures on the screen show, as a text that differs for other solutions.
  const shown = () => plots().map(view => [card(view), ...view.model.renderers.map(renderer => {
    const data = renderer.data_source?.data ?? {};
    const columns = data instanceof Map ? [...data.values()] : Object.values(data);
    return columns.map(column => `${column.length} ${total(column)}`).join();
  })].join(';'));
  // Which sources are selected, for each figure on the screen that shows sources.
  const selected = () => plots().map(view => [card(view), ...view.model.renderers
    .map(renderer => renderer.data_source)
    .filter(source => source.data.id ?? source.data.get?.('id'))
    .map(source => `${source.selected.indices.length} ${total(source.selected.indices)}`)].join())
    .filter(row => row.includes(','));
  const texts = () => {
    const found = [];
    const walk = root => {
      for (const e of root.querySelectorAll('*')) {
        if (e.matches('.solution, .strip')) found.push(e.textContent);
        if (e.shadowRoot) walk(e.shadowRoot);
      }
    };
    walk(document);
    return found.join();
  };
  // Resolve with the milliseconds until `isDone`, and one more picture, have passed.
  const until = isDone => new Promise(resolve => {
    const begin = performance.now();
    const look = () => isDone()
      ? requestAnimationFrame(() => resolve(performance.now() - begin))
      : requestAnimationFrame(look);
    look();
  });
  return { plots, card, shown, selected, texts, until };
})();
"""


def main() -> None:
    arguments = parse_arguments()
    with served(arguments.survey) as address, chromium() as open_page:
        write(f"{cpu_model()}, {usable_cores()} cores; ten million additions {additions():.2f} s")
        write(f"{'from':<34}{'to':<34}{'median':>9}{'95 %':>9}{'n':>5}")
        opened(open_page(), f"{address}?view=orbit&orbit=0")
        times = []
        for _ in range(arguments.repeat):
            page = open_page()
            times.append(opened(page, f"{address}?view=orbit&orbit=0"))
            page.close()
        report("a warm server's address", "first useful picture", times)
        page = open_page()
        opened(page, f"{address}?view=orbit&orbit=0&field=0&plates=0-0&detector=0")
        page.wait_for_timeout(5000)
        for start, end, act in (
            ("exposure", "residual map", next_exposure),
            ("what-if: another order", "strip and all visible figures", next_order),
            ("a box of sources", "selected in all visible figures", next_selection),
            ("what-if: these left out", "strip and all visible figures", leave_out),
            ("another orbit", "strip and all visible figures", next_orbit),
        ):
            # The first answer is not counted: the solver may have to fit the orbit for it.
            times = [act(page, number) for number in range(arguments.repeat + 1)]
            report(start, end, times[1:])
        page.close()
        page = open_page()
        opened(page, f"{address}?view=survey&workspace=explore&rows=residuals")
        page.wait_for_timeout(3000)
        for start, act in (
            ("pan or zoom over all residuals", next_zoom),
            ("another pair of columns of these", next_pair),
        ):
            times = [act(page, number) for number in range(arguments.repeat + 1)]
            report(start, "new picture", times[1:])


def next_exposure(page: Page, number: int) -> float:
    """Select the next exposure; return the milliseconds until the residual map shows it."""
    thumb = page.get_by_role("slider", name="Exposures of the field").last
    thumb.focus()
    return answered(page, lambda: thumb.press("ArrowRight"), {"residual-map"}, words=False)


def next_order(page: Page, number: int) -> float:
    """Change the order of the distortion; return the milliseconds until everything shows it."""
    slider = page.get_by_role("slider", name="Distortion order")
    slider.focus()
    key = "ArrowLeft" if number % 2 == 0 else "ArrowRight"
    return answered(page, lambda: slider.press(key), None, words=True)


def next_selection(page: Page, number: int) -> float:
    """Drag a box across the residual map; return the milliseconds until all figures show it."""
    box = page.locator(".figure-residual-map:visible canvas").first.bounding_box()
    if box is None:
        raise RuntimeError("expected a residual map on the screen")
    # Boxes of different sizes, so that every figure has other sources of them.
    last = 0.5 + 0.02 * (number % 5)
    places = [
        (box["x"] + share * box["width"], box["y"] + share * box["height"])
        for share in (0.35, last)
    ]
    page.mouse.move(*places[0])
    page.mouse.down()
    page.mouse.move(*places[1], steps=5)
    page.evaluate(
        """() => {
          const { selected, until } = window.plateviz;
          const before = selected();
          window.answer = until(() => selected().every(row => !before.includes(row)));
        }"""
    )
    begin = time.perf_counter()
    page.mouse.up()
    page.evaluate("() => window.answer")
    taken = 1e3 * (time.perf_counter() - begin)
    page.wait_for_timeout(1000)
    return taken


def leave_out(page: Page, number: int) -> float:
    """Leave a selection out of the fit; return the milliseconds until everything shows it."""
    next_selection(page, number)
    button = page.get_by_role("button", name="Leave out of the fit")
    taken = answered(page, button.click, None, words=True)
    page.get_by_role("button", name="Put back into the fit").click()
    page.get_by_role("button", name="Leave out of the fit").wait_for()
    page.wait_for_timeout(3000)
    return taken


def next_orbit(page: Page, number: int) -> float:
    """Choose another orbit; return the milliseconds until everything shows it."""
    box = page.get_by_role("combobox", name="Orbit", exact=True)
    box.focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown" if number % 2 == 0 else "ArrowUp")
    return answered(page, lambda: page.keyboard.press("Enter"), None, words=True)


def next_zoom(page: Page, number: int) -> float:
    """Turn the wheel over all residuals; return the milliseconds until the cells are finer."""
    box = page.locator(".figure-explore:visible canvas").first.bounding_box()
    if box is None:
        raise RuntimeError("expected a figure on the screen")
    # In at different places, so that the frame moves too, and out again.
    is_in = number % 2 == 0
    across = 0.3 + 0.1 * (number % 5)
    page.mouse.move(box["x"] + across * box["width"], box["y"] + 0.5 * box["height"])
    return answered(page, lambda: page.mouse.wheel(0, -150 if is_in else 150), {"explore"}, False)


def next_pair(page: Page, number: int) -> float:
    """Choose two columns that are not in memory; return the milliseconds until they are drawn.

    Both controls change at once: a hand needs seconds for two lists.
    """
    x, y = (_PAIRS[(2 * number + one) % len(_PAIRS)] for one in (0, 1))
    begin = time.perf_counter()
    page.evaluate(
        """([x, y]) => {
          const { plots, card, until } = window.plateviz;
          for (const each of Bokeh.documents)
            for (const { data } of each._all_models.values())
              if (data?.options && ['x', 'y'].includes(data.label))
                data.value = data.label === 'x' ? x : y;
          return until(() => plots().some(
            view => card(view) === 'explore' && view.model.title.text === `${y} against ${x}`));
        }""",
        [x, y],
    )
    taken = 1e3 * (time.perf_counter() - begin)
    page.wait_for_timeout(1500)
    return taken


def answered(page: Page, act: Callable[[], object], cards: set[str] | None, words: bool) -> float:
    """Act, and return the milliseconds until figures and, if asked for, words are others.

    Parameters
    ----------
    cards : names of the figures that have to change; None for all of a solution on the screen
    """
    wanted = sorted(cards) if cards else None
    page.evaluate(
        """([wanted, words]) => {
          const { plots, card, shown, texts, until } = window.plateviz;
          const of = rows => rows.filter(row => !wanted || wanted.includes(row.split(';')[0]));
          const [before, text] = [of(shown()), texts()];
          window.answer = until(() => {
            const now = of(shown());
            return now.length > 0 && now.every(row => !before.includes(row))
              && (!words || texts() !== text);
          });
        }""",
        [wanted, words],
    )
    begin = time.perf_counter()
    act()
    page.evaluate("() => window.answer")
    taken = 1e3 * (time.perf_counter() - begin)
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


def report(start: str, end: str, milliseconds: list[float]) -> None:
    ordered = sorted(milliseconds)
    high = ordered[min(len(ordered) - 1, round(0.95 * len(ordered)))]
    median = statistics.median(ordered)
    write(f"{start:<34}{end:<34}{median:9.0f}{high:9.0f}{len(ordered):5}")


def additions() -> float:
    """Return the seconds of ten million additions."""
    begin, total = time.perf_counter(), 0
    for number in range(10**7):
        total += number
    return time.perf_counter() - begin


@contextmanager
def served(survey: Path) -> Iterator[str]:
    """Serve a survey; yield its address."""
    command = [sys.executable, "-m", "plateviz.cli.main", "serve", str(survey), "--port", "0"]
    process = subprocess.Popen([*command, "--no-open"], stdout=subprocess.PIPE, text=True)
    try:
        line = next(line for line in process.stdout or () if "http" in line)
        yield next(word for word in line.split() if word.startswith("http"))
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
            page.add_init_script(_PRELUDE)
            return page

        yield open_page
        browser.close()


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Time the dashboard in a browser.")
    parser.add_argument("survey", type=Path, metavar="DIR", help="a survey with a run")
    parser.add_argument("--repeat", type=int, default=20)
    return parser.parse_args()


if __name__ == "__main__":
    main()
