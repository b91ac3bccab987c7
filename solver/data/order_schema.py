"""Table that compares distortion orders; exported by `solver.data.schema`."""

from solver.data.columns import Column, Table

ORDERS = Table(
    "orders",
    (
        Column("order", "int64", "", "order of the distortion"),
        Column("n_terms", "int64", "", "coefficients of the distortion, both directions"),
        Column("converged", "bool", "", "whether the fit of this order has converged"),
        Column("chi2", "float64", "", "sum of squared whitened residuals", may_be_nan=True),
        Column("dof", "float64", "", "coordinates less effective parameters", may_be_nan=True),
        Column(
            "effective_parameters",
            "float64",
            "",
            "parameters that the data decide",
            may_be_nan=True,
        ),
        Column(
            "log_evidence",
            "float64",
            "",
            "log evidence (Laplace); NaN where the distortion's prior is flat",
            may_be_nan=True,
        ),
        Column("n_reserved", "int64", "", "reserved sources"),
        Column(
            "held_out_chi2",
            "float64",
            "",
            "chi2 of the reserved sources' measurements about their prediction by the others",
            may_be_nan=True,
        ),
        Column("held_out_dof", "int64", "", "expected chi2: coordinates of those measurements"),
        Column(
            "held_out_log_density",
            "float64",
            "",
            "log density of those measurements given the others",
            may_be_nan=True,
        ),
    ),
    key=("order",),
)
