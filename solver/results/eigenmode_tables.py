"""Tables of the eigenmodes: their shares, and the moves of the weak ones."""

import numpy as np
import pandas as pd
from jaxtyping import Float

from solver.data.eigenmode_schema import EIGENMODES, MODE_PARAMETERS, MODE_SHIFTS
from solver.data.instrument import Instrument
from solver.data.parameters import PARAMETERS, Axis, Group
from solver.linear.source_elimination import ReducedSystem
from solver.results.eigenmode_names import GroupShare, eigenmode_name
from solver.results.eigenmodes import MAX_NAMED, Eigenmodes, find_eigenmodes
from solver.results.tables import SolvedProblem


def eigenmode_tables(
    solution: SolvedProblem, calibration: pd.DataFrame, instrument: Instrument
) -> dict[str, pd.DataFrame]:
    """Return `EIGENMODES`, `MODE_PARAMETERS` and `MODE_SHIFTS` of `eigenmode_schema` by name.

    Parameters
    ----------
    calibration : `schema.CALIBRATION` of the solution
    instrument : instrument with the nominal places of the detectors
    """
    problem, reduced = solution.problem, solution.reduced
    is_reference = problem.sources["is_reference"].to_numpy(bool)
    found = find_eigenmodes(reduced, problem.priors, problem.layout, is_reference)
    weak = _signed(found.vectors[:, : min(found.n_weak, MAX_NAMED)], reduced)
    parameters = _parameter_table(solution, found, weak, calibration)
    places = _places(solution, instrument)
    names = [_name(rows, places) for _, rows in parameters.groupby("mode")]
    return {
        EIGENMODES.name: _eigenmode_table(found, names),
        MODE_PARAMETERS.name: parameters,
        MODE_SHIFTS.name: _shift_table(solution, weak),
    }


def _signed(
    vectors: Float[np.ndarray, "calib weak"], reduced: ReducedSystem
) -> Float[np.ndarray, "calib weak"]:
    """Return the eigenmodes with the largest move in conditional sigmas positive."""
    scaled = vectors * np.sqrt(np.diag(reduced.theta))[:, None]
    largest = np.argmax(np.abs(scaled), axis=0)
    return vectors * np.sign(scaled[largest, np.arange(vectors.shape[1])])


def _eigenmode_table(found: Eigenmodes, names: list[str]) -> pd.DataFrame:
    count = len(found.data)
    columns = {
        "mode": np.arange(1, count + 1),
        "name": pd.Series([*names, *[""] * (count - len(names))], dtype="str"),
        "data_share": found.data,
        "reference_share": found.references,
        "source_share": found.sources,
        "calibration_share": found.calibration,
        "relative_information": found.relative,
    }
    return pd.DataFrame({name: columns[name] for name in EIGENMODES.names})


def _parameter_table(
    solution: SolvedProblem,
    found: Eigenmodes,
    weak: Float[np.ndarray, "calib weak"],
    calibration: pd.DataFrame,
) -> pd.DataFrame:
    problem, count = solution.problem, weak.shape[1]
    # The rows of the calibration table are ordered by group.
    columns = np.concatenate([problem.layout.columns(group) for group in problem.layout.groups])
    moves = weak[columns]
    squares = moves**2 * np.diag(solution.reduced.theta)[columns, None]
    in_priors = problem.priors.scaled(weak, solution.reduced.at[0])[columns]
    labels = {
        name: pd.Series(np.tile(calibration[name], count), dtype=calibration[name].dtype)
        for name in ("group", "element", "label", "unit")
    }
    values = {
        "mode": np.repeat(np.arange(1, count + 1), len(calibration)),
        "move": moves.T.ravel(),
        "share": (squares / squares.sum(axis=0)).T.ravel(),
        "prior_share": (in_priors**2).T.ravel(),
    }
    return pd.DataFrame({**labels, **values})[MODE_PARAMETERS.names]


def _shift_table(solution: SolvedProblem, weak: Float[np.ndarray, "calib weak"]) -> pd.DataFrame:
    ids = solution.problem.sources["source_id"].to_numpy()
    shifts, count = solution.reduced.source_shifts(weak), weak.shape[1]
    columns = {
        "mode": np.repeat(np.arange(1, count + 1), len(ids)),
        "source_id": np.tile(ids, count),
        "shift_ra": shifts[:, 0].ravel(),
        "shift_dec": shifts[:, 1].ravel(),
    }
    return pd.DataFrame({name: columns[name] for name in MODE_SHIFTS.names})


def _places(
    solution: SolvedProblem, instrument: Instrument
) -> dict[Axis, Float[np.ndarray, "n 2"]]:
    """Return the pointings of exposures on the sky and the places of detectors, by axis."""
    frame = np.asarray(solution.problem.geometry.pointing_frame)[: solution.problem.layout.n_exp]
    detectors = [(d.x_um, d.y_um) for d in instrument.detectors]
    return {"exp": frame[:, 0] @ frame[0, 1:].T, "det": np.array(detectors)}


def _name(rows: pd.DataFrame, places: dict[Axis, Float[np.ndarray, "n 2"]]) -> str:
    rows_of_group = dict(list(rows.groupby("group")))
    return eigenmode_name(
        [
            GroupShare(
                group,
                float(rows_of_group[group.name]["share"].sum()),
                _moves(group, rows_of_group[group.name]),
                rows_of_group[group.name]["label"].tolist(),
                places.get(group.axis),
            )
            for group in PARAMETERS
            if group.name in rows_of_group
        ]
    )


def _moves(group: Group, rows: pd.DataFrame) -> Float[np.ndarray, " n"]:
    """Return the moves of the elements of a group in comparable units."""
    move = rows["move"].to_numpy()
    # High distortion orders need larger coefficients for the same effect.
    return np.sign(move) * np.sqrt(rows["share"].to_numpy()) if group.is_term else move
