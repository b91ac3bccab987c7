"""The Bokeh models of one frame: a plot with its axes, words, glyphs and legend."""

import math
from collections.abc import Iterator
from dataclasses import replace

from bokeh import models
from bokeh.core.property.vectorization import Field, Value

from plateviz.figures.bokeh_glyphs import BokehGlyphs
from plateviz.figures.figure import Axis, Frame
from plateviz.figures.theme import FONT, LABEL_SIZE, SMALL_SIZE, TITLE_SIZE, Theme
from plateviz.figures.tick_count import columns_of_ticks, rows_of_ticks
from plateviz.figures.tick_labels import follow_policy
from plateviz.figures.tick_numbers import with_tick_numbers
from plateviz.figures.words import MENU, Words

# Least room to the left of a frame, screen pixels.
_LEFT = 5
# Milliseconds without a turn of the wheel after which a person has chosen new limits.
_SETTLED = 40
# Shows an image while the reach of the frame's limits is between those in its tags.
_SHOW_WITHIN_REACH = """
    const reach = Math.max(...[x.start, x.end, y.start, y.end].map(Math.abs));
    const [least, most] = image.tags;
    image.visible = reach > least && reach <= most;
"""
# BokehJS knows the height of another text only after it has laid out the plot.
_MAKE_ROOM = """
    const lines = cb_obj.text.split("\\n").length;
    if (lines !== cb_obj.lines_with_room)
      setTimeout(() => Bokeh.index.find_one(plot)?.invalidate_layout(), 0);
    cb_obj.lines_with_room = lines;
"""


