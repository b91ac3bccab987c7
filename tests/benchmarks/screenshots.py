r"""Take a screenshot of every workspace of the dashboard, in both themes and three sizes.

    python tests/benchmarks/screenshots.py DIR OUTPUT [--source ID | --readme]

DIR is a survey with a run, such as `plateviz simulate DIR && plateviz survey DIR` make. OUTPUT gets
one PNG each, such as `orbit-sky-dark-1366x768.png`, and is made if it is not there. With --readme
it gets the picture of README.md only, `orbit-page.png`, whose survey has a defect:

    plateviz simulate DIR --orbits 2 --stars 40000 --seed 2 \
        --defect distortion-drift=0.3um --magnitudes
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page

# Import this checkout, whatever the working directory.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from plateviz.plots.workspace import OrbitWorkspace, SourceWorkspace, SurveyWorkspace
from tests.benchmarks.bench_browser import chromium, served
from tests.benchmarks.machine import write

_SIZES = ((1920, 1080), (1366, 768), (768, 1024))
# Background of the figures in a theme, and how long the server has sent nothing to a whole page.
_BACKGROUNDS = {"light": "#ffffff", "dark": "#121212"}
_QUIET_MS = 700
# A page whose orbit has to be fitted first is the slowest.
_PATIENCE_MS = 120_000
_README_SIZE = {"width": 1600, "height": 1000}


def main() -> None:
    arguments = parse_arguments()
    arguments.output.mkdir(parents=True, exist_ok=True)
    with served(arguments.survey) as address, chromium() as open_page:
        if arguments.readme:
            take_readme(open_page(), address, arguments.output / "orbit-page.png")
            return
        for width, height in _SIZES:
            # One page for all, which loads scripts and fonts once: the server limits requests.
            page = open_page()
            page.set_viewport_size({"width": width, "height": height})
            for name, query in queries(arguments.source):
                page.goto(f"{address}?{query}")
                for theme in ("light", "dark"):
                    take(page, arguments.output / f"{name}-{theme}-{width}x{height}.png", theme)
            page.close()


def queries(source: str | None) -> Iterator[tuple[str, str]]:
    """Iterate over the name and the address of each workspace."""
    for view, workspaces, more in (
        ("survey", SurveyWorkspace, ""),
        ("orbit", OrbitWorkspace, "&orbit=0"),
        ("source", SourceWorkspace if source else (), f"&source={source}"),
    ):
        for workspace in workspaces:
            name = f"{view}-{workspace.value}"
            yield name, f"view={view}&workspace={workspace.value}{more}"


def take(page: Page, path: Path, theme: str) -> None:
    """Write a screenshot in a theme; a page begins in the light one."""
    if theme == "dark":
        page.get_by_label("Toggle theme").click()
        page.mouse.move(0, 0)
    wait_until_whole(page, theme)
    page.screenshot(path=path)
    write(str(path))


def wait_until_whole(page: Page, theme: str) -> None:
    """Wait until all that is in view is drawn in a theme."""
    page.wait_for_function(
        "([background, quiet]) => window.plateviz.isWhole(background, quiet)",
        arg=[_BACKGROUNDS[theme], _QUIET_MS],
        timeout=_PATIENCE_MS,
        polling=100,
    )


def take_readme(page: Page, address: str, path: Path) -> None:
    """Write the picture of README.md: a solution with a flaw, its cause and the remedy."""
    page.set_viewport_size(_README_SIZE)
    page.goto(f"{address}?view=orbit&workspace=verdict&orbit=0")
    page.get_by_role("button", name="Try it").wait_for(timeout=_PATIENCE_MS)
    take(page, path, "light")
    Image.open(path).convert("RGB").quantize().save(path, optimize=True)


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Take a screenshot of every workspace.")
    parser.add_argument("survey", type=Path, metavar="DIR", help="a survey with a run")
    parser.add_argument("output", type=Path, metavar="OUTPUT", help="directory of the screenshots")
    parser.add_argument("--source", metavar="ID", help="source whose page is shown, too")
    parser.add_argument("--readme", action="store_true", help="take the picture of README.md only")
    return parser.parse_args()


if __name__ == "__main__":
    main()
