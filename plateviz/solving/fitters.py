"""Fitters of the solver process: those of the latest orbits, and their preparation.

A request is the JSON object of `plateviz.solving.solver_process`.
"""

import json
import queue
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from plateviz.solving.capacity import ready_orbits
from plateviz.solving.origin import origin_from_dict
from solver.data.exclusions import Exclusions
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Iteration
from solver.engines.start_tables import StartTables
from solver.errors import CancelledError, FitError, InputError
from solver.fit import OrbitFitter
from solver.io.parquet import read_frame

Request = dict
# Columns of a solution's tables from which a fit starts.
_OF_CALIBRATION = ("group", "offset")
_OF_SOURCES = ("source_id", "offset_ra", "offset_dec")
# Orbits of which lower distortion orders are precomputed: as large again as the rest of a fitter.
_WITH_LOWER_ORDERS = 2


class Fitters:
    """The fitters of the latest orbits, as many as the machine has room for."""

    def __init__(self, most: int | None = None) -> None:
        """Begin without any; keep `most`, by default as many as there is room for."""
        self._most = ready_orbits() if most is None else most
        # The latest last.
        self._kept: OrderedDict[str, OrbitFitter] = OrderedDict()

    def of(self, request: Request) -> OrbitFitter:
        """Return the fitter of the orbit of a request; InputError if the orbit cannot be read."""
        key = json.dumps([request["origin"], request["orbit"]], sort_keys=True)
        if key in self._kept:
            self._kept.move_to_end(key)
        else:
            # Forgotten first, so that the new one finds their memory.
            while len(self._kept) >= self._most:
                self._kept.popitem(last=False)
            origin = origin_from_dict(request["origin"])
            data = origin.read(request["orbit"])
            self._kept[key] = OrbitFitter(data, origin.read_instrument())
        for older in list(self._kept.values())[:-_WITH_LOWER_ORDERS]:
            older.forget_precomputed()
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
    return settings.with_(exclusions=Exclusions(), compare_orders=False)


def prepare(
    fitters: Fitters, request: Request, requests: queue.Queue[Request | None]
) -> Iterator[None]:
    """Fit an orbit and precompute its likely what-ifs; give way to requests for anything else."""

    def give_way(_: Iteration) -> None:
        with requests.mutex:
            waiting = list(requests.queue)
        if not all(_starts_from(request, later) for later in waiting):
            raise CancelledError("another request waits")

    # What is wrong with the orbit is said when something is asked of it.
    with suppress(CancelledError, InputError, FitError):
        fitter = fitters.of(request)
        settings = base_settings(FitSettings.from_dict(request["settings"]))
        fitted = fitter.fitted_settings
        if fitted is None or not fitted.serves(settings):
            base = base_of(request)
            is_same = base is not None and base.settings == settings
            fitter.prepare_what_ifs(settings, give_way, base.solution if base and is_same else None)
        yield from fitter.precompute(settings.order)


def _starts_from(prepared: Request, later: Request | None) -> bool:
    """Return whether a later request is a what-if that starts from the prepared fit."""
    return (
        later is not None
        and bool(later.get("what_if"))
        and all(later[key] == prepared[key] for key in ("origin", "orbit"))
    )