class BokehFrame:
    """A Bokeh plot that follows frames with the same kinds of axes."""

    def __init__(
        self,
        frame: Frame,
        x_range: models.Range1d | None = None,
        y_range: models.Range1d | None = None,
        *,
        is_packed: bool = False,
    ) -> None:
        """Make the models; `follow` gives them their values.

        Parameters
        ----------
        x_range, y_range : limits that the frame shares with another
        is_packed : as of `BokehGlyphs`
        """
        self._is_packed = is_packed
        self._logs = (frame.x.is_log, frame.y.is_log)
        self._glyphs: dict[str, BokehGlyphs] = {}
        self._labels: dict[str, list[models.GlyphRenderer]] = {}
        self._title, self._subtitle = models.Title(), models.Title(text_line_height=1.25)
        self._legend = models.Legend(location="bottom_left", click_policy="mute", visible=False)
        self._x, self._y = _axis(frame.x), _axis(frame.y)
        self.x_range, self.y_range = x_range or models.Range1d(), y_range or models.Range1d()
        self._pan = models.PanTool()
        self.plot = models.Plot(
            x_range=self.x_range,
            y_range=self.y_range,
            x_scale=models.LogScale() if frame.x.is_log else models.LinearScale(),
            y_scale=models.LogScale() if frame.y.is_log else models.LinearScale(),
            title=self._title,
            above=[self._subtitle],
            toolbar=models.Toolbar(
                logo=None,
                autohide=True,
                active_drag=self._pan,
                # A subtitle wider than the frame leaves it no width: its menu stands beside.
                styles={"min-width": f"{MENU}px"},
            ),
            toolbar_location="above",
            output_backend="canvas",
            # At a fraction of a pixel the edge keeps some of the colour of a former theme.
            styles={"clip-path": "inset(2px)"},
        )
        for words in (self._title, self._subtitle):
            words.js_on_change("text", models.CustomJS(args={"plot": self.plot}, code=_MAKE_ROOM))
        self._box, self._wheel = models.BoxZoomTool(), models.WheelZoomTool()
        self.plot.add_layout(self._x, "below")
        self.plot.add_layout(self._y, "left")
        self.plot.add_layout(self._legend, "below")
        self._grids = [models.Grid(axis=self._x), models.Grid(axis=self._y, dimension=1)]
        self.plot.center = [*self._grids]
        self.plot.add_tools(
            self._pan,
            self._wheel,
            self._box,
            models.ResetTool(),
            models.SaveTool(),
        )

    def can_follow(self, frame: Frame) -> bool:
        """Return whether `frame` has the same kinds of axes and glyphs."""
        return self._logs == (frame.x.is_log, frame.y.is_log) and all(
            self._glyphs[one.name].can_follow(one)
            for one in frame.glyphs
            if one.name in self._glyphs
        )

    def follow(self, frame: Frame, theme: Theme, words: Words) -> None:
        """Show another frame.

        Parameters
        ----------
        words : of the frame, with as many lines as those of the other frames of the row
        """
        self._write(words, frame.outdent, theme)
        self.plot.update(
            frame_width=frame.width,
            frame_height=frame.frame_height,
            # Without it, the frame is cut off where another in its column has wider labels.
            min_border_right=frame.margin,
            min_border_left=max(_LEFT, frame.indent + frame.beside),
            background_fill_color=theme.background,
            border_fill_color=theme.background,
            outline_line_color=theme.muted,
        )
        self._box.match_aspect = frame.height is None
        columns = columns_of_ticks(frame.x, frame.width)
        _follow_axis(self._x, self.x_range, frame.x, columns, theme)
        _follow_axis(self._y, self.y_range, frame.y, rows_of_ticks(frame.frame_height), theme)
        for grid in self._grids:
            grid.grid_line_color = theme.grid
        self._follow_glyphs(frame, theme)
        self._follow_legend(frame, theme)

    def with_limits(self, frame: Frame) -> Frame:
        """Return a frame of the same size with the limits of the drawn one."""
        x, y = (
            replace(axis, limits=(drawn.start, drawn.end))
            for axis, drawn in ((frame.x, self.x_range), (frame.y, self.y_range))
        )
        return replace(frame, x=x, y=y, height=frame.frame_height)

    def zoom_by_wheel(self) -> None:
        """Let the wheel zoom at once; elsewhere it scrolls the page until its tool is chosen."""
        self.plot.toolbar.update(active_scroll=self._wheel)
        # BokehJS tells the server of new limits so long after the last turn of the wheel.
        self.plot.lod_timeout = _SETTLED

    def glyphs(self) -> Iterator[BokehGlyphs]:
        """Iterate over the glyphs, hidden ones among them."""
        return iter(self._glyphs.values())

    def _write(self, words: Words, outdent: int, theme: Theme) -> None:
        self._title.update(
            text="\n".join(words.title),
            offset=-outdent,
            **_font("text", theme.text, TITLE_SIZE),
            text_font_style="bold",
        )
        self._subtitle.update(
            text="\n".join(words.subtitle),
            offset=-outdent,
            visible=bool(words.subtitle),
            **_font("text", theme.muted, SMALL_SIZE),
            text_font_style="normal",
        )

    def _follow_glyphs(self, frame: Frame, theme: Theme) -> None:
        for glyphs in frame.glyphs:
            drawn = self._glyphs.get(glyphs.name)
            if drawn is None:
                drawn = self._glyphs[glyphs.name] = self._add(
                    BokehGlyphs(glyphs, is_packed=self._is_packed)
                )
                if glyphs.reach is not None:
                    self._follow_reach(drawn)
            drawn.follow(glyphs, theme)
            if drawn.bar is not None:
                drawn.bar.visible = True
                _style_bar(drawn.bar, theme)
            if glyphs.reach is not None:
                # The edge of the frame lies slightly outside the data.
                drawn.renderer.tags = [1.01 * limit for limit in glyphs.reach]
                reach = max(map(abs, (*frame.x.limits, *frame.y.limits)))
                least, most = drawn.renderer.tags
                drawn.renderer.visible = least < reach <= most
        shown = set(frame.names)
        for name, drawn in self._glyphs.items():
            if name not in shown:
                drawn.hide()
                if drawn.bar is not None:
                    drawn.bar.visible = False
        # Glyphs are drawn in the order of the frame, whichever was there first.
        order = [self._glyphs[name].renderer for name in frame.names]
        rest = [one.renderer for name, one in self._glyphs.items() if name not in shown]
        if self.plot.renderers != [*order, *rest]:
            self.plot.renderers = [*order, *rest]

    def _add(self, drawn: BokehGlyphs) -> BokehGlyphs:
        if drawn.hover is not None:
            self.plot.add_tools(drawn.hover)
        if drawn.bar is not None:
            self.plot.add_layout(drawn.bar, "right")
        return drawn

    def _follow_reach(self, drawn: BokehGlyphs) -> None:
        ranges = {"x": self.x_range, "y": self.y_range}
        callback = models.CustomJS(
            args={**ranges, "image": drawn.renderer}, code=_SHOW_WITHIN_REACH
        )
        for one in ranges.values():
            one.js_on_change("start", callback)
            one.js_on_change("end", callback)

    def _follow_legend(self, frame: Frame, theme: Theme) -> None:
        labels: dict[str, list[models.GlyphRenderer]] = {}
        for glyphs in frame.glyphs if frame.legend_columns else ():
            if glyphs.label and len(glyphs):
                labels.setdefault(glyphs.label, []).append(self._glyphs[glyphs.name].renderer)
        if self._labels != labels:
            self._labels = labels
            self._legend.items = [
                models.LegendItem(
                    label=Field(label[1:]) if label.startswith("@") else Value(label),
                    renderers=renderers,
                )
                for label, renderers in labels.items()
            ]
        self._legend.update(
            visible=bool(labels),
            ncols=frame.legend_columns or 1,
            styles={"left": f"{-frame.outdent}px"},
            background_fill_color=None,
            border_line_color=None,
            margin=0,
            padding=2,
            spacing=7,
            label_standoff=6,
            **_font("label_text", theme.text, SMALL_SIZE),
        )


