"""A figure as a HoloViews object, to change it or combine it with others in a notebook."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import holoviews as hv
import holoviews.plotting.bokeh  # noqa: F401  registers the options of the backend
import numpy as np
from holoviews import dim

from plateviz.figures.figure import By, Figure, Frame, Glyphs, Ramp
from plateviz.figures.theme import Theme, theme_of

_BACKEND = "bokeh"


def to_holoviews(figure: Figure, theme: str = "light") -> hv.Overlay | hv.Layout:
    """Return an overlay of one frame, or a layout of several.

    Raises
    ------
    ValueError
        If there is no such theme.
    """
    colours = theme_of(theme)
    overlays = [_overlay(frame, colours) for frame in figure]
    if len(overlays) == 1:
        return overlays[0]
    return hv.Layout(overlays).cols(figure.columns).opts(shared_axes=False, backend=_BACKEND)


def _overlay(frame: Frame, theme: Theme) -> hv.Overlay:
    elements = [element for glyphs in frame.glyphs for element in _elements(glyphs, theme)]
    axes = {
        f"{axis}{option}": value
        for axis, of in (("x", frame.x), ("y", frame.y))
        for option, value in (
            ("label", of.label),
            ("lim", of.limits),
            ("ticks", 0 if of.ticks == () else None if of.ticks is None else list(of.ticks)),
            ("rotation", round(of.rotation)),
        )
    }
    return hv.Overlay(elements).opts(
        title=f"{frame.title}\n{frame.subtitle}".strip(),
        frame_width=frame.width,
        frame_height=frame.frame_height,
        logx=frame.x.is_log,
        logy=frame.y.is_log,
        show_legend=frame.legend_columns > 0,
        legend_position="bottom",
        legend_cols=frame.legend_columns or 1,
        show_grid=True,
        bgcolor=theme.background,
        fontsize={"title": 10},
        backend=_BACKEND,
        **axes,
    )


def _elements(glyphs: Glyphs, theme: Theme) -> list[hv.Element]:
    if not len(glyphs):
        return []
    found = _MAKERS[glyphs.kind](glyphs)
    elements = found if isinstance(found, list) else [found]
    options = _options(glyphs, theme)
    return [element.opts(backend=_BACKEND, **options) for element in elements]


def _table(glyphs: Glyphs, of: Callable, *names: str) -> hv.Element:
    """Return an element whose first columns are the coordinates `names`."""
    key = [glyphs.at[name] for name in names]
    rest = [name for name in glyphs.columns if name not in key]
    columns = {name: glyphs.columns[name] for name in [*key, *rest]}
    label = "" if glyphs.label.startswith("@") else glyphs.label
    return of(columns, key, rest, label=label)


def _curve(glyphs: Glyphs) -> hv.Curve:
    rest = [name for name in glyphs.columns if name not in ("x", "y")]
    return hv.Curve(dict(glyphs.columns), "x", ["y", *rest], label=glyphs.label)


def _area(glyphs: Glyphs) -> hv.Area:
    data = tuple(glyphs.values(name) for name in ("x", "y1", "y2"))
    return hv.Area(data, "x", ["low", "high"], label=glyphs.label)


def _labels(glyphs: Glyphs) -> hv.Labels:
    rest = [name for name in glyphs.columns if name not in ("x", "y", "text")]
    return hv.Labels(dict(glyphs.columns), ["x", "y"], ["text", *rest])


def _image(glyphs: Glyphs) -> hv.Image:
    values, (x, y, dw, dh) = (
        glyphs.values("image")[0],
        (float(glyphs.values(name)[0]) for name in ("x", "y", "dw", "dh")),
    )
    name = glyphs.at["image"]
    # HoloViews draws the first row at the top.
    return hv.Image(values[::-1], ["x", "y"], name, bounds=(x, y, x + dw, y + dh))


def _paths(glyphs: Glyphs) -> hv.Path:
    ends = zip(glyphs.values("xs"), glyphs.values("ys"), strict=True)
    return hv.Path([np.column_stack(pair) for pair in ends], ["x", "y"])


_MAKERS: Mapping[str, Callable[[Glyphs], Any]] = MappingProxyType(
    {
        "points": lambda g: _table(g, hv.Points, "x", "y"),
        "segments": lambda g: _table(g, hv.Segments, "x0", "y0", "x1", "y1"),
        "rectangles": lambda g: _table(g, hv.Rectangles, "left", "bottom", "right", "top"),
        "line": _curve,
        "band": _area,
        "texts": _labels,
        "image": _image,
        "paths": _paths,
        "horizontal": lambda g: [hv.HLine(float(y)) for y in g.values("y")],
        "vertical": lambda g: [hv.VLine(float(x)) for x in g.values("x")],
        "strip": lambda g: hv.HSpan(float(g.values("y0")[0]), float(g.values("y1")[0])),
    }
)


def _options(glyphs: Glyphs, theme: Theme) -> dict[str, Any]:
    options: dict[str, Any] = {}
    for name, look in glyphs.looks.items():
        if isinstance(look, Ramp):
            options |= _ramp(look, theme, is_image=glyphs.kind == "image")
        elif isinstance(look, By):
            values = {text: theme.colour(value) for text, value in look.looks.items()}  # type: ignore[arg-type]
            options[name] = dim(look.column).categorize(values)
        elif name.endswith("_color"):
            options[name] = theme.colour(look)  # type: ignore[arg-type]
        else:
            options[name] = look
    if glyphs.hover:
        options |= {"tools": ["hover"], "hover_tooltips": list(glyphs.hover)}
    if glyphs.kind in ("segments", "line", "paths", "horizontal", "vertical"):
        # These elements have one colour, and the same names without the part.
        options["color"] = options.pop("line_color")
    return options


def _ramp(ramp: Ramp, theme: Theme, *, is_image: bool) -> dict[str, Any]:
    options = {
        "cmap": theme.palette(ramp.palette),
        "clim": ramp.limits,
        "cnorm": "log" if ramp.is_log else "linear",
        "colorbar": ramp.label is not None,
        "clabel": ramp.label or "",
    }
    return options if is_image else {**options, "color": ramp.column}
