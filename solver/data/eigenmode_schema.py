"""Tables of the eigenmodes: which combinations of calibration parameters the data constrain.

In these tables a `mode` is an eigenmode (`solver.results.eigenmodes`), not the maximum of the
posterior.
"""

from solver.data.columns import Column, Table

_MODE = Column("mode", "int64", "", "combination of calibration parameters, 1 is the weakest")

EIGENMODES = Table(
    "eigenmodes",
    (
        _MODE,
        Column("name", "str", "", "the mode in words; empty where it is not told in full"),
        Column("data_share", "float64", "", "share of the mode that the measurements decide"),
        Column("reference_share", "float64", "", "share that the reference sources decide"),
        Column("source_share", "float64", "", "share that the other sources' priors decide"),
        Column("calibration_share", "float64", "", "share that the calibration's priors decide"),
        Column(
            "relative_information",
            "float64",
            "",
            "information over what the parameters have with all else held fixed",
        ),
    ),
    key=("mode",),
    file="modes",
)

MODE_PARAMETERS = Table(
    "mode_parameters",
    (
        _MODE,
        Column("group", "str", "", "parameter group, as in `solver.data.parameters`"),
        Column("element", "int64", "", "index along the group's axis"),
        Column("label", "str", "", "the element in words, as in the table calibration"),
        Column("move", "float64", "", "move with one sigma of the mode, in unit"),
        Column("unit", "str", "", "unit of move"),
        Column("share", "float64", "", "share of the squares of moves over conditional sigmas"),
        Column("prior_share", "float64", "", "share of the mode that this prior decides"),
    ),
    key=("mode", "group", "element"),
)

MODE_SHIFTS = Table(
    "mode_shifts",
    (
        _MODE,
        Column("source_id", "int64", "", "source"),
        Column("shift_ra", "float64", "mas", "shift of ra cos(dec) with one sigma of the mode"),
        Column("shift_dec", "float64", "mas", "shift of dec with one sigma of the mode"),
    ),
    key=("mode", "source_id"),
)

EIGENMODE_TABLES = (EIGENMODES, MODE_PARAMETERS, MODE_SHIFTS)
