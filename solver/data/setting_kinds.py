"""Setting: the description of one field of `FitSettings`, from which its interfaces are derived.

The interfaces are the checks, the command-line options, the notebook's keywords, the dashboard's
controls, the cards of a FITS header, the run file and the description of a solution.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import MISSING, Field, asdict, dataclass, field, fields
from enum import Enum
from numbers import Real
from typing import Any

from solver.errors import InputError


class Change(Enum):
    """How the dashboard responds to a change of a setting."""

    WHAT_IF = "at once, from the last fit"
    REFIT = "at once, by a new fit"
    ON_REQUEST = "when a fit is requested"


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One setting.

    Attributes
    ----------
    label : label of the dashboard's control, and comment of the FITS card
    help : text for `--help`, tooltips and the documentation
    unit : unit of the value; "" for none
    keyword : keyword in the notebook; "" if not offered there
    option : name on the command line; "" if not offered there
    commands : commands that have the option
    control : whether the dashboard has a control for it
    change : how the dashboard responds to a change
    is_identity : whether the value affects the solution
    selects : whether the value decides which measurements are used
    card : FITS keyword; "" for none
    phrase : text of a value in the description of a solution, with {} for the value
    is_always_described : whether the description includes the default value
    is_cause : whether it adds an effect to the model that the paper's lacks
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
    is_cause: bool = False

    def check(self, name: str, value: Any) -> None:  # noqa: ANN401 any setting
        """Raise `InputError` if `value` is invalid for the setting called `name`."""

    def to_plain(self, value: Any) -> object:  # noqa: ANN401
        """Return the value as plain JSON values; `from_plain` reads them back."""
        return value

    def from_plain(self, plain: Any) -> Any:  # noqa: ANN401
        """Return the value that `to_plain` wrote."""
        return plain

    def card_value(self, value: Any) -> object:  # noqa: ANN401
        """Return the value of the FITS card."""
        plain = self.to_plain(value)
        return plain if isinstance(plain, bool | int | float | str) else json.dumps(plain)

    def described(self, value: Any, default: Any) -> list[str]:  # noqa: ANN401
        """Return the phrases that describe a value; none for a default that is not described."""
        is_described = value != default or self.is_always_described
        return [self.phrase.format(value)] if is_described else []


@dataclass(frozen=True, kw_only=True)
class Switch(Setting):
    """A setting that is on or off; `phrase` describes the value that is not the default."""

    def check(self, name: str, value: object) -> None:
        """Raise `InputError` if the value is not a bool."""
        if not isinstance(value, bool):
            raise InputError(f"{name}: expected True or False, found {value!r}")


@dataclass(frozen=True, kw_only=True)
class Whole(Setting):
    """An integer from `low` to `high`; a `high` of None means no upper bound."""

    low: int = 1
    high: int | None = None

    def check(self, name: str, value: object) -> None:
        """Raise `InputError` if the value is no int, is a bool, or is out of bounds."""
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        if is_whole and self.low <= value <= (self.high or math.inf):  # type: ignore[operator]
            return
        if self.high is None:
            raise InputError(f"expected {name} to be {self.low} or more, found {value!r}")
        raise InputError(
            f"expected a {self.label.lower()} from {self.low} to {self.high}, found {value!r}"
        )


@dataclass(frozen=True, kw_only=True)
class Degree(Whole):
    """A degree from 2 to `high`, or 0 for none: lower distortion terms do not exist."""

    low: int = 0

    def check(self, name: str, value: object) -> None:
        """Raise `InputError` for 1 as well."""
        try:
            super().check(name, value)
        except InputError as error:
            raise InputError(self._expected(value)) from error
        if value == 1:
            raise InputError(self._expected(value))

    def _expected(self, value: object) -> str:
        return f"{self.label.lower()}: expected 0 or 2 to {self.high}, found {value!r}"


@dataclass(frozen=True, kw_only=True)
class Positive(Setting):
    """A positive number."""

    def check(self, name: str, value: object) -> None:
        """Raise `InputError` for zero, negative numbers, NaN, infinity, and what is no number."""
        is_number = isinstance(value, Real) and not isinstance(value, bool)
        if not is_number or not 0.0 < value < math.inf:  # type: ignore[operator]
            raise InputError(f"expected a positive {name}, found {value!r}")


@dataclass(frozen=True, kw_only=True)
class Choice(Setting):
    """One of the names in `names`."""

    names: tuple[str, ...] = ()

    def check(self, name: str, value: object) -> None:
        """Raise `InputError` for other names."""
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
        """Return a phrase for each field that differs from its default."""
        names = [
            f.name for f in fields(value) if getattr(value, f.name) != getattr(default, f.name)
        ]
        return [f"{self.label} {name} {getattr(value, name)}" for name in names]


def setting(default: Any, what: Setting) -> Any:  # noqa: ANN401 the type of the field
    """Return a dataclass field with its setting; each instance gets its own copy of a mapping."""
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
    raise TypeError(f"{one.name}: expected a default, found none")


def check_fields(values: Any, prefix: str = "") -> None:  # noqa: ANN401 a dataclass of settings
    """Check every field; `InputError` names the first invalid one."""
    for name, what in settings_of(type(values)).items():
        what.check(f"{prefix}{name}", getattr(values, name))
