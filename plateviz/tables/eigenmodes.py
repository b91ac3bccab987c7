"""Tables of the calibration's eigenmodes, and of what constrains its weak directions."""

import numpy as np
import pandas as pd

from plateviz.tables.labels import element_labels, id_strings, unit_text
from plateviz.tables.sky import centre_of, places_arcmin
from solver.data.parameters import BY_NAME, PARAMETERS
from solver.data.result import FitResult
from solver.model.directions import vectors_about
from solver.units import MAS_PER_ARCMIN

DATA, REFERENCES, SOURCES, CALIBRATION = (
    "measurements",
    "reference sources",
    "priors of other sources",
    "priors of the calibration",
)
DECIDERS = (DATA, REFERENCES, SOURCES, CALIBRATION)
_COLUMNS = {DATA: "data_share", REFERENCES: "reference_share", SOURCES: "source_share"}
_LEAST_SHIFT_SHARE = 0.1
_SPECTRUM = ["mode", "name", *_COLUMNS.values(), "calibration_share", "relative_information"]


def eigenmode_spectrum(result: FitResult) -> pd.DataFrame:
    """Return all eigenmodes, the weakest first; no rows if the result has none.

    Returns
    -------
    The columns of `solver.data.schema`'s table `eigenmodes` and `is_weak`: whether the eigenmode is
    one of the weak directions that are described in full
    """
    if result.eigenmodes is None:
        return pd.DataFrame(columns=[*_SPECTRUM, "is_weak"])
    modes = result.eigenmodes[_SPECTRUM].assign(name=element_labels(result.eigenmodes["name"]))
    return modes.assign(is_weak=modes["name"] != "")


def eigenmode_deciders(result: FitResult) -> pd.DataFrame:
    """Return what constrains each weak direction, in the order of `DECIDERS`, as parts of a bar.

    Returns
    -------
    `mode`, `name`, `decider` (of `DECIDERS`), `what` (its text; the calibration's priors by
    group), `share`, and the cumulative shares `left` and `right`; parts of zero share have
    no row
    """
    columns = ["mode", "name", "decider", "what", "share", "left", "right"]
    if result.eigenmodes is None or result.mode_parameters is None:
        return pd.DataFrame(columns=columns)
    modes = eigenmode_spectrum(result)
    weak = modes[modes["is_weak"]]
    parts = [
        weak[["mode", "name"]].assign(decider=decider, what=decider, share=weak[column])
        for decider, column in _COLUMNS.items()
    ]
    by_group = result.mode_parameters.groupby(["mode", "group"])["prior_share"].sum()
    known = set(result.mode_parameters["group"])
    for group in (group for group in PARAMETERS if group.name in known):
        share = weak["mode"].map(by_group.xs(group.name, level="group"))
        part = {"decider": CALIBRATION, "what": f"prior of {group.label}", "share": share}
        parts.append(weak[["mode", "name"]].assign(**part))
    table = pd.concat(parts, ignore_index=True).sort_values("mode", kind="stable")
    right = table.groupby("mode")["share"].cumsum()
    table = table.assign(left=right - table["share"], right=right)
    return table.loc[table["share"] > 0.0, columns].reset_index(drop=True)


def eigenmode_groups(result: FitResult) -> pd.DataFrame:
    """Return the share of each parameter group in each weak direction.

    Returns
    -------
    `mode`, `name`, `group` (label), `share` (of the squares of moves over conditional
    sigmas), `move` (rms of the group's elements per sigma along the direction), `unit`; and
    `shift_mas`, the rms shift of the sources, the same in all rows of a direction
    """
    columns = ["mode", "name", "group", "share", "move", "unit", "shift_mas"]
    if result.eigenmodes is None or result.mode_parameters is None:
        return pd.DataFrame(columns=columns)
    rows = result.mode_parameters.assign(square=result.mode_parameters["move"] ** 2)
    table = (
        rows.groupby(["mode", "group"], sort=False)
        .agg(share=("share", "sum"), move=("square", "mean"), unit=("unit", "first"))
        .reset_index()
    )
    return table.assign(
        move=np.sqrt(table["move"]),
        unit=table["unit"].map(unit_text),
        name=table["mode"].map(eigenmode_spectrum(result).set_index("mode")["name"]),
        group=[BY_NAME[name].label for name in table["group"]],
        shift_mas=table["mode"].map(_shift_rms(result)),
    )[columns]


def eigenmode_shifts(result: FitResult, *, most: int | None = None) -> pd.DataFrame:
    """Return the shifts of the sources along weak directions, a row per direction and source.

    Parameters
    ----------
    result : the fit
    most : maximum number of directions, those with the largest rms shift; directions with
        less than a tenth of the largest are left out; None for all

    Returns
    -------
    `mode`, `name`, `id`, tail `x`, `y` in arcmin (East positive) in the plane tangent
    at the centre of the field, shift `u`, `v` in arcmin per sigma along the direction,
    `shift_ra_mas`, `shift_dec_mas`
    """
    columns = ["mode", "name", "id", "x", "y", "u", "v", "shift_ra_mas", "shift_dec_mas"]
    if result.eigenmodes is None or result.mode_shifts is None:
        return pd.DataFrame(columns=columns)
    rms = _shift_rms(result)
    largest = (
        rms if most is None else rms[rms >= _LEAST_SHIFT_SHARE * rms.max()].nlargest(most)
    ).index
    rows = result.mode_shifts[result.mode_shifts["mode"].isin(largest)]
    rows = rows.merge(result.sources[["source_id", "ra", "dec"]], on="source_id", how="left")
    centre = centre_of(result.sources)
    x, y = places_arcmin(rows, centre)
    columns_of = (rows[one].to_numpy() for one in ("ra", "dec", "shift_ra", "shift_dec"))
    u, v = vectors_about(centre, *columns_of).T
    return rows.assign(
        name=rows["mode"].map(eigenmode_spectrum(result).set_index("mode")["name"]),
        id=id_strings(rows["source_id"]),
        x=x,
        y=y,
        u=u / MAS_PER_ARCMIN,
        v=v / MAS_PER_ARCMIN,
        shift_ra_mas=rows["shift_ra"],
        shift_dec_mas=rows["shift_dec"],
    )[columns]


def _shift_rms(result: FitResult) -> pd.Series:
    """Return the rms length of the shifts of all sources by eigenmode, mas."""
    if result.mode_shifts is None:
        return pd.Series(dtype=float)
    squares = result.mode_shifts["shift_ra"] ** 2 + result.mode_shifts["shift_dec"] ** 2
    return np.sqrt(squares.groupby(result.mode_shifts["mode"]).mean())
