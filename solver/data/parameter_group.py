"""Group: an entry of the table of parameter groups, `solver.data.parameters`.

Names of axes in array shapes, in all of the solver:

| axis      | one element per                                              |
|-----------|--------------------------------------------------------------|
| obs       | measurement                                                  |
| src       | source                                                       |
| exp       | exposure                                                     |
| det       | detector                                                     |
| coef      | distortion term of one direction (`distortion.terms`)        |
| drift     | distortion term and function of time                         |
| breathing | distortion term, cosine or sine of the orbital phase         |
| field     | distortion term and field after the first                    |
| own       | distortion term and detector                                 |
| walk      | distortion term and exposure                                 |
| motion    | detector and field after the first                           |
"""

from dataclasses import dataclass
from typing import Literal

from solver.units import factor_between

Axis = Literal["src", "exp", "coef", "drift", "breathing", "field", "own", "walk", "det", "motion"]
# Axes of the coefficients that all measurements share, in the order of their columns.
TERM_AXES: tuple[Axis, ...] = ("coef", "drift", "breathing", "field", "own")
# Axes of all coefficients of distortion terms, and of what has elements for each exposure.
DISTORTION_AXES: tuple[Axis, ...] = (*TERM_AXES, "walk")
EXPOSURE_AXES: tuple[Axis, ...] = ("exp", "walk")
PriorFamily = Literal["normal", "gamma", "uniform"]


@dataclass(frozen=True)
class Published:
    """A column of the published result layout that depends on the value of a group.

    Attributes
    ----------
    column : name in the file
    words : meaning, the comment of the column
    factor : None if the column is the value of this group; otherwise the column belongs to
        another group and is multiplied by 1 + `factor` times the value
    """

    column: str
    words: str = ""
    factor: float | None = None


@dataclass(frozen=True)
class Group:
    """One parameter group.

    Attributes
    ----------
    name : key in parameter sets, tables, `--prior` and the dashboard
    label : name in labels and captions
    symbol : the paper's symbol
    axis : axis with one value per element
    unit : unit of offsets, sigmas and prior widths
    value_unit : unit of the full value, centre plus offset, in tables
    family : prior distribution about its centre
    width : standard deviation of the default prior, in `width_unit`
    relative : whether `width` is a fraction of the centre
    centre_from : where the prior's centre comes from: the catalogue, a column of the environment
        table, an attribute of the instrument's detectors, or zero
    column : that column or attribute
    published : columns of the published layout; by default one named after the group
    setting : setting of a fit that adds the group; "" for a group that every fit has
    """

    name: str
    label: str
    symbol: str
    axis: Axis
    unit: str
    value_unit: str
    family: PriorFamily
    width: float
    relative: bool = False
    centre_from: Literal["catalogue", "environment", "instrument", "zero"] = "zero"
    column: str = ""
    published: tuple[Published, ...] = ()
    setting: str = ""

    @property
    def per_value_unit(self) -> float:
        """Number of `unit` in one `value_unit`."""
        return factor_between(self.value_unit, self.unit)

    @property
    def width_unit(self) -> str:
        """Unit of the prior width in texts; "" for a fraction or a factor."""
        return "" if self.relative or self.axis == "src" else self.unit

    @property
    def is_term(self) -> bool:
        """Whether the group's elements are coefficients of distortion terms."""
        return self.axis in DISTORTION_AXES
