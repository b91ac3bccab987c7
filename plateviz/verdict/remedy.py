"""Remedies: what the settings of a fit become if what a verdict says is done."""

from collections.abc import Iterable, Mapping
from typing import Any

from solver.data.setting_words import setting_values
from solver.data.settings import FitSettings
from solver.data.subset import Subset


def remedied(settings: FitSettings, options: Iterable[str]) -> FitSettings | None:
    """Return settings with options added, or None if these change nothing.

    Parameters
    ----------
    settings : of the solution that has the flaw
    options : of `plateviz fit`, as in `plateviz.verdict.causes.Cause`

    Raises
    ------
    InputError
        If an option is no setting, or has an invalid value.
    """
    words = [option.removeprefix("--").replace(" ", "=", 1) for option in options]
    given = setting_values(words)
    changed = settings.with_(**{name: _added(settings, name, one) for name, one in given.items()})
    return None if changed == settings else changed


def _added(settings: FitSettings, name: str, value: Any) -> Any:  # noqa: ANN401 any setting
    """Return a value with that of the settings; degrees and prior widths do not become less."""
    before = getattr(settings, name)
    if isinstance(value, Subset):
        return before | value
    if isinstance(value, Mapping):
        widths = {group: max(settings.width(group), width) for group, width in value.items()}
        return {**before, **widths}
    return max(before, value)
