"""Settings of the engines svi and nuts, and the options that set them."""

from dataclasses import dataclass, replace
from typing import Any

from solver.data.setting_kinds import (
    Positive,
    Setting,
    Switch,
    Whole,
    check_fields,
    setting,
    settings_of,
)
from solver.errors import InputError

# What every generator of random numbers takes.
_LARGEST_SEED = 2**32 - 1
_SEED = Whole(label="seed", help="Seed of the random draws.", low=0, high=_LARGEST_SEED)


@dataclass(frozen=True)
class SviSettings:
    """The settings of the svi engine; `settings_of` describes each."""

    steps: int = setting(
        1500,
        Whole(label="steps", help="Number of steps over which the learning rate falls."),
    )
    first_rate: float = setting(
        1e4,
        Positive(
            label="first rate",
            help="Learning rate at the start, in whitened coordinates, whose unit is one sigma, or "
            "in the published code's degrees and micrometres.",
        ),
    )
    last_rate: float = setting(
        1e-3, Setting(label="last rate", help="Learning rate at the end, in the same units.")
    )
    block: int = setting(
        25,
        Whole(
            label="block",
            help="Number of steps between two linearisations; each restarts Adam.",
        ),
    )
    patience: int = setting(
        200,
        Whole(
            label="patience",
            help="The fit has converged when the loss has not changed for this many steps.",
        ),
    )
    tolerance: float = setting(
        0.1,
        Setting(
            label="tolerance",
            help="Largest distance from the mode at which a constant loss counts as converged.",
            unit="sigma",
        ),
    )
    max_steps: int = setting(
        10_000,
        Whole(label="maximum number of steps", help="Maximum number of steps, not below `steps`."),
    )
    seed: int = setting(0, _SEED)
    conditioned: bool = setting(
        True, Switch(label="conditioned", help="Whether to step in whitened coordinates.")
    )

    def __post_init__(self) -> None:
        """Raise `InputError`, which names the setting, if a value is invalid."""
        wholes = {n: s for n, s in settings_of(type(self)).items() if isinstance(s, Whole)}
        for name, whole in wholes.items():
            whole.check(f"svi {name}", getattr(self, name))
        if self.max_steps < self.steps:
            raise InputError(
                f"expected svi max_steps not to be below steps ({self.steps}), "
                f"found {self.max_steps}"
            )
        if not self.first_rate > self.last_rate > 0.0:
            raise InputError(
                "expected positive svi learning rates that fall, "
                f"found {self.first_rate!r} to {self.last_rate!r}"
            )
        if not self.tolerance > 0.0:
            raise InputError(f"expected a positive svi tolerance, found {self.tolerance!r}")


@dataclass(frozen=True)
class NutsSettings:
    """The settings of the nuts engine; `settings_of` describes each."""

    warmup: int = setting(
        300,
        Whole(
            label="warm-up",
            help="Number of first samples of each chain that tune its step size and are discarded.",
        ),
    )
    samples: int = setting(
        500, Whole(label="samples", help="Number of samples kept of each chain.", low=4)
    )
    chains: int = setting(
        2, Whole(label="chains", help="Number of chains; they run one after the other.")
    )
    seed: int = setting(0, _SEED)

    def __post_init__(self) -> None:
        """Raise `InputError`, which names the setting, if a value is invalid."""
        check_fields(self, "nuts ")


# The published code's coordinates, learning rates and convergence criterion (paper, section
# "Optimization"), for comparison; it takes up to a million steps.
WARPFIELD = SviSettings(
    steps=1_000_000,
    first_rate=1e-3,
    last_rate=1e-10,
    block=1000,
    patience=10_000,
    max_steps=1_000_000,
    conditioned=False,
)

# Options that set fields of `SviSettings` and `NutsSettings`; arguments of `engine_settings`.
ENGINE_OPTIONS: dict[str, Setting] = {
    "seed": Whole(
        label="seed",
        help="Seed of the random numbers of svi and nuts.",
        low=0,
        high=_LARGEST_SEED,
        keyword="seed",
        option="seed",
    ),
    "steps": Whole(
        label="steps",
        help="Number of svi steps over which the learning rate falls.",
        keyword="steps",
        option="steps",
        commands=("fit",),
    ),
    "compat": Setting(
        label="compat",
        help="`warpfield` runs svi in the units and with the learning rates of the published code.",
        keyword="compat",
        option="compat",
        commands=("fit",),
    ),
}


def engine_settings(
    seed: int = 0, steps: int | None = None, compat: str | None = None
) -> dict[str, Any]:
    """Return the fields `svi` and `nuts` of `FitSettings` from the values of `ENGINE_OPTIONS`.

    Raises
    ------
    InputError
        If an option has an invalid value.
    """
    return {"svi": svi_settings(compat, steps, seed), "nuts": NutsSettings(seed=seed)}


def svi_settings(compat: str | None, steps: int | None, seed: int) -> SviSettings:
    """Return the settings of the svi engine from its options.

    Parameters
    ----------
    compat : "warpfield" for the published code's coordinates and rates, or None
    steps : over which the learning rate falls; None for the default
    """
    if compat not in (None, "warpfield"):
        raise InputError(f"compat: expected warpfield, found {compat!r}")
    chosen = replace(WARPFIELD if compat else SviSettings(), seed=seed)
    if steps is None:
        return chosen
    ENGINE_OPTIONS["steps"].check("svi steps", steps)
    return replace(chosen, steps=steps, max_steps=2 * steps, block=min(chosen.block, steps))


def engine_options(svi: SviSettings, nuts: NutsSettings) -> dict[str, Any]:
    """Return the values of `ENGINE_OPTIONS` that give these settings, without the defaults.

    What no option sets is left out.
    """
    compat = None if svi.conditioned else "warpfield"
    steps = None if svi.steps == svi_settings(compat, None, 0).steps else svi.steps
    values = {"seed": svi.seed or nuts.seed, "steps": steps, "compat": compat}
    return {name: value for name, value in values.items() if value}
