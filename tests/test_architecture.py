"""Imports go one way: every module has a rung, and imports nothing from a rung above it."""

import ast
import importlib
import subprocess
import sys
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent
PACKAGES = ("solver", "plateviz")

# Low to high. The modules of a package share its rung, and those of a rung may use each other.
RUNGS = (
    ("solver.errors", "solver.units", "solver.versions"),
    (
        "solver.schema",
        "solver.mode_schema",
        "solver.order_schema",
        "solver.survey_schema",
        "solver.columns",
    ),
    ("solver.parameters", "solver.device", "solver.threads", "solver.memory"),
    ("solver.orbit", "solver.instrument"),
    ("solver.exclusions", "solver.prior_text"),
    ("solver.settings",),
    ("solver.result",),
    ("solver.io",),
    (
        "solver.projection",
        "solver.aberration",
        "solver.distortion",
        "solver.detector",
        "solver.correlation",
    ),
    ("solver.astrometry", "solver.ephemeris", "solver.layout"),
    ("solver.apparent_motion",),
    ("solver.simple_structure", "solver.mode_names"),
    ("solver.forward", "solver.centres"),
    ("solver.tiles", "solver.patches", "solver.triangles"),
    ("solver.observed", "solver.priors"),
    ("solver.problem",),
    ("solver.selection",),
    ("solver.simulate",),
    ("solver.linearise", "solver.objective"),
    ("solver.products",),
    ("solver.tile_sums",),
    ("solver.normal",),
    ("solver.schur", "solver.part"),
    ("solver.coordinates",),
    ("solver.gauss_newton", "solver.leverage", "solver.carry"),
    ("solver.spectrum",),
    ("solver.estimate", "solver.bend", "solver.model"),
    ("solver.guide",),
    ("solver.svi", "solver.nuts", "solver.what_if", "solver.robust", "solver.starts"),
    ("solver.engines",),
    ("solver.checkpoint", "solver.agreement"),
    ("solver.diagnostics",),
    ("solver.orders",),
    ("solver.tables",),
    ("solver.mode_tables",),
    ("solver.summary",),
    ("solver.shared_errors",),
    ("solver.history", "solver.motion"),
    ("solver.time_series",),
    ("solver.fit",),
    ("plateviz.tables", "plateviz.job", "plateviz.cache"),
    ("plateviz.source", "plateviz.store", "plateviz.strip"),
    ("plateviz.runs",),
    ("plateviz.history", "plateviz.survey_worker"),
    ("plateviz.survey",),
    ("plateviz.plots",),
    ("plateviz.gallery", "plateviz.survey_tables"),
    ("plateviz.reports",),
    ("plateviz.state", "plateviz.worker", "plateviz.worker_process"),
    ("plateviz.workbench", "plateviz.session"),
    ("plateviz.navigation",),
    ("plateviz.views",),
    ("plateviz.app", "plateviz.closed_pages"),
    ("plateviz.server",),
    ("plateviz.demo", "plateviz.cli_output", "plateviz.cli_options", "plateviz.tap"),
    ("plateviz.notebook",),
    ("plateviz.gaia",),
    ("plateviz.cli_fit", "plateviz.cli_survey", "plateviz.cli_gaia", "plateviz.cli_report"),
    ("plateviz.cli_serve",),
    ("plateviz.reproduction",),
    ("plateviz.cli_reproduce",),
    ("plateviz.cli",),
)

USER_INTERFACE = ("panel", "param", "holoviews", "bokeh", "datashader")
NEVER = {
    "solver": ("plateviz", *USER_INTERFACE),
    "solver.simulate": ("solver.io.result",),
    "plateviz.tables": USER_INTERFACE,
    "plateviz.strip": USER_INTERFACE,
    "plateviz.source": USER_INTERFACE,
    "plateviz.job": USER_INTERFACE,
    "plateviz.cache": USER_INTERFACE,
    "plateviz.store": USER_INTERFACE,
    "plateviz.runs": (*USER_INTERFACE, "jax"),
    "plateviz.history": (*USER_INTERFACE, "jax"),
    "plateviz.plots": ("panel", "param", "plateviz.source", "plateviz.store"),
    "plateviz.state": ("panel",),
    "plateviz.navigation": ("panel", "holoviews", "bokeh", "datashader"),
    "plateviz.worker": ("panel",),
    "plateviz.worker_process": USER_INTERFACE,
    "plateviz.workbench": ("panel", "holoviews", "bokeh", "datashader"),
}

