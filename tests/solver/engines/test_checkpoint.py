import numpy as np
import pytest

from solver.data.engine_settings import SviSettings
from solver.data.settings import FitSettings
from solver.engines.checkpoint import resume_from
from solver.engines.gauss_newton import Iteration
from solver.engines.svi import SviState
from solver.errors import CancelledError, InputError
from solver.fit import OrbitFitter

SETTINGS = FitSettings(engine="svi", svi=SviSettings(steps=100, max_steps=150))


@pytest.fixture
def state():
    rng = np.random.default_rng(0)
    trace = [Iteration(50, 3.0, 2.0, 1.0, "focal length [3]", 0.0, 0.5)]
    arrays = rng.standard_normal(5), rng.standard_normal((4, 2)), rng.standard_normal((2, 4))
    return SviState(50, (0, 1e4), *arrays, rng.standard_normal(50), trace)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.npz"


def test_state_comes_back_as_it_was(small_orbit, path, state):
    first = resume_from(path, small_orbit.data, SETTINGS)
    assert first.state is None
    first.keep(state)
    found = resume_from(path, small_orbit.data, SETTINGS).state
    assert (found.step, found.cycle, found.trace) == (state.step, state.cycle, state.trace)
    for name in ("theta", "sources", "scale", "losses"):
        np.testing.assert_array_equal(getattr(found, name), getattr(state, name))
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_other_settings_are_another_fit(small_orbit, path, state):
    resume_from(path, small_orbit.data, SETTINGS).keep(state)
    with pytest.raises(InputError, match="this very fit, found that of other files or settings"):
        resume_from(path, small_orbit.data, SETTINGS.with_(order=4))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 not a checkpoint"])
def test_damaged_file_is_refused(small_orbit, path, content):
    path.write_bytes(content)
    with pytest.raises(InputError, match="expected the checkpoint of an svi run"):
        resume_from(path, small_orbit.data, SETTINGS)
    assert path.read_bytes() == content


def test_truncated_file_is_refused(small_orbit, path, state):
    resume_from(path, small_orbit.data, SETTINGS).keep(state)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match="expected the checkpoint of an svi run"):
        resume_from(path, small_orbit.data, SETTINGS)


def test_place_that_cannot_be_written_is_refused_before_the_fit(small_orbit, tmp_path):
    with pytest.raises(InputError, match="found no folder"):
        resume_from(tmp_path / "none" / "run.npz", small_orbit.data, SETTINGS)


def test_fit_goes_on_in_another_process_from_the_file(small_orbit, path):
    """As far as the file tells: by another fitter, which knows nothing of the first."""
    data, instrument = small_orbit.data, small_orbit.instrument

    def cancel(row):
        if row.iteration == 100:
            raise CancelledError("now")

    with pytest.raises(CancelledError):
        OrbitFitter(data, instrument).fit(SETTINGS, cancel, resume_from(path, data, SETTINGS))
    seen = []
    result = OrbitFitter(data, instrument).fit(
        SETTINGS, lambda row: seen.append(row.iteration), resume_from(path, data, SETTINGS)
    )
    assert seen == [125, 150]
    assert len(result.losses) == 150
