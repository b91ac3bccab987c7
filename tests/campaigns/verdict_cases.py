"""Defects that can be seen in one orbit: their amplitudes, their causes, and how to model them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from solver.data.orbit import OrbitData
from solver.simulate.defects.table import BY_NAME
from solver.simulate.defects.text import format_defect
from tests.campaigns.defects import full_orbit, sparse_orbit

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
    modelled_orbits : fitted in this way; more where the pulls of a single orbit say little
    is_full : whether the orbits are those of the paper, not sparse
    """

    name: str
    amplitude: float
    causes: tuple[str, ...]
    modelled: Mapping[str, Any] = field(default_factory=dict)
    modelled_orbits: int = ORBITS
    is_full: bool = False

    @property
    def title(self) -> str:
        """What the page calls it."""
        return f"`{self.name}`, full orbits" if self.is_full else f"`{self.name}`"

    def orbits(self, column: int) -> int:
        """Return the number of orbits at a factor, or with the cause modelled."""
        return self.modelled_orbits if column == len(FACTORS) else ORBITS

    def text(self, factor: float) -> str:
        """Return the defect as a setting of a survey."""
        return format_defect(self.name, self.at(factor))

    def words(self, factor: float) -> str:
        """Return the amplitude at a factor, with its unit."""
        return f"{self.at(factor):.3g} {BY_NAME[self.name].unit}".rstrip()

    def at(self, factor: float) -> float:
        """Return the amplitude at a factor, in the unit of its table."""
        amplitude = factor * self.amplitude
        return max(round(amplitude), 1) if BY_NAME[self.name].is_count else amplitude


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
    # The errors of the frame are common to all stars of an orbit, so that its pulls are 0.7 to 1.4.
    DefectCase(
        "reference-errors",
        440.0,
        ("reference-errors",),
        {"reference_scale": True},
        modelled_orbits=160,
    ),
    # At five times that no more than the reference stars about the target.
    DefectCase("binaries", 7.0, ("wrong-references",)),
    DefectCase("exposure-times", 1.2e6, ("wrong-epoch",)),
    # Sparse orbits have too few reference stars to show it.
    DefectCase("exposure-times", 1.05e6, ("wrong-epoch",), is_full=True),
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

    def simulated(self) -> OrbitData:
        """Return the simulated orbit.

        Raises
        ------
        InputError
            If the orbit has no room for the defect.
        """
        if self.case is None:
            return sparse_orbit(self.orbit)
        simulate = full_orbit if self.case.is_full else sparse_orbit
        return simulate(self.orbit, (self.case.text(self.factor),))


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
    for orbit in range(following, max(case.modelled_orbits for case in CASES)):
        yield from _of_orbit(others, orbit)
        yield from _of_orbit([len(FACTORS)] if orbit >= ORBITS else [], orbit)


def _of_orbit(columns: list[int], orbit: int) -> Iterator[int]:
    for place, case in enumerate(CASES):
        for column in columns:
            is_tried = column < len(FACTORS) or case.modelled
            if is_tried and orbit < case.orbits(column):
                yield (1 + _SLOTS_PER_DEFECT * place + column) * _PER_SLOT + orbit
