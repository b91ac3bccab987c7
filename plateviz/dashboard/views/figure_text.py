"""FigureText: what every kind of figure of the dashboard says of itself."""

from typing import Protocol


class FigureText(Protocol):
    """Name, title, caption and width of a figure."""

    @property
    def name(self) -> str:
        """Short unique name, used in CSS class names."""
        ...

    @property
    def title(self) -> str:
        """Displayed title."""
        ...

    @property
    def caption(self) -> str:
        """What the figure shows, and how it looks for a good solution."""
        ...

    @property
    def is_wide(self) -> bool:
        """Whether the figure takes a whole row where the number of cards is odd."""
        ...
