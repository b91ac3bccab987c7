"""Double-logarithmic line charts as SVG, for light and dark pages.

The chart has its own background, which follows the reader's colour scheme like its text.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple
from xml.etree import ElementTree as ET

WIDTH, HEIGHT = 960, 470
LEFT, RIGHT, TOP, BOTTOM = 62, 22, 84, 58
GAP = 40
# Colours with similar contrast on white and on black.
COLOURS = ("#768390", "#b08800", "#2f81f7", "#e5534b", "#2da44e", "#a371f7", "#d9730d")
STYLE = """
svg { font: 14px system-ui, sans-serif; }
.card { fill: #ffffff; }
text { fill: #1f2328; }
.grid { stroke: #d0d7de; stroke-width: 1; }
.line { fill: none; stroke-width: 2; }
@media (prefers-color-scheme: dark) {
  .card { fill: #0d1117; }
  text { fill: #e6edf3; }
  .grid { stroke: #30363d; }
}
"""

Line = Sequence[tuple[float, float]]


class Panel(NamedTuple):
    """One pair of axes: title, label of the horizontal axis, and points of each line."""

    title: str
    axis: str
    lines: Mapping[str, Line]


class _Scale(NamedTuple):
    """Logarithmic scale from values `low` to `high` to pixels `start` to `end`."""

    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
        fraction = math.log(value / self.low) / math.log(self.high / self.low)
        return round(self.start + fraction * (self.end - self.start), 1)


def draw(panels: Sequence[Panel], unit: str) -> str:
    """Return the panels side by side, with one vertical axis and one legend."""
    root = ET.Element("svg", xmlns="http://www.w3.org/2000/svg", viewBox=f"0 0 {WIDTH} {HEIGHT}")
    ET.SubElement(root, "style").text = STYLE
    _add(root, "rect", width=WIDTH, height=HEIGHT, rx=8, **{"class": "card"})
    values = [y for panel in panels for line in panel.lines.values() for _, y in line]
    decades = _decades(min(values), max(values))
    vertical = _Scale(decades[0], decades[-1], HEIGHT - BOTTOM, TOP)
    _legend(root, list(panels[0].lines))
    width = (WIDTH - LEFT - RIGHT - GAP * (len(panels) - 1)) / len(panels)
    for number, panel in enumerate(panels):
        start = LEFT + number * (width + GAP)
        _panel(root, panel, (start, start + width), vertical, decades)
    for value in decades:
        _text(root, LEFT - 8, vertical(value) + 5, f"{value:g}", "end")
    _text(root, 16, TOP - 14, unit, "start")
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _panel(
    root: ET.Element,
    panel: Panel,
    edges: tuple[float, float],
    vertical: _Scale,
    decades: Iterable[float],
) -> None:
    positions = sorted({x for line in panel.lines.values() for x, _ in line})
    # Leave a margin on both sides.
    horizontal = _Scale(positions[0] / 1.15, positions[-1] * 1.15, *edges)
    for value in decades:
        _add_line(root, [(edges[0], vertical(value)), (edges[1], vertical(value))], "grid")
    for value in positions:
        x = horizontal(value)
        _add_line(root, [(x, vertical.start), (x, vertical.end)], "grid")
        _text(root, x, HEIGHT - BOTTOM + 20, _short(value), "middle")
    _text(root, sum(edges) / 2, HEIGHT - 12, panel.axis, "middle")
    _text(root, sum(edges) / 2, TOP - 14, panel.title, "middle")
    for colour, line in zip(COLOURS, panel.lines.values(), strict=False):
        points = [(horizontal(x), vertical(y)) for x, y in line]
        _add_line(root, points, "line", stroke=colour)
        for x, y in points:
            _add(root, "circle", cx=x, cy=y, r=3.5, fill=colour)


def _legend(root: ET.Element, names: list[str]) -> None:
    step = (WIDTH - LEFT - RIGHT) / len(names)
    for number, (name, colour) in enumerate(zip(names, COLOURS, strict=False)):
        x = LEFT + number * step
        _add(root, "circle", cx=x, cy=28, r=5, fill=colour)
        _text(root, x + 12, 33, name, "start")


def _decades(low: float, high: float) -> list[float]:
    return [10.0**n for n in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)]


def _short(value: float) -> str:
    """Return an abbreviated number: 3M, 9.4k, 248k, 96."""
    for size, letter in ((1e6, "M"), (1e3, "k")):
        if value >= size:
            digits = 1 if value < 9.95 * size else 0
            return f"{value / size:.{digits}f}".removesuffix(".0") + letter
    return f"{value:g}"


def _add_line(root: ET.Element, points: Line, kind: str, **attributes: str) -> None:
    positions = " ".join(f"{x:g},{y:g}" for x, y in points)
    _add(root, "polyline", points=positions, **{"class": kind}, **attributes)


def _text(root: ET.Element, x: float, y: float, content: str, anchor: str) -> None:
    element = ET.SubElement(root, "text", {"x": f"{x:g}", "y": f"{y:g}", "text-anchor": anchor})
    element.text = content


def _add(root: ET.Element, tag: str, **attributes: object) -> None:
    ET.SubElement(root, tag, {name: str(value) for name, value in attributes.items()})
