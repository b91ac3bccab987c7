"""The choices of a fit as keywords, with the words of the command line for their values."""

import inspect
from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from typing import Any, TypedDict, TypeVar, get_type_hints

from solver.data.exclusions import parse_exclusions
from solver.data.prior_text import parse_shift, parse_width
from solver.data.settings import FitSettings, NutsSettings, svi_settings
from solver.errors import InputError

_Function = TypeVar("_Function", bound=Callable)
_SWITCHES = ("aberration", "robust", "compare_orders")
_PLAIN = ("order", "engine", "thin", *_SWITCHES)


class Choices(TypedDict, total=False):
    """What a fit is to use; what is not named stays as it is.

    Attributes
    ----------
    order : of the distortion, 0 to 9
    engine : "gauss-newton", "svi" or "nuts"
    priors : group -> width of its prior, such as "10um", "flat", a number in the group's unit or a
        quantity
    centres : "GROUP" or "GROUP[ELEMENT]" -> shift of the prior's centre, such as "-5um"
    exclude : measurements to leave out: "source=ID", "exposure=FIELD/PLATE", "detector=ID"
    aberration : whether stellar aberration is modelled
    robust : whether outliers are looked for and left out
    compare_orders : whether every order is solved beside this one
    thin : one in so many sources is used
    steps : of the svi engine, over which its learning rate falls
    seed : of svi and nuts
    """

    order: int
    engine: str
    priors: Mapping[str, object]
    centres: Mapping[str, object]
    exclude: str | Iterable[str]
    aberration: bool
    robust: bool
    compare_orders: bool
    thin: int
    steps: int
    seed: int


_KINDS = get_type_hints(Choices)


def takes_choices(function: _Function) -> _Function:
    """Let the signature of a function with `**choices` name them, for who asks or presses Tab."""
    signature = inspect.signature(function)
    own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
    keyword = inspect.Parameter.KEYWORD_ONLY
    choices = [inspect.Parameter(name, keyword, annotation=kind) for name, kind in _KINDS.items()]
    named: Any = function
    named.__signature__ = signature.replace(parameters=[*own, *choices])
    return function


def settings_with(base: FitSettings, choices: Mapping[str, object]) -> FitSettings:
    """Return the settings that choices make of others.

    Parameters
    ----------
    choices : as `Choices`; priors and centres are changed by name, what is excluded as a whole

    Raises
    ------
    InputError
        If there is no such choice, or its value cannot be used.
    """
    _check_names(choices)
    changes = {name: choices[name] for name in _PLAIN if name in choices}
    if "priors" in choices:
        changes["prior_widths"] = {**base.prior_widths, **_widths(choices["priors"])}
    if "centres" in choices:
        changes["prior_shifts"] = {**base.prior_shifts, **_shifts(choices["centres"])}
    if "exclude" in choices:
        changes["exclusions"] = parse_exclusions(_texts(choices["exclude"]))
    return base.with_(**changes, **_of_engines(choices))


def _check_names(choices: Mapping[str, object]) -> None:
    for name in choices:
        if name not in _KINDS:
            near = get_close_matches(name, _KINDS, 1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise InputError(
                f"expected choices of a fit out of {', '.join(_KINDS)}, found {name!r}{hint}"
            )
    for name in _SWITCHES:
        if not isinstance(choices.get(name, True), bool):
            raise InputError(f"{name}: expected True or False, found {choices[name]!r}")


def _of_engines(choices: Mapping[str, object]) -> dict[str, object]:
    if "steps" not in choices and "seed" not in choices:
        return {}
    steps, seed = choices.get("steps"), choices.get("seed", 0)
    if not (steps is None or (isinstance(steps, int) and steps > 0)):
        raise InputError(f"steps: expected a number of 1 or more, found {steps!r}")
    return {
        "svi": svi_settings(None, steps, seed),  # type: ignore[arg-type]
        "nuts": NutsSettings(seed=seed),  # type: ignore[arg-type]
    }


def _widths(priors: object) -> dict[str, float]:
    return {name: parse_width(name, str(width)) for name, width in _named("priors", priors)}


def _shifts(centres: object) -> dict[str, float]:
    return dict(parse_shift(f"{name}={shift}") for name, shift in _named("centres", centres))


def _named(choice: str, values: object) -> Iterable[tuple[str, object]]:
    if not isinstance(values, Mapping):
        raise InputError(
            f"{choice}: expected names and values such as {{'distortion_x': '10um'}}, "
            f"found {values!r}"
        )
    return [(str(name), value) for name, value in values.items()]


def _texts(exclude: object) -> list[str]:
    if isinstance(exclude, str):
        return [exclude]
    if not isinstance(exclude, Iterable):
        raise InputError(f"exclude: expected texts such as 'detector=2', found {exclude!r}")
    return [str(text) for text in exclude]
