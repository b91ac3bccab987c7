"""Setting: everything known of one field of `FitSettings`, from which its interfaces are derived.

Checks, the command line, the notebook's keywords, the dashboard's controls, the cards of a FITS
header, the run file and the description of a solution all come from the settings of the fields.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import MISSING, Field, asdict, dataclass, field, fields
from enum import Enum
from typing import Any

from solver.errors import InputError


class Change(Enum):
    """How the dashboard answers a change of a setting."""

    WHAT_IF = "at once, from the last fit"
    REFIT = "at once, by a new fit"
    ON_REQUEST = "when a fit is asked for"


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One setting.

    Attributes
    ----------
    label : name for people: of a control, and the comment of its FITS card
    help : one sentence for `--help`, tooltips and the documents
    unit : unit of the value; "" for none
    keyword : name in the notebook; "" where it is not offered
    option : name on the command line; "" where it is not offered
    commands : commands that have the option
    control : whether the dashboard has a control for it
    change : how the dashboard answers a change
    is_identity : whether another value makes another solution
    selects : whether it decides which measurements are used
    card : FITS keyword; "" for none
    phrase : text of a value in the description of a solution, with {} for the value
    is_always_described : whether the default is described as well
    """

    label: str
    help: str
    unit: str = ""
    keyword: str = ""
    option: str = ""
    commands: tuple[str, ...] = ("fit", "survey")
    control: bool = False
    change: Change = Change.ON_REQUEST
    is_identity: bool = True
    selects: bool = False
    card: str = ""
    phrase: str = "{}"
    is_always_described: bool = False

    @property
    def what_if(self) -> bool:
        """Whether a what-if can answer a change of it."""
        return self.change is Change.WHAT_IF

    def check(self, name: str, value: Any) -> None:  # noqa: ANN401 any setting
        """Raise `InputError` if `value` cannot be that of the setting called `name`."""

    def to_plain(self, value: Any) -> object:  # noqa: ANN401
        """Return the value as plain JSON values; `from_plain` reads them back."""
        return value

    def from_plain(self, plain: Any) -> Any:  # noqa: ANN401
        """Return the value that `to_plain` wrote."""
        return plain

    def card_value(self, value: Any) -> object:  # noqa: ANN401
        """Return the value as one FITS card holds it."""
        plain = self.to_plain(value)
        return plain if isinstance(plain, bool | int | float | str) else json.dumps(plain)

    def described(self, value: Any, default: Any) -> list[str]:  # noqa: ANN401
        """Return phrases for a value; none for the default unless it is always described."""
        told = value != default or self.is_always_described
        return [self.phrase.format(value)] if told else []


@dataclass(frozen=True, kw_only=True)
class Switch(Setting):
    """A setting that is on or off; `phrase` describes what is not the default."""

    def check(self, name: str, value: object) -> None:
        """Refuse what is not a bool."""
        if not isinstance(value, bool):
            raise InputError(f"{name}: expected True or False, found {value!r}")


@dataclass(frozen=True, kw_only=True)
class Whole(Setting):
    """A whole number from `low` to `high`; None for no upper bound."""

    low: int = 1
    high: int | None = None

    def check(self, name: str, value: object) -> None:
        """Refuse other numbers, and True and False."""
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        if is_whole and self.low <= value <= (self.high or math.inf):  # type: ignore[operator]
            return
        if self.high is None:
            raise InputError(f"expected {name} to be {self.low} or more, found {value!r}")
        raise InputError(
            f"expected a {self.label.lower()} from {self.low} to {self.high}, found {value!r}"
        )


@dataclass(frozen=True, kw_only=True)
class Positive(Setting):
    """A positive number."""

    def check(self, name: str, value: float) -> None:
        """Refuse zero, negative numbers and NaN."""
        if not value > 0.0:
            raise InputError(f"expected a positive {name}, found {value!r}")


@dataclass(frozen=True, kw_only=True)
class Choice(Setting):
    """One of some names."""

    names: tuple[str, ...] = ()

    def check(self, name: str, value: object) -> None:
        """Refuse other names."""
        del name
        if value not in self.names:
            raise InputError(
                f"expected an {self.label.lower()} out of {', '.join(self.names)}, found {value!r}"
            )


@dataclass(frozen=True, kw_only=True)
class EngineSettings(Setting):
    """The settings of one engine: a dataclass of plain values."""

    kind: type = object

    def to_plain(self, value: Any) -> dict[str, Any]:  # noqa: ANN401
        """Return the fields by name."""
        return asdict(value)

    def from_plain(self, plain: Mapping[str, Any]) -> Any:  # noqa: ANN401
        """Return what `to_plain` wrote."""
        return self.kind(**plain)

    def described(self, value: Any, default: Any) -> list[str]:  # noqa: ANN401
        """Return the fields that are not their defaults."""
        names = [
            f.name for f in fields(value) if getattr(value, f.name) != getattr(default, f.name)
        ]
        return [f"{self.label} {name} {getattr(value, name)}" for name in names]


def setting(default: Any, what: Setting) -> Any:  # noqa: ANN401 the type of the field
    """Return a dataclass field with its setting; a mapping is made anew for each instance."""
    if isinstance(default, Mapping):
        return field(default_factory=lambda: dict(default), metadata={"setting": what})
    return field(default=default, metadata={"setting": what})


def settings_of(kind: type) -> dict[str, Setting]:
    """Return the settings of a dataclass's fields, by name."""
    return {one.name: one.metadata["setting"] for one in fields(kind)}


def defaults_of(kind: type) -> dict[str, Any]:
    """Return the default of every field of a dataclass."""
    return {one.name: _default(one) for one in fields(kind)}


def _default(one: Field) -> Any:  # noqa: ANN401
    if one.default is not MISSING:
        return one.default
    if one.default_factory is not MISSING:
        return one.default_factory()
    raise TypeError(f"{one.name}: a setting has a default")


def check_fields(values: Any, prefix: str = "") -> None:  # noqa: ANN401 a dataclass of settings
    """Check every field; `InputError` names the first that cannot be used."""
    for name, what in settings_of(type(values)).items():
        what.check(f"{prefix}{name}", getattr(values, name))
