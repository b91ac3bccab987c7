"""Table of what a simulated survey's defects affected; no fit reads it."""

from solver.data.columns import Column, Table
from solver.data.input_schema import MEASURED, SOURCE

AFFECTED = Table(
    "affected",
    (
        Column("defect", "str", "", "name of the defect"),
        *MEASURED,
        Column("true_source_id", "int64", "", "source that was measured"),
        Column("shift_x", "float64", "pix", "error added to nx", may_be_nan=True),
        Column("shift_y", "float64", "pix", "error added to ny", may_be_nan=True),
    ),
    key=("defect", *(column.name for column in MEASURED)),
)

# In place of the ids of a measurement, where a whole source of the catalogue is affected.
NO_MEASUREMENT = {column.name: -1 for column in MEASURED if column is not SOURCE}
