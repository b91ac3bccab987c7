"""FitSettings: the settings of a fit, checked on creation and convertible to JSON."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from solver.data.engine_settings import NutsSettings, SviSettings
from solver.data.model_settings import MAX_ORDER as MAX_ORDER
from solver.data.model_settings import ModelSettings
from solver.data.parameters import BY_NAME, OPTIONAL_GROUPS, PARAMETERS, Group
from solver.data.setting_kinds import (
    Change,
    Choice,
    EngineSettings,
    Positive,
    Switch,
    Whole,
    check_fields,
    defaults_of,
    setting,
    settings_of,
)
from solver.data.subset import Subset
from solver.data.text_setting import LeftOut, PriorShifts, PriorWidths

# Engine -> unit of its progress.
COUNTED = {"gauss-newton": "iteration", "svi": "step", "nuts": "sample"}
ENGINES = tuple(COUNTED)
_GROUPS = ", ".join(group.name for group in PARAMETERS)


@dataclass(frozen=True)
class FitSettings(ModelSettings):
    """The settings of one fit; `SETTINGS` describes each."""

    engine: str = setting(
        ENGINES[0],
        Choice(
            label="Engine",
            help=f"Engine that solves the orbit, one of {', '.join(ENGINES)}.",
            names=ENGINES,
            keyword="engine",
            option="engine",
            control=True,
            card="ENGINE",
        ),
    )
    max_iterations: int = setting(
        20,
        Whole(
            label="Maximum number of iterations",
            help="Maximum number of iterations of the gauss-newton engine.",
            card="MAXITER",
            phrase="at most {} iterations",
        ),
    )
    tolerance: float = setting(
        1e-3,
        Positive(
            label="Largest step at convergence, sigma",
            help="The fit has converged when every step is below this fraction of its uncertainty.",
            unit="sigma",
            card="TOLER",
            phrase="tolerance {}",
        ),
    )
    prior_widths: Mapping[str, float] = setting(
        {},
        PriorWidths(
            label="Prior widths",
            help="Prior width of a parameter group, such as distortion_x=0.5um or "
            f"position_angle=flat; may be repeated. Groups: {_GROUPS}.",
            keyword="priors",
            option="prior",
            metavar="GROUP=VALUE",
            control=True,
            change=Change.WHAT_IF,
            card="PRIORS",
        ),
    )
    prior_shifts: Mapping[str, float] = setting(
        {},
        PriorShifts(
            label="Shift of the prior centres",
            help="Shift of a prior centre from the value in the files, such as "
            "focal_length=100um or detector_x[2]=-5um; may be repeated. ELEMENT is FIELD/PLATE of "
            "an exposure, a detector's id, K/L of a distortion term, or ra or dec of all sources.",
            keyword="centres",
            option="centre",
            metavar="GROUP[ELEMENT]=SHIFT",
            example="detector_x[2]=-5um",
            control=True,
            change=Change.WHAT_IF,
            card="CENTRES",
        ),
    )
    exclusions: Subset = setting(
        Subset(),
        LeftOut(
            label="Leave out",
            help="Exclude measurements: source=ID, exposure=FIELD/PLATE or detector=ID; "
            "may be repeated.",
            keyword="exclude",
            option="exclude",
            metavar="WHAT",
            example="detector=1, exposure=0/3",
            control=True,
            change=Change.WHAT_IF,
            selects=True,
            card="EXCLUDED",
            phrase="without {}",
        ),
    )
    robust: bool = setting(
        False,
        Switch(
            label="Leave out outliers",
            help="Find outliers, list them and exclude them from the fit.",
            keyword="robust",
            option="robust",
            control=True,
            change=Change.REFIT,
            card="ROBUST",
            phrase="without outliers",
        ),
    )
    thin: int = setting(
        1,
        Whole(
            label="Thinning of the sources",
            help="Use only one in this many sources of each class, for a quick look or for nuts.",
            keyword="thin",
            option="thin",
            selects=True,
            card="THIN",
            phrase="one in {} sources",
        ),
    )
    compare_orders: bool = setting(
        False,
        Switch(
            label="Compare all orders",
            help="Also solve every distortion order, and state which one the data prefer.",
            keyword="compare_orders",
            option="compare-orders",
            commands=("fit",),
            control=True,
            is_identity=False,
            card="COMPARED",
            phrase="orders compared",
        ),
    )
    svi: SviSettings = setting(
        SviSettings(),
        EngineSettings(label="svi", help="Settings of the svi engine.", kind=SviSettings),
    )
    nuts: NutsSettings = setting(
        NutsSettings(),
        EngineSettings(label="nuts", help="Settings of the nuts engine.", kind=NutsSettings),
    )

    def __post_init__(self) -> None:
        """Raise `InputError`, which names the setting, if a value is invalid."""
        check_fields(self)
        for name in ("prior_widths", "prior_shifts"):
            object.__setattr__(self, name, dict(getattr(self, name)))

    def width(self, name: str) -> float:
        """Return the prior width of group `name`, in its `width_unit`."""
        return float(self.prior_widths.get(name, BY_NAME[name].width))

    @property
    def optional_groups(self) -> tuple[Group, ...]:
        """The optional parameter groups that the fit has, in table order."""
        return tuple(group for group in OPTIONAL_GROUPS if getattr(self, group.setting))

    @property
    def has_noise_model(self) -> bool:
        """Whether uncertainties are estimated with the parameters."""
        by_row = self.noise_scale or self.noise_by_exposure or self.noise_by_magnitude
        return by_row or self.noise_floor or self.reference_scale

    @property
    def step_tolerance(self) -> float:
        """Largest distance from the mode at which the engine stops, sigma."""
        return self.svi.tolerance if self.engine == "svi" else self.tolerance

    def with_(self, **changes: object) -> "FitSettings":
        """Return a copy with some fields changed."""
        return replace(self, **changes)  # type: ignore[arg-type]

    def to_dict(self) -> dict[str, object]:
        """Return the settings as plain values; `from_dict` reads them back."""
        return {name: one.to_plain(getattr(self, name)) for name, one in SETTINGS.items()}

    @staticmethod
    def from_dict(values: Mapping[str, Any]) -> "FitSettings":
        """Return the settings that `to_dict` wrote; missing fields have their defaults."""
        unknown = sorted(set(values) - set(SETTINGS))
        if unknown:
            raise TypeError(f"unknown settings: {', '.join(unknown)}")
        found = {name: SETTINGS[name].from_plain(value) for name, value in values.items()}
        return FitSettings(**found)

    def identity(self) -> dict[str, object]:
        """Return `to_dict` with all settings that do not affect the solution at their defaults."""
        same = {name: DEFAULTS[name] for name, one in SETTINGS.items() if not one.is_identity}
        return self.with_(**same).to_dict()

    def selection(self) -> tuple[object, ...]:
        """Return the values of the settings that decide which measurements are used."""
        return tuple(getattr(self, name) for name, one in SETTINGS.items() if one.selects)

    def what_if_holds(self, other: "FitSettings") -> bool:
        """Return whether a what-if from a fit with these settings can solve with `other`.

        It takes the steps of the first engine, whichever found the fit.
        """
        refit = [name for name, one in SETTINGS.items() if one.change is Change.REFIT]
        is_same = all(getattr(self, name) == getattr(other, name) for name in refit)
        return is_same and other.engine == ENGINES[0]

    def serves(self, other: "FitSettings") -> bool:
        """Return whether what-ifs with `other`, and those that follow it, can start from a fit."""
        of_all = other.with_(exclusions=Subset())
        has_all = self.selection() in (of_all.selection(), of_all.with_(thin=1).selection())
        return has_all and self.order >= other.order and self.what_if_holds(other)

    def describe(self) -> str:
        """Return a short description: the order, and every setting that is not its default."""
        phrases = (
            one.described(getattr(self, name), DEFAULTS[name]) for name, one in SETTINGS.items()
        )
        return ", ".join(phrase for group in phrases for phrase in group)


SETTINGS = settings_of(FitSettings)
DEFAULTS = defaults_of(FitSettings)
