"""Any figure of an orbit, of two solutions beside each other."""

from dataclasses import replace

from plateviz.figures.alike import beside
from plateviz.figures.figure import Figure, message
from plateviz.plots.diagnostic import TO_COMPARE, Chosen, Diagnostic
from plateviz.plots.gallery import diagnostics
from plateviz.plots.workspace import OrbitWorkspace

_TITLE = "Both solutions"
_TITLES = ("(A)", "(B)")


BOTH = Diagnostic(
    "both-solutions",
    _TITLE,
    "A figure of the solution that is compared with (A) and of the solution (B), with the same "
    "limits, colours and lengths of arrows. Frames with the same axes zoom and move together.",
    OrbitWorkspace.ORDERS,
    88,
    lambda chosen: figure_of_both(comparable_figures()[0], chosen),
    follows_shown=True,
    is_wide=True,
)
"""The card of the Orbit page, which chooses the figure; a report has none."""


def comparable_figures() -> tuple[Diagnostic, ...]:
    """Return the figures of one solution in page order."""
    return tuple(one for one in diagnostics() if one.workspace is not OrbitWorkspace.ORDERS)


def of_both(diagnostic: Diagnostic) -> Diagnostic:
    """Return a figure that is drawn of both solutions."""
    return replace(
        diagnostic,
        title=f"{_TITLE}: {diagnostic.title}",
        plot=lambda chosen: figure_of_both(diagnostic, chosen),
        is_wide=True,
    )


def figure_of_both(diagnostic: Diagnostic, chosen: Chosen) -> Figure:
    """Draw a figure of the solution that is compared with (A), and of the solution (B).

    Limits, colours and lengths of arrows are the same for both.
    """
    if chosen.other is None:
        return message(
            _TITLE, f"The chosen figure of another solution and of this one. {TO_COMPARE}"
        )
    b = replace(chosen, other=None, beside=chosen.other)
    a = replace(chosen, result=chosen.other, other=None, beside=chosen.result)
    return with_same_limits(diagnostic.title, diagnostic.plot(a), diagnostic.plot(b))


def with_same_limits(title: str, a: Figure, b: Figure) -> Figure:
    """Return two figures of one kind beside each other, or a message why that cannot be.

    Parameters
    ----------
    title : of their kind
    """
    for figure, name in zip((a, b), _TITLES, strict=True):
        if figure.message is not None:
            return message(f"{name} {title}", figure.message)
    if len(a) != len(b):
        return message(title, "The figures of the two have different parts.")
    return beside(a, b, _TITLES)