# The web process, the command line that starts it and all that they load stay free of JAX.
JAX = ("jax", "jaxlib", "equinox", "numpyro", "optax")
WITHOUT_JAX = ("solver.io", "solver.result", "solver.orbit", "plateviz")
WITH_JAX = ("plateviz.worker_process", "plateviz.survey", "plateviz.cli_survey")


def _within(name: str, parents: tuple[str, ...]) -> bool:
    return any(name == parent or name.startswith(f"{parent}.") for parent in parents)


def _module_name(path: Path) -> str:
    parts = path.relative_to(REPOSITORY).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {
    _module_name(path): ast.parse(path.read_text("utf-8"))
    for package in PACKAGES
    for path in sorted((REPOSITORY / package).rglob("*.py"))
}
PLACED = sorted(set(MODULES) - set(PACKAGES))


def _nodes(node: ast.AST, at_load: bool) -> Iterator[ast.AST]:
    """Walk the tree; `at_load` leaves out what importing the module does not run."""
    for child in ast.iter_child_nodes(node):
        if at_load and isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        if isinstance(child, ast.If) and ast.unparse(child.test).endswith("TYPE_CHECKING"):
            if not at_load:
                yield from _nodes(child, at_load)
            continue
        yield child
        yield from _nodes(child, at_load)


def _resolve(module: str, name: str) -> str:
    """Return the module that `from module import name` means."""
    if f"{module}.{name}" in MODULES:
        return f"{module}.{name}"
    if module in PACKAGES:
        return getattr(importlib.import_module(module), "_PUBLIC", {}).get(name, module)
    return module


def _imports(module: str, at_load: bool = False) -> set[str]:
    found = set()
    for node in _nodes(MODULES[module], at_load):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {_resolve(node.module or "", alias.name) for alias in node.names}
    return found - {module}


def _rung(module: str) -> int | None:
    return next((i for i, rung in enumerate(RUNGS) if _within(module, rung)), None)


def _loaded_by(module: str) -> set[str]:
    """Return all that importing `module` loads: parents, imports, and theirs."""
    loaded: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in loaded:
            loaded.add(name)
            waiting += [name.rpartition(".")[0]] if "." in name else []
            waiting += _imports(name, at_load=True) if name in MODULES else []
    return loaded


@pytest.mark.parametrize("module", PLACED)
def test_every_module_has_a_rung(module):
    assert _rung(module) is not None, f"give {module} a place in RUNGS"


@pytest.mark.parametrize("module", PLACED)
def test_no_import_points_back(module):
    rung = _rung(module)
    above = {name for name in _imports(module) if (_rung(name) or 0) > (rung or 0)}
    assert not above


@pytest.mark.parametrize("module", sorted(MODULES))
def test_no_import_is_forbidden(module):
    rules = [names for key, names in NEVER.items() if _within(module, (key,))]
    banned = tuple(name for names in rules for name in names)
    assert not {name for name in _imports(module) if _within(name, banned)}


def test_no_imports_go_in_a_circle():
    # The two packages' own __init__ name what all their modules hold, and are left out.
    graph = {name: _imports(name) & set(PLACED) for name in PLACED}
    assert set(TopologicalSorter(graph).static_order()) == set(graph)


@pytest.mark.parametrize("module", [m for m in MODULES if _within(m, WITHOUT_JAX)])
def test_web_process_modules_load_no_jax(module):
    loaded = {name for name in _loaded_by(module) if _within(name, JAX)}
    assert not loaded or _within(module, WITH_JAX)


@pytest.mark.parametrize(
    "module", ["solver.io.read", "plateviz.tables", "plateviz.plots", "plateviz.app"]
)
def test_import_leaves_jax_out(module):
    if module not in MODULES:
        pytest.skip(f"no module {module} yet")
    code = f"import sys, {module}; sys.exit('jax' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True)
    assert run.returncode == 0, run.stderr.decode()
