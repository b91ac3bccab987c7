"""Fitters of the solver process: those of the latest orbits, and what their what-ifs start from.

A request is the JSON object of `plateviz.solving.solver_process`.
"""

import json
from collections import OrderedDict
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from plateviz.solving.capacity import ready_orbits
from plateviz.solving.origin import origin_from_dict
from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.engines.start_tables import StartTables
from solver.errors import InputError
from solver.fit import OrbitFitter
from solver.io.parquet import read_frame

Request = dict
# Columns of a solution's tables from which a fit starts.
_OF_CALIBRATION = ("group", "offset")
_OF_SOURCES = ("source_id", "offset_ra", "offset_dec")


class Fitters:
    """The fitters of the latest orbits, as many as the machine has room for."""

    def __init__(self, most: int | None = None) -> None:
        """Begin without any; keep `most`, by default as many as there is room for."""
        self._most = ready_orbits() if most is None else most
        # The latest last.
        self._kept: OrderedDict[str, OrbitFitter] = OrderedDict()

    def of(self, request: Request) -> OrbitFitter:
        """Return the fitter of the orbit of a request; InputError if the orbit cannot be read."""
        origin, orbit = origin_from_dict(request["origin"]), request["orbit"]
        # Before they are read: what is written meanwhile is read next time.
        key = json.dumps([request["origin"], orbit, origin.state(orbit)], sort_keys=True)
        if key in self._kept:
            self._kept.move_to_end(key)
        else:
            # Forgotten first, so that the new one finds their memory.
            while len(self._kept) >= self._most:
                self._kept.popitem(last=False)
            self._kept[key] = OrbitFitter(origin.read(orbit), origin.read_instrument())
        return self._kept[key]


class Base(NamedTuple):
    """A fit from which what-ifs can start, by another process.

    Attributes
    ----------
    settings : of the fit
    solution : None if it cannot be read
    """

    settings: FitSettings
    solution: StartTables | None


def base_of(request: Request) -> Base | None:
    """Return the fit from which the what-ifs of a request can start, if it names one."""
    base = request.get("base")
    if base is None:
        return None
    directory, tables = Path(base["directory"]), None
    # Without it, the fit takes more steps.
    with suppress(InputError):
        tables = StartTables(
            read_frame(directory / "calibration.parquet", list(_OF_CALIBRATION)),
            read_frame(directory / "sources.parquet", list(_OF_SOURCES)),
        )
    return Base(base_settings(FitSettings.from_dict(base["settings"])), tables)


def base_settings(settings: FitSettings) -> FitSettings:
    """Return the settings of the fit that the what-ifs of `settings` start from.

    A fit without some measurements is no start for a what-if without others; one of all is.
    """
    return settings.with_(exclusions=Subset(), compare_orders=False)
