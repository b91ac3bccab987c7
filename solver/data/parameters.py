"""The one table of parameter groups (paper, table "Inputs, Model Parameters, and Priors").

The blocks of the Gauss-Newton engine, the priors, the command line's `--prior`, the
dashboard's controls and the result tables are derived from this table. A new group is one
entry here and one term in `solver.model.forward`.

Names of axes in array shapes, in all of the solver:

| axis | one element per                                   |
|------|---------------------------------------------------|
| obs  | measurement                                       |
| src  | source                                            |
| exp  | exposure                                          |
| det  | detector                                          |
| coef | distortion term of one direction (`distortion.terms`) |
"""

from dataclasses import dataclass
from typing import Literal

from solver.units import factor_between

Axis = Literal["src", "exp", "coef", "det"]
Family = Literal["normal", "gamma", "uniform"]


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
    width : standard deviation of the default prior, in `unit`
    relative : whether `width` is a fraction of the centre
    origin : origin of the prior's centre: the catalogue, a column of the environment table,
        an attribute of the instrument's detectors, or zero
    column : that column or attribute
    published : columns of the published layout; by default one named after the group
    """

    name: str
    label: str
    symbol: str
    axis: Axis
    unit: str
    value_unit: str
    family: Family
    width: float
    relative: bool = False
    origin: Literal["catalogue", "environment", "instrument", "zero"] = "zero"
    column: str = ""
    published: tuple[Published, ...] = ()

    @property
    def per_value_unit(self) -> float:
        """Number of `unit` in one `value_unit`."""
        return factor_between(self.value_unit, self.unit)

    @property
    def width_unit(self) -> str:
        """Unit of the prior width in texts; "" for a fraction or a factor."""
        return "" if self.relative or self.axis == "src" else self.unit


# The paper gives the prior of the focal length as a variance of 100 on a scale in um/deg. The
# simulated scatter (1e-3) agrees with a standard deviation of 100 um/deg instead (1.2e-3).
_FOCAL_WIDTH_UM = 100.0 * 57.29577951308232

SOURCES = Group(
    "sources",
    "source positions",
    "α_i, δ_i",
    "src",
    "mas",
    "deg",
    "normal",
    1.0,  # a factor on the catalogue's own uncertainties
    origin="catalogue",
)

PARAMETERS: tuple[Group, ...] = (
    SOURCES,
    Group(
        "pointing_ra",
        "pointing RA",
        "α_tel cos δ_tel",
        "exp",
        "arcsec",
        "deg",
        "normal",
        3600.0,
        origin="environment",
        column="ra_est",
        published=(Published("tel_a_loc", "RA of the optical axis"),),
    ),
    Group(
        "pointing_dec",
        "pointing Dec",
        "δ_tel",
        "exp",
        "arcsec",
        "deg",
        "normal",
        3600.0,
        origin="environment",
        column="dec_est",
        published=(Published("tel_d_loc", "Dec of the optical axis"),),
    ),
    Group(
        "position_angle",
        "position angle",
        "θ_tel",
        "exp",
        "arcsec",
        "deg",
        "uniform",
        float("inf"),
        origin="environment",
        column="pa_est",
        published=(Published("tel_t_loc", "position angle"),),
    ),
    Group(
        "focal_length",
        "focal length",
        "F",
        "exp",
        "um",
        "um",
        "gamma",
        _FOCAL_WIDTH_UM,
        origin="environment",
        column="focal_length",
        published=(
            Published("tel_f_loc_x", "focal length"),
            Published("tel_f_loc_y", "focal length, the same value"),
        ),
    ),
    Group(
        "distortion_x",
        "distortion A",
        "A_kl",
        "coef",
        "um",
        "um",
        "normal",
        1.0,
        published=(Published("opt_A_loc", "A_kl"),),
    ),
    Group(
        "distortion_y",
        "distortion B",
        "B_kl",
        "coef",
        "um",
        "um",
        "normal",
        1.0,
        published=(Published("opt_B_loc", "B_kl"),),
    ),
    Group(
        "detector_x",
        "detector x",
        "X_det",
        "det",
        "um",
        "um",
        "normal",
        100.0,
        origin="instrument",
        column="x_um",
        published=(Published("det_o_loc_x", "x of the centre"),),
    ),
    Group(
        "detector_y",
        "detector y",
        "Y_det",
        "det",
        "um",
        "um",
        "normal",
        100.0,
        origin="instrument",
        column="y_um",
        published=(Published("det_o_loc_y", "y of the centre"),),
    ),
    Group(
        "detector_rotation",
        "detector rotation",
        "θ_det",
        "det",
        "arcsec",
        "deg",
        "normal",
        360.0,
        origin="instrument",
        column="rotation_deg",
        published=(Published("det_r_loc", "rotation"),),
    ),
    Group(
        "pitch_x",
        "pixel pitch x",
        "δ_x",
        "det",
        "um",
        "um",
        "normal",
        0.01,
        relative=True,
        origin="instrument",
        column="pitch_x_um",
        published=(Published("det_p_loc_x", "pixel pitch in x"),),
    ),
    Group(
        "pitch_y",
        "pixel pitch y",
        "δ_y",
        "det",
        "um",
        "um",
        "normal",
        0.01,
        relative=True,
        origin="instrument",
        column="pitch_y_um",
        published=(Published("det_p_loc_y", "pixel pitch in y"),),
    ),
)

CALIBRATION_GROUPS = tuple(g for g in PARAMETERS if g.axis != "src")
BY_NAME = {g.name: g for g in PARAMETERS}


def groups_on(axis: Axis) -> tuple[Group, ...]:
    """Return the groups with one value per element of `axis`, in table order."""
    return tuple(g for g in PARAMETERS if g.axis == axis)
