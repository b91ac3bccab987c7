"""Saved views: what is on the screen as a small JSON file, which a page opens again.

    {"format": "plateviz view", "version": 1, "of": "sky", "address": {...},
     "settings": "order=5", "sources": [...], "exposures": [[0, 3], ...], "detectors": [...]}

`of` is the name of the survey or the file, and `address` the query of the page's address.
`settings` are those of the solution in words, for the day when its run is gone. The last three are
the selection, for which an address has no room.
"""

import json
from collections.abc import Mapping
from typing import Any

from plateviz.dashboard.address_parts import quoted
from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.session.solution_address import settings_text
from solver.data.ids import is_id
from solver.data.subset import KINDS, Subset
from solver.errors import InputError

_FORMAT, _VERSION = "plateviz view", 1
MOST_BYTES = 800_000
"""A message of the browser has room for it."""
_MOST_SELECTED = 30_000
_MOST_PARTS = 60


def view_text(navigation: Navigation) -> str:
    """Return what is on the screen as the text of a file.

    Raises
    ------
    InputError
        If more sources are selected than a view holds.
    """
    session = navigation.session
    sources = sorted(session.selection.sources)
    if len(sources) > _MOST_SELECTED:
        raise InputError(
            f"a view holds up to {_MOST_SELECTED:,} selected sources, and {len(sources):,} are "
            "selected: save these as a table"
        )
    content = {
        "format": _FORMAT,
        "version": _VERSION,
        "of": session.store.title,
        "address": navigation.address(is_whole=True),
        "settings": "" if session.shown is None else settings_text(session.shown),
        "sources": sources,
        "exposures": sorted(session.selection.exposures),
        "detectors": sorted(session.selection.detectors),
    }
    text = json.dumps(content)
    if len(text) > MOST_BYTES:
        raise InputError(f"a view holds up to {MOST_BYTES:,} bytes, and this one has {len(text):,}")
    return text


def open_view(navigation: Navigation, text: str) -> None:
    """Show what a file of a view holds; a notice says what of it is gone.

    Raises
    ------
    InputError
        If it is no view, it is damaged, or a newer version has written it; nothing is changed.
    """
    content = _read(text)
    address, selected = _address(content.get("address")), _selected(content)
    # The file has the selection itself, whatever is kept under its name by now.
    without = {*KINDS, "selection"}
    address = {name: value for name, value in address.items() if name not in without}
    settings, runs = content.get("settings"), [run.name for run in navigation.runs]
    if isinstance(settings, str) and settings and address.get("run") not in (None, *runs):
        address.setdefault("solution", settings)
    navigation.begin(address)
    session = navigation.session
    session.selection.select(selected)
    title = session.store.title
    if content.get("of") != title:
        session.note([f"the view is of {quoted(content.get('of'))}, and this page of {title!r}"])


def _read(text: str) -> Mapping[str, Any]:
    if len(text) > MOST_BYTES:
        raise InputError(f"expected a saved view of {MOST_BYTES:,} bytes or fewer")
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError("expected a saved view, found a file that is no JSON") from error
    if not isinstance(content, dict) or content.get("format") != _FORMAT:
        raise InputError(f"expected a saved view with format {_FORMAT!r}, found another file")
    version = content.get("version")
    if not isinstance(version, int) or isinstance(version, bool) or not 1 <= version <= _VERSION:
        raise InputError(
            f"expected a saved view of version {_VERSION} or older, found {quoted(version)}"
        )
    return content


def _address(found: object) -> dict[str, str]:
    if isinstance(found, dict) and len(found) <= _MOST_PARTS:
        parts = {name: value for name, value in found.items() if isinstance(value, str)}
        if len(parts) == len(found):
            return parts
    raise InputError("expected the parts of an address as texts, found others")


def _selected(content: Mapping[str, Any]) -> Subset:
    pairs = content.get("exposures", [])
    if not isinstance(pairs, list) or not all(
        isinstance(pair, list) and len(pair) == 2 and all(type(one) is int for one in pair)
        for pair in pairs
    ):
        raise InputError("expected pairs of field and exposure, found others")
    sources, detectors = (_ids(content.get(kind, [])) for kind in ("sources", "detectors"))
    if sources is None or detectors is None or len(pairs) > _MOST_SELECTED:
        raise InputError(
            f"expected up to {_MOST_SELECTED:,} different ids of sources, found others"
        )
    return Subset(sources, frozenset((field, plate) for field, plate in pairs), detectors)


def _ids(found: object) -> frozenset[int] | None:
    """Return ids; None if they are none, are too many, or are not all different."""
    if not isinstance(found, list) or len(found) > _MOST_SELECTED:
        return None
    ids = frozenset(one for one in found if type(one) is int and is_id(one))
    return ids if len(ids) == len(found) else None
