"""Settings of a fit as keywords; text values are written as on the command line."""

import inspect
from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from typing import Any, TypeVar

from solver.data.engine_settings import ENGINE_OPTIONS, engine_settings
from solver.data.setting_kinds import Choice, Positive, Setting, Switch, Whole
from solver.data.settings import SETTINGS, FitSettings
from solver.data.text_setting import LeftOut, Texts
from solver.errors import InputError

_Function = TypeVar("_Function", bound=Callable)

# Keyword -> field of `FitSettings`.
_FIELDS = {one.keyword: name for name, one in SETTINGS.items() if one.keyword}
KEYWORDS: dict[str, Setting] = {
    **{keyword: SETTINGS[name] for keyword, name in _FIELDS.items()},
    **ENGINE_OPTIONS,
}
"""Keyword -> its setting: the keywords of `fit` and `what_if` in a notebook."""


def takes_settings(function: _Function) -> _Function:
    """Add the keywords to the signature of a function with `**settings`, for Tab completion."""
    signature = inspect.signature(function)
    own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
    keywords = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=_annotation(one))
        for name, one in KEYWORDS.items()
    ]
    described: Any = function
    described.__signature__ = signature.replace(parameters=[*own, *keywords])
    return function


def settings_with(base: FitSettings, changes: Mapping[str, object]) -> FitSettings:
    """Return `base` with some settings changed.

    Parameters
    ----------
    changes : keyword of `KEYWORDS` -> value; priors and centres are changed by name, exclusions
        are replaced

    Raises
    ------
    InputError
        If there is no such keyword, or its value is invalid.
    """
    _check_names(changes)
    fields = {
        _FIELDS[keyword]: _value(keyword, base, value)
        for keyword, value in changes.items()
        if keyword in _FIELDS
    }
    options = {name: value for name, value in changes.items() if name in ENGINE_OPTIONS}
    return base.with_(**fields, **(_engines(options) if options else {}))


def _check_names(changes: Mapping[str, object]) -> None:
    for name in changes:
        if name not in KEYWORDS:
            near = get_close_matches(name, KEYWORDS, 1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise InputError(
                f"expected settings of a fit out of {', '.join(KEYWORDS)}, found {name!r}{hint}"
            )


def _value(keyword: str, base: FitSettings, value: object) -> object:
    """Return the value of a field of `FitSettings` from the value of its keyword."""
    one = KEYWORDS[keyword]
    if not isinstance(one, Texts):
        return value
    texts = _exclusions(value) if isinstance(one, LeftOut) else _assignments(keyword, value)
    return one.merged(getattr(base, _FIELDS[keyword]), one.parse(texts))


def _engines(options: Mapping[str, Any]) -> dict[str, object]:
    for name, value in options.items():
        if not (name == "steps" and value is None):
            ENGINE_OPTIONS[name].check(f"svi {name}", value)
    return engine_settings(**options)


def _assignments(keyword: str, values: object) -> list[str]:
    if not isinstance(values, Mapping):
        raise InputError(
            f"{keyword}: expected names and values such as {{'distortion_x': '10um'}}, "
            f"found {values!r}"
        )
    return [f"{name}={value}" for name, value in values.items()]


def _exclusions(exclude: object) -> list[str]:
    if isinstance(exclude, str):
        return [exclude]
    if not isinstance(exclude, Iterable):
        raise InputError(f"exclude: expected texts such as 'detector=2', found {exclude!r}")
    return [str(text) for text in exclude]


def _annotation(one: Setting) -> object:
    if isinstance(one, LeftOut):
        return str | Iterable[str]
    kinds = {Switch: bool, Whole: int, Positive: float, Choice: str}
    return Mapping[str, object] if isinstance(one, Texts) else kinds.get(type(one), str)


def check_numbers(name: str, numbers: object, least: int) -> None:
    """Raise `InputError` unless `numbers` are whole numbers of at least `least`."""
    is_list = isinstance(numbers, list | tuple | range)
    if not is_list or not all(isinstance(n, int) and n >= least for n in numbers):  # type: ignore[union-attr]
        raise InputError(f"{name}: expected whole numbers from {least}, found {numbers!r}")
