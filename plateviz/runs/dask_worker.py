"""One orbit of a run, fitted in a process of its own: the task that Dask sends to its workers."""

import time
from pathlib import Path
from typing import NamedTuple

from plateviz.cache import keep_compilations
from plateviz.runs.run import Run
from solver.data.instrument import parse_instrument
from solver.errors import FitError, InputError
from solver.io.survey import HEADER, read_header, read_survey_orbit
from solver.runtime.memory import keep_memory
from solver.runtime.threads import use_one_thread


class Outcome(NamedTuple):
    """What became of one orbit; `message` says why it failed, and is empty if it did not."""

    orbit: int
    seconds: float
    message: str


def fit_survey_orbit(survey: str, name: str, orbit: int) -> Outcome:
    """Fit one orbit of a run that was begun, and write it where the run keeps it.

    An orbit that has no solution is written down as such; every other error is raised.
    """
    start = time.perf_counter()
    run, message = Run(Path(survey), name), ""
    keep_memory()
    keep_compilations()
    use_one_thread()
    try:
        _fit(run, orbit)
    except (InputError, FitError) as error:
        message = str(error)
        run.keep_failure(orbit, message)
    return Outcome(orbit, time.perf_counter() - start, message)


def _fit(run: Run, orbit: int) -> None:
    # Only now: JAX counts the threads that it may use when it is imported.
    from solver.fit import OrbitFitter

    instrument = parse_instrument(str(read_header(run.survey)["instrument"]), run.survey / HEADER)
    fitter = OrbitFitter(read_survey_orbit(run.survey, orbit), instrument)
    result = fitter.fit(run.settings())
    run.keep(orbit, result, fitter.history(result))
