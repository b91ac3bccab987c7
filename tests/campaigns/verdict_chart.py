"""Chart of the verdict: the share of orbits seen and named against the amplitude, by defect."""

from collections.abc import Mapping, Sequence
from xml.etree import ElementTree as ET

from tests.benchmarks.chart import COLOURS, STYLE

_COLUMNS, _WIDTH, _HEIGHT = 4, 230, 150
_LEFT, _TOP, _RIGHT, _BOTTOM = 44, 34, 10, 26
_LEGEND = 40

# Shares against factors of the amplitude.
Line = Sequence[tuple[float, float]]


def draw(panels: Mapping[str, Mapping[str, Line]], factors: Sequence[float]) -> str:
    """Return the panels of all defects as SVG; each has the same lines.

    Parameters
    ----------
    panels : title -> name of the line -> points
    factors : of the amplitude, ascending; drawn at equal distances
    """
    rows = -(-len(panels) // _COLUMNS)
    width, height = _COLUMNS * _WIDTH + 20, rows * _HEIGHT + _LEGEND
    root = ET.Element("svg", xmlns="http://www.w3.org/2000/svg", viewBox=f"0 0 {width} {height}")
    ET.SubElement(root, "style").text = STYLE.replace("14px", "12px")
    _add(root, "rect", width=width, height=height, rx=8, **{"class": "card"})
    names = list(next(iter(panels.values()))) if panels else []
    for number, (name, colour) in enumerate(zip(names, COLOURS[2:], strict=False)):
        x = _LEFT + 220 * number
        _add(root, "circle", cx=x, cy=20, r=5, fill=colour)
        _text(root, x + 12, 24, name, "start")
    for number, (title, lines) in enumerate(panels.items()):
        row, column = divmod(number, _COLUMNS)
        _panel(root, title, lines, factors, (column * _WIDTH, _LEGEND + row * _HEIGHT))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _panel(
    root: ET.Element,
    title: str,
    lines: Mapping[str, Line],
    factors: Sequence[float],
    corner: tuple[float, float],
) -> None:
    left, right = corner[0] + _LEFT, corner[0] + _WIDTH - _RIGHT
    top, bottom = corner[1] + _TOP, corner[1] + _HEIGHT - _BOTTOM
    step = (right - left) / max(len(factors) - 1, 1)
    _text(root, (left + right) / 2, top - 10, title, "middle")
    for share in (0.0, 0.5, 1.0):
        y = bottom - share * (bottom - top)
        _polyline(root, [(left, y), (right, y)], "grid")
        _text(root, left - 6, y + 4, f"{100 * share:g}%", "end")
    for number, factor in enumerate(factors):
        _text(root, left + step * number, bottom + 16, f"{factor:g}", "middle")
    for colour, line in zip(COLOURS[2:], lines.values(), strict=False):
        points = [
            (left + step * factors.index(factor), bottom - share * (bottom - top))
            for factor, share in line
        ]
        _polyline(root, points, "line", stroke=colour)
        for x, y in points:
            _add(root, "circle", cx=f"{x:g}", cy=f"{y:g}", r=3, fill=colour)


def _polyline(root: ET.Element, points: Line, kind: str, **attributes: str) -> None:
    positions = " ".join(f"{x:g},{y:g}" for x, y in points)
    _add(root, "polyline", points=positions, **{"class": kind}, **attributes)


def _text(root: ET.Element, x: float, y: float, content: str, anchor: str) -> None:
    place = {"x": f"{x:g}", "y": f"{y:g}", "text-anchor": anchor}
    ET.SubElement(root, "text", place).text = content


def _add(root: ET.Element, tag: str, **attributes: object) -> None:
    ET.SubElement(root, tag, {name: str(value) for name, value in attributes.items()})
