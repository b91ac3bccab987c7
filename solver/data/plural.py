"""Nouns in the number of things that are counted."""


def plural(number: float, noun: str) -> str:
    """Return a noun as it stands behind a number: "source" behind 1, "sources" behind others."""
    return noun if number == 1 else f"{noun}s"
