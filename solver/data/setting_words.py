"""Settings of a fit as words of the command line without dashes, such as "order=3 no-aberration".

An address of the dashboard and a saved view name a solution by them.
"""

import re
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from solver.data.engine_settings import ENGINE_OPTIONS, engine_options, engine_settings
from solver.data.setting_kinds import Positive, Setting, Switch, Whole
from solver.data.settings import DEFAULTS, SETTINGS, FitSettings
from solver.data.text_setting import Texts
from solver.errors import InputError

_WHOLE = re.compile(r"-?[0-9]{1,19}")
_OFF = "no-"


class Option(NamedTuple):
    """An option of the command line.

    Attributes
    ----------
    name : without dashes, such as "order" or "no-aberration"
    value : None for a switch
    commands : commands that have the option
    """

    name: str
    value: str | None
    commands: tuple[str, ...]

    @property
    def word(self) -> str:
        """The option as one word."""
        # Only the units of prior widths are set apart, and are read without it as well.
        return self.name if self.value is None else f"{self.name}={self.value.replace(' ', '')}"


def options_of(settings: FitSettings) -> Iterator[Option]:
    """Yield the options that give the settings, without those of the paper's values."""
    for name, one in SETTINGS.items():
        value = getattr(settings, name)
        if one.option and value != DEFAULTS[name]:
            yield from _options(one, value)
    for name, value in engine_options(settings.svi, settings.nuts).items():
        yield Option(name, str(value), ENGINE_OPTIONS[name].commands)


def setting_words(settings: FitSettings) -> list[str]:
    """Return the settings as words, always with the order; `parse_setting_words` reads them."""
    words = [option.word for option in options_of(settings)]
    order = Option(SETTINGS["order"].option, str(settings.order), ()).word
    return words if order in words else [order, *words]


def parse_setting_words(words: Iterable[str]) -> FitSettings:
    """Return the settings that words give; all others are the paper's.

    Raises
    ------
    InputError
        If a word is no setting, or its value is invalid.
    """
    return FitSettings(**setting_values(words))


def setting_values(words: Iterable[str]) -> dict[str, Any]:
    """Return the fields of `FitSettings` that words give, by name; `InputError` as above."""
    fields: dict[str, Any] = {}
    texts: dict[str, list[str]] = {}
    engines: dict[str, Any] = {}
    for word in words:
        option, found, value = word.partition("=")
        if option in ENGINE_OPTIONS:
            engines[option] = _plain(ENGINE_OPTIONS[option], value)
            continue
        name, one = _setting(option, word)
        if isinstance(one, Texts):
            texts.setdefault(name, []).append(value)
        elif isinstance(one, Switch) and not found:
            fields[name] = not option.startswith(_OFF)
        else:
            fields[name] = _plain(one, value)
    fields |= {name: SETTINGS[name].parse(given) for name, given in texts.items()}  # type: ignore[attr-defined]
    return fields | (engine_settings(**engines) if engines else {})


def _options(one: Setting, value: Any) -> list[Option]:  # noqa: ANN401 any setting
    if isinstance(one, Texts):
        return [Option(one.option, text, one.commands) for text in one.texts(value)]
    if isinstance(one, Switch):
        return [Option(f"{'' if value else _OFF}{one.option}", None, one.commands)]
    return [Option(one.option, str(value), one.commands)]


def _setting(option: str, word: str) -> tuple[str, Setting]:
    """Return name and description of the setting that an option gives."""
    for name, one in SETTINGS.items():
        names = (one.option, f"{_OFF}{one.option}") if isinstance(one, Switch) else (one.option,)
        if one.option and option in names:
            return name, one
    raise InputError(f"expected settings of a fit such as order=3, found {word[:40]!r}")


def _plain(one: Setting, text: str) -> int | float | str:
    """Return the value in a text of a setting that is written as one number or name."""
    if isinstance(one, Whole):
        if not _WHOLE.fullmatch(text):
            raise InputError(f"{one.option}: expected a whole number, found {text[:40]!r}")
        return int(text)
    if isinstance(one, Positive):
        try:
            return float(text)
        except ValueError:
            raise InputError(f"{one.option}: expected a number, found {text[:40]!r}") from None
    return text
