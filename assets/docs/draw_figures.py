"""Draw the example figures of the documents: each diagnostic of a good and of a bad solution.

    python assets/docs/draw_figures.py [NAME]...

The script simulates small orbits and surveys, introduces one defect at a time, fits them, and draws
with the application's own plots in Chromium. It writes PNG files into `figures` beside the pages,
and takes some minutes.
"""

import argparse
import io
import itertools
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from bokeh.embed import file_html
from bokeh.resources import INLINE
from figure_orbits import ORBITS
from figure_surveys import SOURCES, SURVEYS, Surveys, surveys
from PIL import Image
from playwright.sync_api import Page, sync_playwright

from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.figures.figure import Figure
from plateviz.plots.gallery import diagnostics, source_figures, survey_figures

FOLDER = Path(__file__).resolve().parent / "figures"
_FLAGS = ["--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
_IS_DRAWN = "() => window.Bokeh && Bokeh.documents.length && Bokeh.documents[0].is_idle"
_STYLE = "<style>body { margin: 0 } </style>"
KINDS = ("good", "bad")
MOST_BYTES = 60_000
# Widths in pixels, tried in turn until the file is small enough; a single panel has 550.
_WIDTHS = (1000, 800, 600)
_COLOURS = (128, 64, 32)


Draw = Callable[[], Figure]


def figures_drawn(made: Surveys) -> Iterator[tuple[str, str, Draw]]:
    """Yield name, kind ("good" or "bad") and plot function of every figure."""
    for found, cases in ((survey_figures(), SURVEYS), (source_figures(), SOURCES)):
        for figure in found:
            for kind, case in zip(KINDS, cases[figure.name], strict=True):
                yield figure.name, kind, lambda f=figure, c=case: f.plot(c(made))  # type: ignore[arg-type]
    for figure in diagnostics():
        for kind, chosen in zip(KINDS, ORBITS[figure.name], strict=True):
            yield figure.name, kind, lambda f=figure, c=chosen: f.plot(c())


def main() -> None:
    """Draw the figures that are named, or all of them."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="names of figures; all by default")
    names = parser.parse_args().names
    with _chromium() as page, surveys() as made, TemporaryDirectory() as folder:
        for name, kind, draw in figures_drawn(made):
            if not names or name in names:
                (FOLDER / f"{name}-{kind}.png").write_bytes(_shot(page, draw(), Path(folder)))


@contextmanager
def _chromium() -> Iterator[Page]:
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=_FLAGS)
        yield browser.new_page(viewport={"width": 1600, "height": 1400})
        browser.close()


def _shot(page: Page, figure: Figure, folder: Path) -> bytes:
    """Return a figure as a PNG of at most `MOST_BYTES`."""
    html = file_html(BokehFigure(figure, "light").model, INLINE, "figure")
    path = folder / "figure.html"
    path.write_text(html.replace("</head>", f"{_STYLE}</head>"), encoding="utf-8")
    page.goto(path.as_uri())
    page.wait_for_function(_IS_DRAWN)
    page.mouse.move(1599, 1399)
    taken = Image.open(io.BytesIO(page.locator("[data-root-id] > div").first.screenshot())).convert(
        "RGB"
    )
    return _small(taken)


def _small(image: Image.Image) -> bytes:
    """Return an image as PNG, with the most pixels and colours that `MOST_BYTES` allow."""
    for width, colours in itertools.product(_WIDTHS, _COLOURS):
        scale = min(1.0, width / image.width)
        size = round(image.width * scale), round(image.height * scale)
        scaled = image.resize(size, Image.Resampling.LANCZOS)
        content = io.BytesIO()
        few = scaled.quantize(colours, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
        few.save(content, "PNG", optimize=True)
        if content.tell() <= MOST_BYTES:
            break
    return content.getvalue()


if __name__ == "__main__":
    main()
