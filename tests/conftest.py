"""Fixtures shared by all tests."""

import gc
import lzma
import os
from pathlib import Path

import hypothesis
import jax
import jaxlib.version
import pytest
from xdist.scheduler import LoadFileScheduling

from solver.errors import InputError
from solver.runtime.device import require_device
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey

# A process that waits for others is no fault.
hypothesis.settings.register_profile("tests", deadline=None)
hypothesis.settings.load_profile("tests")

_QUICK_TO_COMPILE = (
    "--xla_cpu_use_fusion_emitters=false",
    "--xla_cpu_parallel_codegen_split_count=1",
)

REPOSITORY = Path(__file__).resolve().parent.parent


def pytest_addoption(parser):
    parser.addoption("--device", help="what JAX computes on: cpu, cuda, ...; JAX chooses if unset")


def pytest_configure(config):
    _share_compilations(config)
    _emit_in_one_piece()
    _choose(config.getoption("--device") or os.environ.get("JAX_PLATFORMS", ""))
    if jax.default_backend() == "cpu":
        _compile_in_a_hurry()


def pytest_collection_modifyitems(items):
    """Run the browser tests first: of all that one process runs, they take longest."""
    items.sort(key=lambda item: "ui" not in item.keywords)


def pytest_collection_finish():
    """Let the garbage collector pass over what collecting the tests has made: it stays."""
    gc.freeze()


def pytest_sessionfinish():
    """Let JAX find its objects again: it reports those that are left when Python ends."""
    gc.unfreeze()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Run the tests of a file in one process, and those of tests/ui, with a browser, in two."""
    config.option.loadscopereorder = False
    return _ByFile(config, log)


class _ByFile(LoadFileScheduling):
    """Give each process a file at a time, and half of tests/ui at once.

    One chain of browser tests would take longer than all others; more than two browsers at a time
    would wait for one another.
    """

    def _split_scope(self, nodeid):
        file = super()._split_scope(nodeid)
        if not file.startswith("tests/ui/"):
            return file
        return "tests/ui, first half" if file < "tests/ui/test_n" else "tests/ui, second half"


def _share_compilations(config):
    """Let every process of the tests use what another one has compiled.

    The key of an entry holds the program, the compiler's options and its version. Without pytest's
    cache, as with `-p no:cacheprovider`, each process compiles for itself.
    """
    if not config.pluginmanager.has_plugin("cacheprovider"):
        return
    folder = config.cache.mkdir("compiled")
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(folder))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
    # JAX has been imported and does not read the environment again.
    jax.config.update("jax_compilation_cache_dir", os.environ["JAX_COMPILATION_CACHE_DIR"])
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


def _emit_in_one_piece():
    """Let XLA make code for the CPU in its older way and without threads: in a third of the time.

    XLA reads its flags once, when it looks for devices, ends at one that it does not know, and has
    no older way any more in its later versions. Other devices ignore the flags.
    """
    if jaxlib.version.__version_info__ < (0, 11):
        flags = dict.fromkeys([*os.environ.get("XLA_FLAGS", "").split(), *_QUICK_TO_COMPILE])
        os.environ["XLA_FLAGS"] = " ".join(flags)


def _compile_in_a_hurry():
    """Leave out most optimisations, here and in the processes that tests start.

    A test runs next to nothing of what it compiles. Only the CPU's compiler is known to hurry.
    What one process has compiled serves another only if both compile in the same way.
    """
    os.environ["JAX_DISABLE_MOST_OPTIMIZATIONS"] = "1"
    jax.config.update("jax_disable_most_optimizations", True)


def _choose(device):
    if device:
        # For the processes that tests start: here JAX has been imported and does not look again.
        os.environ["JAX_PLATFORMS"] = device
        jax.config.update("jax_platforms", device)
    try:
        require_device()
    except InputError as error:
        raise pytest.UsageError(str(error)) from error


@pytest.fixture(scope="session")
def sample_orbit_dir(tmp_path_factory) -> Path:
    """Folder of the sample orbit's three FITS files, unpacked from tests/data."""
    folder = tmp_path_factory.mktemp("sample-orbit")
    for packed in sorted((REPOSITORY / "tests" / "data").glob("*.fits.xz")):
        (folder / packed.stem).write_bytes(lzma.decompress(packed.read_bytes()))
    return folder


@pytest.fixture(scope="session")
def small_survey(tmp_path_factory) -> Path:
    """A survey directory of two sparse orbits."""
    directory = tmp_path_factory.mktemp("survey") / "small"
    simulate_survey(directory, SurveySettings(orbits=2, seed=3).scaled(4000))
    return directory


@pytest.fixture
def few_figures(monkeypatch):
    """Leave out most figures of an orbit's report, where their number proves nothing."""
    from plateviz.plots.gallery import diagnostics

    some = [one for one in diagnostics() if one.name in ("footprint", "comparison")]
    monkeypatch.setattr("plateviz.reports.orbit.diagnostics", lambda: some)


@pytest.fixture(scope="session")
def nbformat():
    """The package; importing it takes seconds, which only a process that needs it shall wait."""
    import nbformat

    return nbformat
