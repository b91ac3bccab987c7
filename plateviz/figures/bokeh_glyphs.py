"""The Bokeh models of one glyph table: a renderer, its hover and its colour mapper."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from bokeh import models
from bokeh.core.property.vectorization import Field, Value
from bokeh.models.glyph import Glyph

from plateviz.figures.figure import HANDLES, By, Glyphs, Look, Ramp
from plateviz.figures.hover_numbers import hover_formatters
from plateviz.figures.packed_texts import PackedTexts
from plateviz.figures.theme import FONT, Theme
from plateviz.figures.tick_numbers import with_tick_numbers, with_whole_ticks

_GLYPHS: Mapping[str, Callable[..., Glyph]] = MappingProxyType(
    {
        "points": models.Scatter,
        "line": models.Line,
        "segments": models.Segment,
        "rectangles": models.Quad,
        "texts": models.Text,
        "paths": models.MultiLine,
        "band": models.VArea,
        "image": models.Image,
        "horizontal": models.HSpan,
        "vertical": models.VSpan,
        "strip": models.HStrip,
    }
)
# A look of all rows; of each row, it would be a vector.
_OF_ALL = {"line": {"line_color", "line_width", "line_dash", "line_alpha"}}
_OF_ALL["band"] = {"fill_color", "fill_alpha"}
# BokehJS reads the names of dashes of single glyphs otherwise than those of lines.
_DASHES: Mapping[str, str] = MappingProxyType(
    {"solid": "", "dashed": "6", "dotted": "2 4", "dotdash": "2 4 6 4"}
)
_TRANSPARENT = "rgba(0, 0, 0, 0)"
# In the label of a colour bar.
_YEARS = "(yr)"
# Maximum number of glyphs that one hover describes.
_HOVER_LIMIT = 3
# Columns by which rows are selected: the first one that they have.
SELECTED_BY = ("id", "exposure", "detector_id")
# Rows of these kinds are selected; the others are faded while some are. Outlines are, if they are
# those of detectors.
_SELECTABLE = ("points", "segments")


class BokehGlyphs:
    """A renderer that follows glyph tables of one kind.

    Attributes
    ----------
    keys : columns by which rows are selected -> their values in the rows on the screen
    at : property of Bokeh's glyph -> column that has its values
    """

    def __init__(self, glyphs: Glyphs, *, is_packed: bool = False) -> None:
        """Make the models; `follow` gives them their values.

        Parameters
        ----------
        is_packed : whether columns of texts are sent as `PackedTexts`
        """
        self._is_packed = is_packed
        self.kind = glyphs.kind
        self._models = _models_for(glyphs)
        self.source = models.ColumnDataSource()
        self.keys: Mapping[str, np.ndarray] = {}
        self.at = glyphs.at
        self._glyph = _GLYPHS[glyphs.kind](**glyphs.at)
        if glyphs.kind == "texts":
            self._glyph.update(text_font=Value(FONT))
        self._faded: Glyph | None = None
        if _is_faded(glyphs):
            self._faded = _GLYPHS[glyphs.kind](**glyphs.at)
        self.renderer = models.GlyphRenderer(
            data_source=self.source,
            glyph=self._glyph,
            selection_glyph=None,
            nonselection_glyph=self._faded,
            name=glyphs.name,
        )
        self._is_all_faded = False
        if self._faded is not None:
            self.renderer.muted_glyph = self._faded
        self._mapper: models.ContinuousColorMapper | None = None
        self._categories: dict[str, models.CategoricalMapper] = {}
        self.hover: models.HoverTool | None = None
        self.bar: models.ColorBar | None = None
        if any(ramp.label is not None for ramp in _ramps(glyphs)):
            self.bar = models.ColorBar(width=10)
        if glyphs.hover:
            self.hover = models.HoverTool(
                renderers=[self.renderer], limit=_HOVER_LIMIT, visible=False
            )

    def can_follow(self, glyphs: Glyphs) -> bool:
        """Return whether the models can show `glyphs`."""
        return self._models == _models_for(glyphs)

    def follow(self, glyphs: Glyphs, theme: Theme) -> None:
        """Show other values of the same kind."""
        columns, self.at = dict(glyphs.columns), glyphs.at
        self.keys = {name: columns[name] for name in SELECTED_BY if name in columns}
        if self.kind == "segments":
            # They say nothing to a person, and are most of what would be sent.
            columns = {name: one for name, one in columns.items() if name not in self.keys}
        if "line_dash" in glyphs.at:
            dashes = [_DASHES[name] for name in glyphs.values("line_dash")]
            columns[glyphs.at["line_dash"]] = np.array(dashes, dtype=object)
        values = {}
        for name, look in glyphs.looks.items():
            values.update(self._look(name, look, columns, theme))
        self._send(columns)
        self._glyph.update(**glyphs.at, **values)
        if self._faded is not None:
            self._faded.update(**glyphs.at, **(values | _faded_looks(values, theme)))
        self.renderer.visible = True
        if self.hover is not None:
            formatters: Any = hover_formatters(glyphs.hover, self.hover.formatters)
            self.hover.update(tooltips=list(glyphs.hover), formatters=formatters)

    def _send(self, columns: dict[str, np.ndarray]) -> None:
        """Replace the columns that differ, which alone are sent to the browser."""
        if self._is_packed:
            columns = {name: PackedTexts.of(one) for name, one in columns.items()}
        data = self.source.data
        if data.keys() != columns.keys() or _length(data) != _length(columns):
            self.source.data = columns
            return
        others = {name: one for name, one in columns.items() if not _is_same(data[name], one)}
        if others:
            data.update(others)

    def fade(self, is_faded: bool) -> None:
        """Fade all rows, or none; Bokeh fades rows beside selected ones of the same table only."""
        # A person may have muted them by their name in the legend.
        if self._faded is not None and is_faded is not self._is_all_faded:
            self._is_all_faded = self.renderer.muted = is_faded

    def hide(self) -> None:
        """Show nothing until other values come."""
        self.renderer.visible = False

    def _look(
        self, name: str, look: Look, columns: dict[str, np.ndarray], theme: Theme
    ) -> dict[str, Any]:
        """Return the properties of Bokeh's glyph; adds columns that they need."""
        if isinstance(look, Ramp):
            return self._ramp(name, look, theme)
        if isinstance(look, By):
            return {name: self._by(name, look, columns, theme)}
        if name.endswith("_color"):
            look = theme.colour(look)  # type: ignore[arg-type]
        if name in _OF_ALL.get(self.kind, ()):
            return {name: look}
        return {name: Value(_DASHES[str(look)] if name == "line_dash" else look)}

    def _ramp(self, name: str, ramp: Ramp, theme: Theme) -> dict[str, Any]:
        low, high = ramp.limits
        if self._mapper is None:
            kind = models.LogColorMapper if ramp.is_log else models.LinearColorMapper
            self._mapper = kind(nan_color=_TRANSPARENT)
        self._mapper.update(low=low, high=high, palette=theme.palette(ramp.palette))
        if self.bar is not None:
            self.bar.update(color_mapper=self._mapper, title=ramp.label or None)
            if not ramp.is_log:
                is_grouped = _YEARS not in (ramp.label or "")
                with_tick_numbers(self.bar, ramp.limits, is_grouped=is_grouped)
                with_whole_ticks(self.bar, not isinstance(ramp.palette, str))
        if self.kind == "image":
            return {"color_mapper": self._mapper}
        return {name: Field(ramp.column, transform=self._mapper)}

    def _by(self, name: str, by: By, columns: dict[str, np.ndarray], theme: Theme) -> Field:
        """Return the look of each row; numbers and words are added to the columns."""
        texts = list(by.looks)
        if name.endswith("_color"):
            colours = [theme.colour(str(look)) for look in by.looks.values()]
            mapper = self._categories.setdefault(name, models.CategoricalColorMapper())
            mapper.update(factors=texts, palette=colours)
            return Field(by.column, transform=mapper)
        if name == "marker":
            mapper = self._categories.setdefault(name, models.CategoricalMarkerMapper())
            mapper.update(factors=texts, markers=list(by.looks.values()))
            return Field(by.column, transform=mapper)
        looks = list(map(by.looks.get, columns[by.column]))
        is_text = any(isinstance(look, str) for look in by.looks.values())
        columns[f"{name}_by"] = np.asarray(looks, dtype=object if is_text else float)
        return Field(f"{name}_by")


