"""What a person has selected, in words, in addresses and as the marks of figures name it."""

import re
import unicodedata
from collections.abc import Callable, Collection, Iterator, Mapping
from types import MappingProxyType
from typing import Any

from plateviz.dashboard.address_parts import quoted
from plateviz.tables.labels import exposure_label
from solver.data.ids import ID, is_id
from solver.data.subset import Exposure, Subset, id_text
from solver.errors import InputError

SelectedIds = Mapping[str, frozenset[str]]
"""Column of a figure's marks -> its texts in the rows that are selected."""
NO_IDS: SelectedIds = MappingProxyType({})

# Maximum number of items of a kind in an address.
FEW = 20
MANY = "many:"
"""Stands, before their key, for more selected items of a kind than an address has room for."""
Find = Callable[[str, str], frozenset[Any] | None]
"""Returns the items of a kind with a key, as of `keys_of`; None if they are not known."""
# Runs of exposures and detectors that are named one by one.
_FEW_NAMED = 3
_LONGEST_NAME = 60
_NUMBERS = re.compile(rf"{ID}(,{ID})*")
_PAIRS = re.compile(rf"{ID}/{ID}(,{ID}/{ID})*")


def ids_of(selected: Subset) -> SelectedIds:
    """Return the columns of figures, and the texts in them, that are selected."""
    texts = {
        "id": map(str, selected.sources),
        "exposure": (exposure_label(*pair) for pair in selected.exposures),
        "detector_id": map(str, selected.detectors),
    }
    found = {column: frozenset(ids) for column, ids in texts.items()}
    return MappingProxyType({column: ids for column, ids in found.items() if ids})


def keys_of(selected: Subset) -> dict[str, str]:
    """Return the kinds of which more are selected than an address has room for, with their keys.

    The same ids have the same key, in every session.
    """
    large = [kind for kind, ids in selected.by_kind().items() if len(ids) > FEW]
    return {kind: selected.digests[kind] for kind in large}


def address_of(selected: Subset) -> dict[str, str]:
    """Return a selection as parts of an address, which `parsed` reads back.

    Of a kind of which more than a few are selected, it has only their key.
    """
    keys = keys_of(selected)
    return {
        kind: MANY + keys[kind] if kind in keys else ",".join(map(id_text, sorted(ids)))
        for kind, ids in selected.by_kind().items()
        if ids
    }


def selection_words(selected: Subset) -> str:
    """Return a selection in words, such as "132 sources, exposures 0/3 to 0/7"."""
    n = len(selected.sources)
    texts = [f"{n:,} source{'s' * (n > 1)}"] if n else []
    if selected.exposures:
        texts.append(_named("exposure", len(selected.exposures), list(_runs(selected.exposures))))
    if selected.detectors:
        names = [str(number) for number in sorted(selected.detectors)]
        texts.append(_named("detector", len(names), names))
    return ", ".join(texts)


def parsed(address: Mapping[str, str], find: Find = lambda *_: None) -> tuple[Subset, list[str]]:
    """Return what an address selects, and the invalid parts in words; these select nothing.

    Parameters
    ----------
    find : looks for what is too large for an address, so that going back within a session finds it
    """
    found, problems = {}, []
    for kind, read in _READERS.items():
        text = address.get(kind)
        if text is None:
            continue
        if text.startswith(MANY):
            items = find(kind, text.removeprefix(MANY))
            problem = (
                f"{kind}: an address has room for {FEW}, and more were selected; "
                "Keep gives them a name for the address, and Save view has all"
            )
        else:
            items = read(text) if text.count(",") < FEW else None
            problem = f"{kind}: expected {FEW} ids or fewer, found {quoted(text)}"
        if items is None:
            problems.append(problem)
        else:
            found[kind] = items
    return Subset(**found), problems


def checked_name(text: str) -> str:
    """Return the name of a selection, without needless spaces.

    Raises
    ------
    InputError
        If it is empty or too long, or has characters that cannot be seen.
    """
    name = " ".join(text.split())
    if not 0 < len(name) <= _LONGEST_NAME:
        raise InputError(
            f"name of a selection: expected 1 to {_LONGEST_NAME} characters, found {len(name)}"
        )
    require_visible(name, "name of a selection")
    return name


def require_visible(name: str, what: str) -> None:
    """Raise InputError if a name has characters that cannot be seen, which may turn what follows.

    Parameters
    ----------
    what : of which it is the name, for the message
    """
    if any(unicodedata.category(character).startswith("C") for character in name):
        raise InputError(f"{what}: expected characters that can be seen")


def _numbers(text: str) -> frozenset[int] | None:
    if not _NUMBERS.fullmatch(text):
        return None
    ids = frozenset(map(int, text.split(",")))
    return ids if all(map(is_id, ids)) else None


def _pairs(text: str) -> frozenset[Exposure] | None:
    if not _PAIRS.fullmatch(text):
        return None
    pairs = (pair.split("/") for pair in text.split(","))
    ids = frozenset((int(field), int(plate)) for field, plate in pairs)
    return ids if all(is_id(field) and is_id(plate) for field, plate in ids) else None


_READERS: Mapping[str, Callable[[str], frozenset[Any] | None]] = MappingProxyType(
    {"sources": _numbers, "exposures": _pairs, "detectors": _numbers}
)


def _runs(exposures: Collection[Exposure]) -> Iterator[str]:
    """Return successive exposures of a field as "0/3 to 0/7"."""
    run: list[Exposure] = []
    for field, plate in sorted(exposures):
        if run and (field, plate) != (run[-1][0], run[-1][1] + 1):
            yield _run(run)
            run = []
        run.append((field, plate))
    yield _run(run)


def _run(run: list[Exposure]) -> str:
    first, last = ("/".join(map(str, exposure)) for exposure in (run[0], run[-1]))
    return first if len(run) == 1 else f"{first} to {last}"


def _named(kind: str, n: int, names: list[str]) -> str:
    if len(names) > _FEW_NAMED:
        return f"{n:,} {kind}s"
    return f"{kind}{'s' * (n > 1)} {', '.join(names)}"
