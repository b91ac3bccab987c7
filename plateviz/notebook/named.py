"""Named: figures or tables by their names, as attributes for those who press Tab."""

from collections.abc import Callable, Iterator, Mapping
from difflib import get_close_matches
from typing import Generic, TypeVar

from solver.errors import InputError

_Thing = TypeVar("_Thing")


class Named(Generic[_Thing]):
    """Things made when they are asked for, by name: `these["residual-map"]`, `these.residual_map`.

    A name is an attribute with "_" where it has "-".
    """

    def __init__(self, kind: str, make: Mapping[str, Callable[[], _Thing]]) -> None:
        """Give what `make` makes, by name.

        Parameters
        ----------
        kind : what one of them is called, such as "figure"
        """
        self._kind, self._make = kind, dict(make)

    def __getitem__(self, name: str) -> _Thing:
        """Return the one of that name; InputError names them all if there is none."""
        if name not in self._make:
            raise InputError(no_such(self._kind, name, self._make))
        return self._make[name]()

    def __getattr__(self, name: str) -> _Thing:
        """Return the one whose name this is, written as an attribute."""
        # Python asks for many names of its own, also before __init__ has run.
        names = {} if name.startswith("_") else {n.replace("-", "_"): n for n in self._make}
        if name not in names:
            raise AttributeError(no_such(self.__dict__.get("_kind", "thing"), name, names))
        return self[names[name]]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._make)

    def __contains__(self, name: object) -> bool:
        """Return whether there is one of that name."""
        return name in self._make

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._make)

    def __dir__(self) -> list[str]:
        """List the attributes."""
        return [*super().__dir__(), *(name.replace("-", "_") for name in self._make)]

    def __repr__(self) -> str:
        """Return the names."""
        return f"{self._kind}s: {', '.join(self._make)}"

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._make)


def no_such(kind: str, name: object, names: Mapping[str, object]) -> str:
    """Say that there is no thing of a name, and which there are."""
    near = get_close_matches(str(name), names, 1)
    hint = f"; did you mean {near[0]}?" if near else ""
    return f"expected a {kind} out of {', '.join(names) or 'none'}, found {name!r}{hint}"
