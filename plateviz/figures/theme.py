"""Colours of the light and the dark theme, and the fonts of both."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from bokeh.palettes import interp_palette

FONT = "Helvetica, Arial, sans-serif"
TITLE_SIZE, LABEL_SIZE, SMALL_SIZE = 13, 12, 11
"""Sizes of titles, of labels of axes, and of other words, screen pixels."""


@dataclass(frozen=True)
class Theme:
    """Colours that depend on the background.

    Attributes
    ----------
    background, text, muted, grid : of the page, the text, secondary text, the grid
    line : guide lines, outlines, expected curves
    mark : data without classes
    ramp : colours of increasing counts
    difference : colours from below a middle value, which has nearly the background, to above
    """

    background: str
    text: str
    muted: str
    grid: str
    line: str
    mark: str
    ramp: tuple[str, ...]
    difference: tuple[str, ...]

    def colour(self, name: str | None) -> str | None:
        """Return the colour that a figure names, such as "muted"; other colours as they are."""
        return getattr(self, name) if name in _NAMED else name

    def palette(self, name: str | tuple[str, ...]) -> list[str]:
        """Return the palette that a figure names: "count", "share" or "difference"; or colours."""
        if not isinstance(name, str):
            return list(name)
        return getattr(self, f"{name}_palette")

    @property
    def count_palette(self) -> list[str]:
        """256 colours of increasing counts."""
        return list(interp_palette(self.ramp, 256))

    @property
    def share_palette(self) -> list[str]:
        """256 colours of shares from zero (the background colour) to one."""
        return list(interp_palette((self.background, *self.ramp[:4]), 256))

    @property
    def difference_palette(self) -> list[str]:
        """256 colours of differences, symmetric about the middle: blue below, orange above."""
        return list(interp_palette(self.difference, 256))


_NAMED = frozenset({"background", "text", "muted", "grid", "line", "mark"})
THEMES: Mapping[str, Theme] = MappingProxyType(
    {
        "light": Theme(
            "#ffffff",
            "#1f2933",
            "#52606d",
            "#e4e8ec",
            "#3e4c59",
            "#2b78b8",
            ("#d3e5f4", "#9cc6e6", "#5ea2d5", "#2b78b8", "#15507f", "#0a2f4f"),
            ("#0f4272", "#2b78b8", "#8dbde0", "#f4f5f6", "#f2ad85", "#d3571f", "#84300b"),
        ),
        "dark": Theme(
            "#121212",
            "#e6eaee",
            "#a5b0bb",
            "#2b323a",
            "#c2cbd3",
            "#62aee6",
            ("#1c3f5e", "#24608f", "#3a87c8", "#6db3e8", "#a9d6f5", "#e5f4fd"),
            ("#a9d6f5", "#4f9fdc", "#1f4f78", "#1c1d1f", "#7a3a1a", "#e2753b", "#ffc9a6"),
        ),
    }
)


def theme_of(name: str) -> Theme:
    """Return the colours of theme `name`.

    Raises
    ------
    ValueError
        If there is no such theme.
    """
    if name not in THEMES:
        raise ValueError(f"theme: expected one of {', '.join(THEMES)}, found {name!r}")
    return THEMES[name]