def _is_faded(glyphs: Glyphs) -> bool:
    """Return whether rows that are not selected are faded while others are."""
    is_outline = glyphs.kind == "paths" and glyphs.name != HANDLES
    is_selected_by = any(column in glyphs.columns for column in SELECTED_BY)
    return glyphs.kind in _SELECTABLE or (is_outline and is_selected_by)


def _faded_looks(names: Iterable[str], theme: Theme) -> dict[str, Value]:
    """Return the looks of rows that are not selected, those among them that differ."""
    # Pale and not transparent: where many lie on one another, they must not become dark.
    looks = {"_alpha": Value(1.0), "_color": Value(theme.grid)}
    return {name: looks[name[-6:]] for name in names if name[-6:] in looks}


def _ramps(glyphs: Glyphs) -> list[Ramp]:
    return [look for look in glyphs.looks.values() if isinstance(look, Ramp)]


def _models_for(glyphs: Glyphs) -> tuple[object, ...]:
    """Return what decides which models are needed."""
    ramps = [(ramp.is_log, ramp.label is None) for ramp in _ramps(glyphs)]
    return glyphs.kind, bool(glyphs.hover), glyphs.reach is None, _is_faded(glyphs), ramps


def _length(columns: Mapping[str, Any]) -> int:
    return len(next(iter(columns.values()), ()))


def _is_same(before: Any, after: np.ndarray) -> bool:  # noqa: ANN401 as Bokeh keeps it
    """Return whether two columns of one length have the same values."""
    if before is after:
        return True
    before, after = np.asarray(before), np.asarray(after)
    if before.dtype != object and after.dtype != object:
        return np.array_equal(before, after, equal_nan=_has_nan(before) and _has_nan(after))
    if any(isinstance(one, np.ndarray) for one in before[:1]):
        return all(
            np.array_equal(*pair, equal_nan=True) for pair in zip(before, after, strict=True)
        )
    # Texts, for which the comparison of NumPy is a hundred times as fast as one of each.
    return bool(np.all(before == after))


def _has_nan(values: np.ndarray) -> bool:
    return values.dtype.kind == "f"
