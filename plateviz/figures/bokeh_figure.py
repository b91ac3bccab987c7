"""BokehFigure: the Bokeh models of a figure, which follow other figures in place.

Models are made once. Another figure changes their columns, words, limits and colours, which takes
a few milliseconds and sends only what differs.
"""

from dataclasses import replace

from bokeh import models

from plateviz.figures.bokeh_frame import BokehFrame
from plateviz.figures.figure import Figure
from plateviz.figures.theme import theme_of
from plateviz.figures.words import words_of_row


class BokehFigure:
    """The drawn frames of a figure.

    Attributes
    ----------
    model : to put into a Bokeh document
    frames : the drawn frames
    """

    def __init__(self, figure: Figure, theme: str, *, is_packed: bool = False) -> None:
        """Draw `figure` in a theme, "light" or "dark"; ValueError if there is no such theme.

        Parameters
        ----------
        is_packed : whether its texts are for a page whose scripts unpack them, see `PackedTexts`
        """
        self._is_packed = is_packed
        self._make(figure)
        self.follow(figure, theme)

    def follow(self, figure: Figure, theme: str) -> None:
        """Show another figure, or the same one in another theme.

        If it has another number of frames, or other kinds of axes, `model` and `frames` are
        new ones afterwards.

        Raises
        ------
        ValueError
            If there is no such theme.
        """
        colours = theme_of(theme)
        if not self._can_follow(figure):
            self._make(figure)
        for first in range(0, len(figure), figure.columns):
            row = slice(first, first + figure.columns)
            frames = figure.frames[row]
            words = words_of_row(frames)
            for drawn, frame, one in zip(self.frames[row], frames, words, strict=True):
                drawn.follow(frame, colours, one)

    def with_limits(self, figure: Figure) -> Figure:
        """Return a figure with the limits of the drawn frames, which a person may have changed.

        Parameters
        ----------
        figure : one that this one shows
        """
        frames = (drawn.with_limits(f) for drawn, f in zip(self.frames, figure, strict=True))
        return replace(figure, frames=tuple(frames))

    def _make(self, figure: Figure) -> None:
        # A grid whose children change is laid out by BokehJS before all their views are there, so
        # that another number of frames gets another grid.
        self._arrangement = (len(figure), figure.columns, figure.linked)
        self.frames: list[BokehFrame] = []
        for frame in figure:
            first = self.frames[0] if self.frames else None
            x_range = first.x_range if first and "x" in figure.linked else None
            y_range = first.y_range if first and "y" in figure.linked else None
            self.frames.append(BokehFrame(frame, x_range, y_range, is_packed=self._is_packed))
        self.model = models.GridBox(
            children=[
                (drawn.plot, *divmod(number, figure.columns))
                for number, drawn in enumerate(self.frames)
            ]
        )

    def _can_follow(self, figure: Figure) -> bool:
        return self._arrangement == (len(figure), figure.columns, figure.linked) and all(
            drawn.can_follow(frame) for drawn, frame in zip(self.frames, figure, strict=True)
        )
