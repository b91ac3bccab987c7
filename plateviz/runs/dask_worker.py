"""The task that Dask sends to its workers: fit one orbit of a run."""

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
    """Outcome of one orbit; `message` is the reason if it failed, otherwise empty."""

    orbit: int
    seconds: float
    message: str


def fit_survey_orbit(survey: str, name: str, orbit: int) -> Outcome:
    """Fit one orbit of a run whose directory exists, and write it into the run.

    An orbit without a solution is recorded as failed; every other error is raised.
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
    # Imported here, because JAX sets its number of threads when it is imported.
    from solver.fit import OrbitFitter

    instrument = parse_instrument(str(read_header(run.survey)["instrument"]), run.survey / HEADER)
    fitter = OrbitFitter(read_survey_orbit(run.survey, orbit), instrument)
    result = fitter.fit(run.settings())
    run.keep(orbit, result, fitter.history(result))
