"""FitSettings: everything a person chooses about a fit, checked once, plain enough for JSON."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace

from solver.data.exclusions import Exclusions
from solver.data.parameters import BY_NAME
from solver.data.prior_text import check_shift, check_width
from solver.errors import InputError

MAX_ORDER = 9
# Engine -> what its progress is counted in.
COUNTED = {"gauss-newton": "iteration", "svi": "step", "nuts": "sample"}
ENGINES = tuple(COUNTED)


def _is_whole(number: object) -> bool:
    return isinstance(number, int) and not isinstance(number, bool)


@dataclass(frozen=True)
class SviSettings:
    """The choices of the svi engine.

    Attributes
    ----------
    steps : over which the learning rate falls
    first_rate, last_rate : the learning rate, in free coordinates: whitened ones, where
        one is a sigma, or the published code's degrees and micrometres
    block : steps between two linearisations, after which Adam starts afresh
    patience : the fit has converged when the loss has not changed for so many steps
    tolerance : with the loss at rest, the mode is to be nearer than this, sigma
    max_steps : limit of the engine
    seed : of the random draws
    conditioned : whether to move in whitened coordinates
    """

    steps: int = 1500
    first_rate: float = 1e4
    last_rate: float = 1e-3
    block: int = 25
    patience: int = 200
    tolerance: float = 0.1
    max_steps: int = 10_000
    seed: int = 0
    conditioned: bool = True

    def __post_init__(self) -> None:
        """Refuse what no fit can use; `InputError` names the setting."""
        for name in ("steps", "block", "patience", "max_steps"):
            number = getattr(self, name)
            if not _is_whole(number) or number < 1:
                raise InputError(f"expected svi {name} to be 1 or more, found {number!r}")
        if self.max_steps < self.steps:
            raise InputError(
                f"expected svi max_steps not to be below steps ({self.steps}), "
                f"found {self.max_steps}"
            )
        if not self.first_rate > self.last_rate > 0.0:
            raise InputError(
                "expected svi learning rates that fall and are positive, "
                f"found {self.first_rate!r} to {self.last_rate!r}"
            )
        if not self.tolerance > 0.0:
            raise InputError(f"expected a positive svi tolerance, found {self.tolerance!r}")
        _check_seed("svi", self.seed)


@dataclass(frozen=True)
class NutsSettings:
    """The choices of the nuts engine.

    Attributes
    ----------
    warmup : samples of each chain with which its step size is found, thrown away
    samples : kept of each chain
    chains : how many, one after the other
    seed : of the random draws
    """

    warmup: int = 300
    samples: int = 500
    chains: int = 2
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what no run can use; `InputError` names the setting."""
        for name, least in (("warmup", 1), ("samples", 4), ("chains", 1)):
            number = getattr(self, name)
            if not _is_whole(number) or number < least:
                raise InputError(f"expected nuts {name} to be {least} or more, found {number!r}")
        _check_seed("nuts", self.seed)


def _check_seed(engine: str, seed: int) -> None:
    if not _is_whole(seed) or seed < 0:
        raise InputError(f"expected {engine} seed to be 0 or more, found {seed!r}")


# The published code's coordinates, rates and rule of convergence (paper, section
# "Optimization"), for comparison; it took up to a million steps.
WARPFIELD = SviSettings(
    steps=1_000_000,
    first_rate=1e-3,
    last_rate=1e-10,
    block=1000,
    patience=10_000,
    max_steps=1_000_000,
    conditioned=False,
)


def svi_settings(compat: str | None, steps: int | None, seed: int) -> SviSettings:
    """Return the svi engine's choices as a person states them.

    Parameters
    ----------
    compat : "warpfield" for the published code's coordinates and rates, or None
    steps : over which the learning rate falls; None for the default
    """
    if compat not in (None, "warpfield"):
        raise InputError(f"expected warpfield to be compatible with, found {compat!r}")
    chosen = replace(WARPFIELD if compat else SviSettings(), seed=seed)
    if steps is None:
        return chosen
    return replace(chosen, steps=steps, max_steps=2 * steps, block=min(chosen.block, steps))