def _axis(axis: Axis) -> models.LinearAxis | models.LogAxis:
    return models.LogAxis() if axis.is_log else models.LinearAxis()


def _follow_axis(
    drawn: models.LinearAxis | models.LogAxis,
    limits: models.Range1d,
    axis: Axis,
    ticks: int,
    theme: Theme,
) -> None:
    start, end = axis.limits
    limits.update(start=start, end=end, reset_start=start, reset_end=end)
    if not axis.is_log:
        with_tick_numbers(drawn, axis.limits, is_grouped=axis.is_grouped)
    if axis.ticks is not None:
        places = [place for place, _ in axis.ticks]
        if not isinstance(drawn.ticker, models.FixedTicker):
            drawn.update(ticker=models.FixedTicker())
        drawn.ticker.update(ticks=places, minor_ticks=[])
    elif isinstance(drawn.ticker, models.FixedTicker):
        drawn.update(ticker=models.LogTicker() if axis.is_log else models.BasicTicker())
    if isinstance(drawn.ticker, models.BasicTicker):
        drawn.ticker.desired_num_ticks = ticks
    follow_policy(drawn, axis)
    drawn.update(
        axis_label=axis.label,
        major_label_overrides=dict(axis.ticks or ()),
        major_label_orientation=math.radians(axis.rotation) if axis.rotation else "horizontal",
        axis_line_color=theme.muted,
        major_tick_line_color=theme.muted,
        minor_tick_line_color=None,
        axis_label_text_font_style="normal",
        **_font("axis_label_text", theme.text, LABEL_SIZE),
        **_font("major_label_text", theme.muted, SMALL_SIZE),
    )


def _style_bar(bar: models.ColorBar, theme: Theme) -> None:
    bar.update(
        background_fill_color=None,
        label_standoff=8,
        major_tick_line_color=theme.muted,
        title_text_font_style="normal",
        **_font("title_text", theme.text, SMALL_SIZE),
        **_font("major_label_text", theme.muted, SMALL_SIZE),
    )


def _font(part: str, colour: str, size: int) -> dict[str, str]:
    return {f"{part}_color": colour, f"{part}_font": FONT, f"{part}_font_size": f"{size}px"}
