"""Labelled ticks of logarithmic axes."""

import math

_STEPS = (1, 2, 3, 5)
_FINE_STEPS = (1, 1.5, 2, 2.5, 3, 4, 5, 6, 8)
_FINE_BELOW = 6.0


def log_ticks(
    limits: tuple[float, float], *, whole: bool = False, powers_only: bool = False
) -> list[tuple[float, str]]:
    """Return round numbers within a decade of `limits`, with their labels.

    Over short ranges Bokeh's log ticks are linear, and its labels round to powers of ten.

    Parameters
    ----------
    limits : of the axis
    whole : whether to return whole numbers only
    powers_only : whether to return powers of ten only
    """
    fine = limits[1] < _FINE_BELOW * limits[0]
    steps = (1,) if powers_only else _FINE_STEPS if fine else _STEPS
    powers = range(math.floor(math.log10(limits[0])) - 1, math.ceil(math.log10(limits[1])) + 1)
    ticks = [float(f"{step}e{power}") for power in powers for step in steps]
    return [(tick, _label(tick)) for tick in ticks if not whole or tick == int(tick) > 0]


def _label(tick: float) -> str:
    return f"{tick:,.0f}" if tick == int(tick) else f"{tick:g}"
