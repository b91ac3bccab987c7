"""The selection of an address: by its ids, by their key, or by the name that it is kept under."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from plateviz.dashboard.address_parts import quoted
from plateviz.dashboard.selection.selected import Find, checked_name, keys_of, parsed
from solver.data.subset import KINDS, NOTHING, Subset
from solver.errors import InputError


class Restored(NamedTuple):
    """What an address selects.

    Attributes
    ----------
    selected : the selection
    name : under which the address keeps it, if nothing is kept under that name yet; else empty
    problems : what of the address is invalid or gone, in words
    """

    selected: Subset
    name: str
    problems: list[str]


def restored(address: Mapping[str, str], find: Find, kept: Mapping[str, Subset]) -> Restored:
    """Return what an address selects.

    Parameters
    ----------
    find : looks for what is too large for an address, as in `parsed`
    kept : name -> selection that is kept under it by now
    """
    name, problems = _name(address)
    of_name = kept.get(name, NOTHING)
    if name in kept and not any(kind in address for kind in KINDS):
        return Restored(of_name, "", problems)

    keys = keys_of(of_name)

    def found_or_kept(kind: str, key: str) -> frozenset[Any] | None:
        is_kept = keys.get(kind) == key
        return of_name.by_kind()[kind] if is_kept else find(kind, key)

    selected, invalid = parsed(address, found_or_kept)
    problems += invalid
    if name in kept:
        if of_name != selected:
            problems.append(f"selection: something else is kept under {quoted(name)} by now")
    elif name and (keys_of(selected) or invalid or not selected):
        problems.append(f"selection: nothing is kept under {quoted(name)}")
    is_new = bool(name) and name not in kept and bool(selected) and not problems
    return Restored(selected, name if is_new else "", problems)


def _name(address: Mapping[str, str]) -> tuple[str, list[str]]:
    """Return the name of the selection of an address, empty if there is none, and why in words."""
    if "selection" not in address:
        return "", []
    try:
        return checked_name(address["selection"]), []
    except InputError as error:
        return "", [str(error)]