@dataclass(frozen=True)
class FitSettings:
    """The choices of one fit.

    Attributes
    ----------
    order : highest total degree of the Legendre distortion, 0 to 9
    engine : one of `ENGINES`
    prior_widths : group name -> standard deviation of its prior, in the group's
        `width_unit`; for "sources" a factor on the catalogue's uncertainties;
        `inf` for a flat prior. Groups not named keep the default of `parameters`.
    prior_shifts : "GROUP" or "GROUP[ELEMENT]" -> shift of the prior's centre from the value in
        the files, in the group's unit; an element is written FIELD/PLATE, a detector's number,
        K/L of a distortion term, or ra or dec of the sources, which shift the whole catalogue
    aberration : whether stellar aberration is part of the forward model
    exclusions : measurements that are not to be used
    max_iterations : limit of the engine
    tolerance : the fit has converged when every step is below this times its uncertainty
    robust : whether outliers are looked for and left out
    compare_orders : whether every order of the distortion is solved beside this one
    thin : of the sources of each class one in so many is used, for a quick look or nuts
    svi, nuts : the choices of those engines
    """

    order: int = 5
    engine: str = "gauss-newton"
    prior_widths: Mapping[str, float] = field(default_factory=dict)
    aberration: bool = True
    exclusions: Exclusions = Exclusions()
    max_iterations: int = 20
    tolerance: float = 1e-3
    robust: bool = False
    thin: int = 1
    svi: SviSettings = SviSettings()
    nuts: NutsSettings = NutsSettings()
    prior_shifts: Mapping[str, float] = field(default_factory=dict)
    compare_orders: bool = False

    def __post_init__(self) -> None:
        """Refuse what no fit can use; `InputError` names the setting."""
        if not _is_whole(self.order) or not 0 <= self.order <= MAX_ORDER:
            raise InputError(
                f"expected a distortion order from 0 to {MAX_ORDER}, found {self.order!r}"
            )
        if self.engine not in ENGINES:
            raise InputError(
                f"expected an engine out of {', '.join(ENGINES)}, found {self.engine!r}"
            )
        if not _is_whole(self.max_iterations) or self.max_iterations < 1:
            raise InputError(
                f"expected max_iterations to be 1 or more, found {self.max_iterations!r}"
            )
        if not self.tolerance > 0.0:
            raise InputError(f"expected a positive tolerance, found {self.tolerance!r}")
        if not _is_whole(self.thin) or self.thin < 1:
            raise InputError(f"expected thin to be 1 or more, found {self.thin!r}")
        for name, width in self.prior_widths.items():
            check_width(name, width)
        for name, shift in self.prior_shifts.items():
            check_shift(name, shift)
        for name in ("prior_widths", "prior_shifts"):
            object.__setattr__(self, name, dict(getattr(self, name)))

    def width(self, name: str) -> float:
        """Return the prior width of group `name`, in its `width_unit`."""
        return float(self.prior_widths.get(name, BY_NAME[name].width))

    @property
    def step_tolerance(self) -> float:
        """How near to the mode the engine is to come, sigma."""
        return self.svi.tolerance if self.engine == "svi" else self.tolerance

    def with_(self, **changes: object) -> "FitSettings":
        """Return a copy with some fields changed."""
        return replace(self, **changes)  # type: ignore[arg-type]

    def to_dict(self) -> dict[str, object]:
        """Return the settings as plain values; `from_dict` reads them back."""
        return {
            "order": self.order,
            "engine": self.engine,
            "aberration": self.aberration,
            "max_iterations": self.max_iterations,
            "tolerance": self.tolerance,
            "prior_widths": dict(self.prior_widths),
            "prior_shifts": dict(self.prior_shifts),
            "exclusions": self.exclusions.to_dict(),
            "robust": self.robust,
            "thin": self.thin,
            "compare_orders": self.compare_orders,
            "svi": asdict(self.svi),
            "nuts": asdict(self.nuts),
        }

    @staticmethod
    def from_dict(values: Mapping[str, object]) -> "FitSettings":
        """Return the settings that `to_dict` wrote."""
        exclusions = Exclusions.from_dict(values.get("exclusions", Exclusions().to_dict()))  # type: ignore[arg-type]
        engines = {
            "svi": SviSettings(**values.get("svi", {})),  # type: ignore[arg-type]
            "nuts": NutsSettings(**values.get("nuts", {})),  # type: ignore[arg-type]
        }
        return FitSettings(**{**values, "exclusions": exclusions, **engines})  # type: ignore[arg-type]
