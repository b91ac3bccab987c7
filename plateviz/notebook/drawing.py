"""Drawings: figures that display themselves in a notebook and under `panel serve`.

Panel and HoloViews take seconds to import, and are imported when the first of them is drawn.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple

from plateviz.notebook.card import CARD_STYLE
from plateviz.notebook.named import Named
from plateviz.notebook.progress import notebook_shell
from solver.errors import InputError

if TYPE_CHECKING:
    import holoviews as hv
    import panel as pn

Draw = Callable[[str], "hv.core.Dimensioned"]
"""Gives a picture in a theme."""

_THEMES = ("light", "dark")
# Of a caption, screen pixels: as wide as most figures.
_CAPTION = 560


class Displayed(ABC):
    """What displays itself with Panel."""

    @abstractmethod
    def __panel__(self) -> "pn.viewable.Viewable":
        """Return what is displayed."""

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> object:
        """Return what a notebook displays; in a terminal, words."""
        words = {"text/plain": repr(self)}
        if notebook_shell() is None:
            return words
        load_panel()
        bundle: Any = self.__panel__()._repr_mimebundle_(include, exclude)
        data, metadata = bundle
        return {**data, **words}, metadata


class Drawing(Displayed):
    """One figure with its caption.

    Attributes
    ----------
    name : short and unique among those of its kind
    title, caption : for people
    """

    def __init__(self, name: str, title: str, caption: str, draw: Draw, theme: str) -> None:
        """Take what draws the figure, which is called when it is displayed."""
        self.name, self.title, self.caption = name, title, caption
        self._draw, self._theme = draw, theme

    @property
    def element(self) -> "hv.core.Dimensioned":
        """The figure as HoloViews has it, for whoever wants to go on from there."""
        return self._draw(self._theme)

    def __panel__(self) -> "pn.viewable.Viewable":
        """Return the figure below its caption."""
        import panel as pn

        figure = pn.pane.HoloViews(self.element, backend="bokeh", linked_axes=False, margin=0)
        return pn.Column(
            markup(f"<p class='caption'>{escape(self.caption)}</p>", self._theme, width=_CAPTION),
            figure,
            styles=_paper(self._theme),
            margin=4,
        )

    def __repr__(self) -> str:
        """Return the title."""
        return f"figure {self.name!r}: {self.title}"


class Sheet(Displayed):
    """A card, and drawings below it, two in a row where there is room."""

    def __init__(self, words: str, head: str, drawings: Sequence[Drawing], theme: str) -> None:
        """Take what to show.

        Parameters
        ----------
        words : the card in words
        head : the card, as `plateviz.notebook.card` makes it
        """
        self._words, self._head, self._drawings, self._theme = words, head, drawings, theme

    def __panel__(self) -> "pn.viewable.Viewable":
        """Return card and drawings."""
        import panel as pn

        return pn.Column(
            markup(self._head, self._theme, sizing_mode="stretch_width"),
            pn.FlexBox(*(one.__panel__() for one in self._drawings), align_items="flex-start"),
            sizing_mode="stretch_width",
            styles=_paper(self._theme),
        )

    def __repr__(self) -> str:
        """Return the card in words."""
        return f"{self._words}; {len(self._drawings)} figures"


class Illustrated(ABC):
    """What has figures, and a card that stands above them."""

    @property
    def figures(self) -> Named[Drawing]:
        """Its figures by name: an attribute of it, such as `residual_map`, displays itself."""
        return self._drawings("light")

    def figure(self, name: str, *, theme: str = "light") -> Drawing:
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
        return self._drawings(theme)[name]

    def show(self, *, theme: str = "light") -> Sheet:
        """Return it as a whole on one sheet: its numbers and all its figures."""
        found = self._drawings(theme)
        return Sheet(repr(self), self._repr_html_(), [found[name] for name in found], theme)

    @abstractmethod
    def _drawings(self, theme: str) -> Named[Drawing]:
        """Return the figures in a theme."""

    @abstractmethod
    def _repr_html_(self) -> str:
        """Return the card."""


class FigureRecipe(NamedTuple):
    """What is said of a figure of the gallery; the gallery itself needs HoloViews."""

    name: str
    title: str
    caption: str
    draw: Draw


def drawings(figures: Sequence[FigureRecipe], theme: str) -> Named[Drawing]:
    """Return figures as drawings, by name; InputError if there is no such theme."""
    if theme not in _THEMES:
        raise InputError(f"theme: expected one of {', '.join(_THEMES)}, found {theme!r}")
    return Named(
        "figure", {one.name: lambda one=one: Drawing(*one, theme=theme) for one in figures}
    )


def markup(html: str, theme: str, **size: Any) -> "pn.pane.HTML":  # noqa: ANN401 as Panel
    """Return a pane of HTML in the project's style and of a size, as Panel's words have it."""
    import panel as pn

    return pn.pane.HTML(
        f"<div class='plateviz {theme}'>{html}</div>",
        stylesheets=[CARD_STYLE],
        margin=0,
        **size,
    )


def _paper(theme: str) -> dict[str, str]:
    """Return the background of a theme: a notebook may be of the other."""
    from plateviz.plots.theme import theme_of

    return {"background": theme_of(theme).background, "padding": "0 6px 6px"}


def load_panel() -> None:
    """Load Panel into the notebook, once; what a person has loaded is left as it is.

    What the browser needs is put into the notebook, some 4 MB of it, so that figures are drawn
    without a network, and in what the notebook is exported to.
    """
    import panel as pn

    if not pn.extension._loaded:
        pn.extension(inline=True, console_output="disable")
