"""FigureText: what every kind of figure of the dashboard says of itself."""

from typing import Protocol


class FigureText(Protocol):
    """Name, title, words and width of a figure."""

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
    def equation(self) -> str:
        """What is drawn as an equation in plain text; empty if there is none to say."""
        ...

    @property
    def document(self) -> str:
        """Where the documents explain the figure: file and section."""
        ...

    @property
    def is_wide(self) -> bool:
        """Whether the figure takes a whole row where the number of cards is odd."""
        ...

    @property
    def least_height(self) -> int:
        """Height that its card needs, screen pixels; 0 where the height of any card is enough.

        A card that needs the height of two takes two rows.
        """
        ...

    @property
    def narrow_height(self) -> int:
        """The same in a window narrower than 1536 pixels; 0 for `least_height`."""
        ...

    @property
    def column_height(self) -> int:
        """The same where all cards are in one column, below 1200 pixels; 0 for `narrow_height`."""
        ...
