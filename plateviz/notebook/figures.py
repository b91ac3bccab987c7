"""Figures that display themselves in a notebook and under `panel serve`.

Panel and Bokeh take seconds to import; they are imported when the first figure is drawn.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple

from plateviz.notebook.card import CARD_STYLE
from plateviz.notebook.lazy_collection import LazyCollection
from plateviz.notebook.progress import notebook_shell
from solver.data.plural import plural
from solver.errors import InputError

if TYPE_CHECKING:
    import holoviews as hv
    import panel as pn

    from plateviz.figures.figure import Figure

PlotFigure = Callable[[], "Figure"]
"""Returns a figure."""

_THEMES = ("light", "dark")
# Width of a caption, which is that of most figures, screen pixels.
_CAPTION_WIDTH = 560


class Displayed(ABC):
    """An object that Panel displays."""

    @abstractmethod
    def __panel__(self) -> "pn.viewable.Viewable":
        """Return the Panel object to display."""

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> object:
        """Return the Panel object for a notebook, and text elsewhere."""
        text = {"text/plain": repr(self)}
        if notebook_shell() is None:
            return text
        load_panel()
        bundle: Any = self.__panel__()._repr_mimebundle_(include, exclude)
        data, metadata = bundle
        return {**data, **text}, metadata


class NotebookFigure(Displayed):
    """One figure with its caption.

    Attributes
    ----------
    name : short name, unique among the figures of an object
    title, caption : title, and how to read the figure
    """

    def __init__(self, name: str, title: str, caption: str, plot: PlotFigure, theme: str) -> None:
        """Store the description; displaying the figure calls `plot`."""
        self.name, self.title, self.caption = name, title, caption
        self._plot, self._theme = plot, theme

    @property
    def element(self) -> "hv.Overlay | hv.Layout":
        """The figure as a HoloViews object, to change it or combine it with others."""
        from plateviz.figures.holoviews_figure import to_holoviews

        return to_holoviews(self._plot(), self._theme)

    def __panel__(self) -> "pn.viewable.Viewable":
        """Return the caption and the figure below it."""
        import panel as pn

        from plateviz.figures.bokeh_figure import BokehFigure

        figure = pn.pane.Bokeh(BokehFigure(self._plot(), self._theme).model, margin=0)
        return pn.Column(
            markup(
                f"<p class='caption'>{escape(self.caption)}</p>", self._theme, width=_CAPTION_WIDTH
            ),
            figure,
            styles=_background(self._theme),
            margin=4,
        )

    def __repr__(self) -> str:
        """Return the title."""
        return f"figure {self.name!r}: {self.title}"


class Overview(Displayed):
    """A card with figures below it, two in a row where there is room."""

    def __init__(self, text: str, html: str, figures: Sequence[NotebookFigure], theme: str) -> None:
        """Describe the overview.

        Parameters
        ----------
        text : the card as one line of text
        html : the card as `plateviz.notebook.card` makes it
        """
        self._text, self._html, self._figures, self._theme = text, html, figures, theme

    def __panel__(self) -> "pn.viewable.Viewable":
        """Return the card and the figures."""
        import panel as pn

        return pn.Column(
            markup(self._html, self._theme, sizing_mode="stretch_width"),
            pn.FlexBox(*(one.__panel__() for one in self._figures), align_items="flex-start"),
            sizing_mode="stretch_width",
            styles=_background(self._theme),
        )

    def __repr__(self) -> str:
        """Return the card as one line of text."""
        return f"{self._text}; {len(self._figures)} {plural(len(self._figures), 'figure')}"


class HasFigures(ABC):
    """An object with a card and figures."""

    @property
    def figures(self) -> LazyCollection[NotebookFigure]:
        """Its figures by name, as items or as attributes such as `figures.residual_map`."""
        return self._figures("light")

    def figure(self, name: str, *, theme: str = "light") -> NotebookFigure:
        """Return a figure that displays itself.

        Parameters
        ----------
        name : one of `figures`
        theme : "light" or "dark"

        Raises
        ------
        InputError
            If there is no such figure or theme.
        """
        return self._figures(theme)[name]

    def show(self, *, theme: str = "light") -> Overview:
        """Return an overview: the card and all figures."""
        found = self._figures(theme)
        return Overview(repr(self), self._repr_html_(), [found[name] for name in found], theme)

    @abstractmethod
    def _figures(self, theme: str) -> LazyCollection[NotebookFigure]:
        """Return the figures in a theme."""

    @abstractmethod
    def _repr_html_(self) -> str:
        """Return the card."""


class FigureSpec(NamedTuple):
    """Name, title, caption and plot function of a figure, without importing what draws it."""

    name: str
    title: str
    caption: str
    plot: PlotFigure


def figure_collection(specs: Sequence[FigureSpec], theme: str) -> LazyCollection[NotebookFigure]:
    """Return figures in a theme, by name; InputError if there is no such theme."""
    if theme not in _THEMES:
        raise InputError(f"theme: expected one of {', '.join(_THEMES)}, found {theme!r}")
    return LazyCollection(
        "figure", {one.name: lambda one=one: NotebookFigure(*one, theme=theme) for one in specs}
    )


def markup(html: str, theme: str, **size: Any) -> "pn.pane.HTML":  # noqa: ANN401 as Panel
    """Return a pane of HTML in the project's style; `size` are keywords of a Panel pane."""
    import panel as pn

    return pn.pane.HTML(
        f"<div class='plateviz {theme}'>{html}</div>",
        stylesheets=[CARD_STYLE],
        margin=0,
        **size,
    )


def _background(theme: str) -> dict[str, str]:
    """Return the CSS of a theme's background; the notebook may have the other theme."""
    from plateviz.figures.theme import theme_of

    return {"background": theme_of(theme).background, "padding": "0 6px 6px"}


def load_panel() -> None:
    """Load Panel into the notebook, unless it is loaded.

    This embeds about 4 MB of scripts in the notebook, so that figures are drawn without a
    network and in exported notebooks.
    """
    import panel as pn

    if not pn.extension._loaded:
        pn.extension(inline=True, console_output="disable")
