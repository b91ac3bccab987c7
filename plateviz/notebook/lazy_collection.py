"""LazyCollection: figures or tables by name, with Tab completion."""

from collections.abc import Callable, Iterator, Mapping
from difflib import get_close_matches
from typing import Generic, TypeVar

from solver.errors import InputError

_Item = TypeVar("_Item")


class LazyCollection(Generic[_Item]):
    """Items that are made on access, by name or by attribute.

    `figures["residual-map"]` and `figures.residual_map` are the same: an attribute has "_" for "-".
    """

    def __init__(self, kind: str, make: Mapping[str, Callable[[], _Item]]) -> None:
        """Set the functions that make the items.

        Parameters
        ----------
        kind : what an item is, such as "figure", for messages
        make : name -> function that returns the item
        """
        self._kind, self._make = kind, dict(make)

    def __getitem__(self, name: str) -> _Item:
        """Return an item; for an unknown name, InputError lists all names."""
        if name not in self._make:
            raise InputError(unknown_name(self._kind, name, self._make))
        return self._make[name]()

    def __getattr__(self, name: str) -> _Item:
        """Return an item by its name as an attribute."""
        # Python looks up private names as well, also before __init__ has run.
        names = {} if name.startswith("_") else {n.replace("-", "_"): n for n in self._make}
        if name not in names:
            raise AttributeError(unknown_name(self.__dict__.get("_kind", "item"), name, names))
        return self[names[name]]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._make)

    def __contains__(self, name: object) -> bool:
        """Return whether there is an item of that name."""
        return name in self._make

    def __len__(self) -> int:
        """Return the number of items."""
        return len(self._make)

    def __dir__(self) -> list[str]:
        """List the attributes, for Tab completion."""
        return [*super().__dir__(), *(name.replace("-", "_") for name in self._make)]

    def __repr__(self) -> str:
        """Return the names."""
        return f"{self._kind}s: {', '.join(self._make)}"

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._make)


def unknown_name(kind: str, name: object, names: Mapping[str, object]) -> str:
    """Return the message for an unknown name: all known names, and the nearest."""
    near = get_close_matches(str(name), names, 1)
    hint = f"; did you mean {near[0]}?" if near else ""
    return f"expected a {kind} out of {', '.join(names) or 'none'}, found {name!r}{hint}"
