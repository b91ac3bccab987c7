"""Model search: Bokeh looks for what is new on a page once after many changes, and only if needed.

It does so after each change of a property that has models, and after each `models.freeze()`, even
if nothing has changed meanwhile. For a page with figures this takes as long as it takes these to
follow another solution.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from bokeh.document import Document


@contextmanager
def one_search(document: Document | None) -> Iterator[None]:
    """Let Bokeh look for new models once at the end of a block, if the block has changed any.

    Parameters
    ----------
    document : of the page; None where there is none
    """
    models: Any = None if document is None else document.models
    if models is None or "recompute" in vars(models):
        # An outer block ends with the search.
        yield
        return
    is_wanted = False

    def note() -> None:
        nonlocal is_wanted
        is_wanted = True

    models.recompute = note
    try:
        yield
    finally:
        del models.recompute
        if is_wanted:
            models.recompute()
