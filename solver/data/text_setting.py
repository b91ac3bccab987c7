"""Settings written as short texts: prior widths, shifts of prior centres, and exclusions."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from solver.data.exclusions import parse_exclusions
from solver.data.parameters import BY_NAME
from solver.data.prior_text import (
    check_shift,
    check_width,
    format_shift,
    format_width,
    parse_shift,
    parse_width,
)
from solver.data.setting_kinds import Setting
from solver.data.subset import Subset
from solver.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Texts(Setting):
    """A setting that is written as any number of short texts."""

    metavar: str = ""
    example: str = ""

    def parse(self, texts: Iterable[str]) -> Any:  # noqa: ANN401
        """Return the value that the texts give; `InputError` names an invalid one."""
        raise TypeError(f"{type(self).__name__} does not read texts")

    def parse_line(self, line: str) -> Any:  # noqa: ANN401
        """Return the value that the texts of a line give, with commas or spaces between them."""
        return self.parse(line.replace(",", " ").split())

    def texts(self, value: Any) -> list[str]:  # noqa: ANN401
        """Return a value as texts that `parse` reads."""
        raise TypeError(f"{type(self).__name__} does not write {value!r}")

    def merged(self, base: Any, value: Any) -> Any:  # noqa: ANN401
        """Return `base` changed by `value`: a mapping is updated, another value is replaced."""
        return {**base, **value} if isinstance(base, Mapping) else value


@dataclass(frozen=True, kw_only=True)
class PriorWidths(Texts):
    """Prior widths of parameter groups, by name, in the group's `width_unit`."""

    def check(self, name: str, value: Mapping[str, float]) -> None:
        """Raise `InputError` for a width that no prior can have."""
        del name
        for group, width in value.items():
            check_width(group, width)

    def to_plain(self, value: Mapping[str, float]) -> dict[str, float]:
        """Return a copy."""
        return dict(value)

    def parse(self, texts: Iterable[str]) -> dict[str, float]:
        """Read texts such as "distortion_x=0.5um" or "position_angle=flat"."""
        widths = {}
        for text in texts:
            group, found, width = text.partition("=")
            if not found:
                raise InputError(f"--{self.option}: expected {self.metavar}, found {text!r}")
            name = group.strip()
            if name in widths:
                raise InputError(f"--{self.option}: expected one width for {name}, found two")
            widths[name] = parse_width(name, width)
        return widths

    def texts(self, value: Mapping[str, float]) -> list[str]:
        """Return a text per group."""
        return [f"{group}={format_width(group, width)}" for group, width in value.items()]

    def described(self, value: Mapping[str, float], default: object) -> list[str]:
        """Return a phrase for each width that is not the group's default."""
        del default
        changed = {name: width for name, width in value.items() if width != BY_NAME[name].width}
        return [f"{name} {format_width(name, width)}" for name, width in changed.items()]


@dataclass(frozen=True, kw_only=True)
class PriorShifts(Texts):
    """Shifts of prior centres, by "GROUP" or "GROUP[ELEMENT]", in the group's unit."""

    def check(self, name: str, value: Mapping[str, float]) -> None:
        """Raise `InputError` for a shift of an unknown group, or one that is not finite."""
        del name
        for element, shift in value.items():
            check_shift(element, shift)

    def to_plain(self, value: Mapping[str, float]) -> dict[str, float]:
        """Return a copy."""
        return dict(value)

    def parse(self, texts: Iterable[str]) -> dict[str, float]:
        """Read texts such as "focal_length=100um" or "detector_x[2]=-5um"."""
        shifts: dict[str, float] = {}
        for text in texts:
            name, shift = parse_shift(text)
            if name in shifts:
                raise InputError(f"--{self.option}: expected one shift for {name}, found two")
            shifts[name] = shift
        return shifts

    def texts(self, value: Mapping[str, float]) -> list[str]:
        """Return a text per shift."""
        return [format_shift(name, shift) for name, shift in value.items()]

    def described(self, value: Mapping[str, float], default: object) -> list[str]:
        """Return a phrase for each shift."""
        del default
        return self.texts(value)


@dataclass(frozen=True, kw_only=True)
class LeftOut(Texts):
    """Sources, exposures and detectors whose measurements a fit does not use."""

    def to_plain(self, value: Subset) -> dict[str, list]:
        """Return the ids by kind."""
        return value.to_dict()

    def from_plain(self, plain: Mapping[str, Iterable]) -> Subset:
        """Return what `to_plain` wrote."""
        return Subset.from_dict(plain)

    def parse(self, texts: Iterable[str]) -> Subset:
        """Read texts such as "detector=2" or "exposure=0/17"."""
        return parse_exclusions(texts)

    def texts(self, value: Subset) -> list[str]:
        """Return a text per exclusion."""
        return [name.replace(" ", "=") for name in value.names()]

    def described(self, value: Subset, default: object) -> list[str]:
        """Return a phrase for each exclusion; of many sources or exposures, their number."""
        del default
        return [self.phrase.format(name) for name in value.short_names()]
