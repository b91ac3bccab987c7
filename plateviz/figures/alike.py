"""Two figures of the same kind beside each other, with the same limits and colours."""

from dataclasses import replace

from plateviz.figures.figure import Axis, Figure, Frame, Glyphs, Limits, Link, Ramp


def beside(first: Figure, second: Figure, titles: tuple[str, str]) -> Figure:
    """Return two figures beside each other, one with several frames above the other.

    Frames at the same place have the same limits and colours of numbers. Where all frames of a
    figure have the same axes, those of both figures are linked.

    Parameters
    ----------
    first, second : of the same kind, so that they have as many frames
    titles : set before those of the frames of each figure
    """
    pairs = [_alike(a, b) for a, b in zip(first, second, strict=True)]
    frames = [
        replace(frame, title=f"{title} {frame.title}")
        for title, row in zip(titles, zip(*pairs, strict=True), strict=True)
        for frame in row
    ]
    linked: Link = "xy" if len(pairs) == 1 else first.linked
    return Figure(tuple(frames), 2 if len(pairs) == 1 else first.columns, linked)


def _alike(a: Frame, b: Frame) -> tuple[Frame, Frame]:
    x, y = _axes(a.x, b.x), _axes(a.y, b.y)
    ramps = {glyphs.name: glyphs for glyphs in a.glyphs}
    pairs = [(ramps.get(glyphs.name), glyphs) for glyphs in b.glyphs]
    of_a = {one.name: _coloured(one, other) for one, other in pairs if one is not None}
    of_b = {other.name: _coloured(other, one) for one, other in pairs}
    return (
        replace(a, x=x[0], y=y[0], glyphs=tuple(of_a.get(g.name, g) for g in a.glyphs)),
        replace(b, x=x[1], y=y[1], glyphs=tuple(of_b[g.name] for g in b.glyphs)),
    )


def _axes(a: Axis, b: Axis) -> tuple[Axis, Axis]:
    """Return both axes with limits that hold those of both, in the direction of the first."""
    low, high = _both(a.limits, b.limits)
    limits = (low, high) if a.limits[0] <= a.limits[1] else (high, low)
    return replace(a, limits=limits), replace(b, limits=limits)


def _coloured(glyphs: Glyphs, other: Glyphs | None) -> Glyphs:
    if other is None:
        return glyphs
    looks = dict(glyphs.looks)
    for name, look in looks.items():
        same = other.looks.get(name)
        if isinstance(look, Ramp) and isinstance(same, Ramp):
            looks[name] = replace(look, limits=_both(look.limits, same.limits))
    return replace(glyphs, looks=looks)


def _both(a: Limits, b: Limits) -> Limits:
    return min(*a, *b), max(*a, *b)
