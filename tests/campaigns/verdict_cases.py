"""Defects that can be seen in one orbit: their amplitudes, their causes, and how to model them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from solver.simulate.defects.table import BY_NAME
from solver.simulate.defects.text import format_defect

# Of the amplitude of each defect.
FACTORS = (0.25, 0.5, 1.0, 2.0, 5.0)
ORBITS, CLEAN = 40, 300
_SLOTS_PER_DEFECT, _PER_SLOT = len(FACTORS) + 1, 1000
# Clean orbits beside each orbit of all defects.
_CLEAN_PER_ROUND = 8
# Rounds at the first amplitude and with the cause modelled, for one at the others.
_ROUNDS_PER_OTHERS = 4


@dataclass(frozen=True, eq=False)
class DefectCase:
    """A defect as the campaign has it.

    Attributes
    ----------
    name : of the defect
    amplitude : of pulls of 1.1, in the unit of its table, measured by `defects.py`
    causes : names of causes in the verdict that are right
    modelled : settings of a fit that models it; empty if there are none
    """

    name: str
    amplitude: float
    causes: tuple[str, ...]
    modelled: Mapping[str, Any] = field(default_factory=dict)

    def text(self, factor: float) -> str:
        """Return the defect as a setting of a survey."""
        amplitude = factor * self.amplitude
        if BY_NAME[self.name].is_count:
            amplitude = max(round(amplitude), 1)
        return format_defect(self.name, amplitude)


CASES = (
    DefectCase("distortion-drift", 0.085, ("distortion-drifts",), {"drift": 2}),
    DefectCase("distortion-orbital", 0.05, ("distortion-oscillates",), {"breathing": 2}),
    DefectCase("distortion-step", 0.068, ("distortion-steps",), {"field_distortion": 3}),
    DefectCase("distortion-order", 0.075, ("order",), {"order": 7}),
    DefectCase("focal-anisotropy", 4.5, ("anisotropy",), {"focal_anisotropy": True}),
    DefectCase("pointing-jitter", 9.4, ("jitter",)),
    DefectCase("detector-shift", 0.057, ("detector-shifts",), {"detector_motion": True}),
    DefectCase("detector-turn", 1.28, ("detector-turns",), {"detector_motion": True}),
    DefectCase("charge-transfer", 2.2, ("charge-transfer-y",), {"charge_transfer": True}),
    DefectCase("pixel-phase", 6.5, ("pixel-phase-x", "pixel-phase-y"), {"pixel_phase": True}),
    DefectCase("noise", 10.0, ("noise",), {"noise_scale": True}),
    DefectCase("noise-exposure", 30.0, ("noise-of-exposures",), {"noise_by_exposure": True}),
    DefectCase("noise-magnitude", 17.5, ("noise-of-magnitudes",), {"noise_by_magnitude": True}),
    DefectCase("outliers", 0.066, ("outliers",), {"robust": True}),
    # A single one spoils the positions of two stars; so the amplitude is one that occurs.
    DefectCase("swapped", 0.2, ("swapped",), {"robust": True}),
    DefectCase("reference-errors", 440.0, ("reference-errors",), {"reference_scale": True}),
    # At five times that no more than the reference stars about the target.
    DefectCase("binaries", 7.0, ("wrong-references",)),
    DefectCase("exposure-times", 1.2e6, ("wrong-epoch",)),
)


class Trial(NamedTuple):
    """A trial of the campaign.

    Attributes
    ----------
    case : the defect; None if the orbit has none
    factor : of its amplitude
    is_modelled : whether the fit models it
    orbit : number of the orbit, and seed of its survey
    """

    case: DefectCase | None
    factor: float
    is_modelled: bool
    orbit: int


def trial_of(number: int) -> Trial:
    """Return the trial of a number."""
    slot, orbit = divmod(number, _PER_SLOT)
    if slot == 0:
        return Trial(None, 0.0, False, orbit)
    place, column = divmod(slot - 1, _SLOTS_PER_DEFECT)
    is_modelled = column == len(FACTORS)
    # Other orbits than the clean ones, and the same with the cause modelled.
    factor = FACTORS[-1] if is_modelled else FACTORS[column]
    return Trial(CASES[place], factor, is_modelled, CLEAN + orbit)


def numbers() -> list[int]:
    """Return the numbers of all trials: any first part of them is balanced."""
    ordered: list[int] = list(_of_rounds())
    return ordered + [number for number in range(CLEAN) if number not in set(ordered)]


def _of_rounds() -> Iterator[int]:
    at_one = FACTORS.index(1.0)
    others = [column for column in range(len(FACTORS)) if column != at_one]
    clean, following = iter(range(CLEAN)), 0
    for orbit in range(ORBITS):
        yield from (number for _, number in zip(range(_CLEAN_PER_ROUND), clean, strict=False))
        yield from _of_orbit([at_one, len(FACTORS)], orbit)
        if orbit % _ROUNDS_PER_OTHERS == _ROUNDS_PER_OTHERS - 1:
            yield from _of_orbit(others, following)
            following += 1
    for orbit in range(following, ORBITS):
        yield from _of_orbit(others, orbit)


def _of_orbit(columns: list[int], orbit: int) -> Iterator[int]:
    for place, case in enumerate(CASES):
        for column in columns:
            if column < len(FACTORS) or case.modelled:
                yield (1 + _SLOTS_PER_DEFECT * place + column) * _PER_SLOT + orbit
