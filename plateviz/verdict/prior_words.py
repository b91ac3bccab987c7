"""What is said of a prior that contradicts the measurements."""

from collections.abc import Iterable

from plateviz.tables.rounded import rounded
from plateviz.verdict.cause_case import Case, Said
from solver.data.parameters import BY_NAME, PARAMETERS
from solver.data.prior_text import format_width, split_name
from solver.data.settings import FitSettings

# Instruments are known to better than so many widths.
_NOT_BY_CHANCE = 30.0


def said_of_prior(case: Case) -> Said:
    """Return what is said of a prior that contradicts the values of its parameters."""
    group, settings = PARAMETERS[case.found.test.what[0]], case.result.settings
    width, rms = settings.width(group.name), case.found.test.statistic
    words = (
        f"The values lie {rounded(rms, 3)} times as far from its centre, rms, as chance makes "
        f"them. The width is {rounded(width, 3)} {group.width_unit}".rstrip()
        + "."
    )
    title = f"the prior of {group.name} contradicts the measurements"
    if group.name in narrowed_priors(settings):
        return Said("prior", title, words, "give it its usual width", usual_priors([group.name]))
    if any(split_name(name)[0] is group for name in settings.prior_shifts):
        words += " Its centre was shifted for this fit."
        return Said("prior", title, words, "take back the shift of its centre")
    wider = float(f"{2.0 * rms * width:.1g}")
    action = "widen it"
    if rms > _NOT_BY_CHANCE:
        checked = "check the instrument, and the units and origin of the measurements"
        action = f"{checked}; if they are right, {action}"
    return Said("prior", title, words, action, (_option(group.name, wider),))


def narrowed_priors(settings: FitSettings) -> list[str]:
    """Return the groups of parameters whose priors were set to less than their usual widths."""
    return [one for one in settings.prior_widths if settings.width(one) < BY_NAME[one].width]


def widened_priors(settings: FitSettings) -> list[str]:
    """Return the groups of parameters whose priors were set to more than their usual widths."""
    return [one for one in settings.prior_widths if settings.width(one) > BY_NAME[one].width]


def usual_priors(names: Iterable[str]) -> tuple[str, ...]:
    """Return the options of a fit that give groups of parameters their usual prior widths."""
    return tuple(_option(name, BY_NAME[name].width) for name in names)


def _option(name: str, width: float) -> str:
    return f"--prior {name}={format_width(name, width).replace(' ', '')}"
