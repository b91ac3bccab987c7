"""Fits of a survey without the workers, of which each would import and compile everything."""

from contextlib import contextmanager, nullcontext

import pytest


@contextmanager
def fitting_in_this_process():
    """Fit orbits one after the other in this process, in which a test may replace functions."""
    # Dask takes half a second to import.
    from plateviz.runs import dask_workers, fit_survey

    def fit(_, run, orbits):
        return (dask_workers.fit_survey_orbit(str(run.survey), run.name, one) for one in orbits)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fit_survey, "dask_client", lambda *_: nullcontext())
        patch.setattr(fit_survey, "fit_on_workers", fit)
        patch.setattr(dask_workers, "use_one_thread", lambda: None)
        yield
