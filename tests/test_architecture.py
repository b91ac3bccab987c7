"""Imports go one way: each package has a list of folders, and none imports one above it."""

import ast
import importlib
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent

# Low to high: a folder imports what stands before it. `plateviz` imports all of `solver`.
FOLDERS = {
    "solver": (
        "errors",
        "units",
        "data",
        "runtime",
        "model",
        "io",
        "problem",
        "simulate",
        "linear",
        "engines",
        "results",
        "fit",
    ),
    "plateviz": (
        "cache",
        "figures",
        "tables",
        "verdict",
        "plots",
        "runs",
        "solving",
        "reports",
        "dashboard",
        "notebook",
        "cli",
    ),
}
# Folders and modules of the dashboard, too; each imports those before it.
DASHBOARD = (
    "serving",
    "address_parts",
    "at_rest",
    "selection",
    "session",
    "navigation",
    "saving",
    "views",
    "ticker",
    "app",
    "server",
)
# Folders of its views, too.
VIEWS = ("elements", "browser", "saving", "cards", "dialogs", "controls", "panes", "pages")
# Folders and modules of the figures, too.
PLOTS = (
    *("workspace", "elements", "diagnostic", "survey_figure", "gallery", "explore", "comparison"),
    *("residuals", "sky", "calibration", "weak_directions", "survey", "source"),
)
# Modules at the top of a package: everybody's, and the front door.
LOOSE = {"solver.errors", "solver.units", "solver.fit", "plateviz.cache"}

USER_INTERFACE = ("panel", "param", "holoviews", "bokeh", "datashader")
NEVER = {
    "solver": ("plateviz", *USER_INTERFACE),
    # The verdict is measured on the defects of simulations, and must not know them.
    "solver.results": ("solver.simulate",),
    "plateviz.tables": USER_INTERFACE,
    "plateviz.verdict": ("solver.simulate", *USER_INTERFACE),
    "plateviz.runs": USER_INTERFACE,
    "plateviz.solving": USER_INTERFACE,
    "plateviz.figures": ("panel", "param"),
    "plateviz.figures.figure": ("pandas", *USER_INTERFACE),
    "plateviz.plots": ("panel", "param", "holoviews", "bokeh"),
    "plateviz.dashboard.selection.selection": ("panel",),
    "plateviz.dashboard.session.fit_choices": ("panel",),
    "plateviz.dashboard.session.session": ("panel", "holoviews", "bokeh", "datashader"),
    "plateviz.dashboard.navigation.navigation": ("panel", "holoviews", "bokeh", "datashader"),
}

# The web process, the command line that starts it and all that they load stay free of JAX.
JAX = ("jax", "jaxlib", "equinox", "numpyro", "optax")
WITHOUT_JAX = ("solver.data", "solver.io", "plateviz")
# The process that fits, and what `plateviz survey` imports once it fits.
WITH_JAX = (
    "plateviz.solving.fitters",
    "plateviz.solving.preparation",
    "plateviz.solving.solver_process",
    "plateviz.solving.survey_jobs",
    "plateviz.runs.fit_survey",
    "plateviz.runs.watch",
)


def _within(name: str, parents: tuple[str, ...]) -> bool:
    return any(name == parent or name.startswith(f"{parent}.") for parent in parents)


def _module_name(path: Path) -> str:
    parts = path.relative_to(REPOSITORY).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {
    _module_name(path): path
    for package in FOLDERS
    for path in sorted((REPOSITORY / package).rglob("*.py"))
}
PLACED = sorted(set(MODULES) - set(FOLDERS))


@cache
def _tree(module: str) -> ast.Module:
    return ast.parse(MODULES[module].read_text("utf-8"))


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
    if module in FOLDERS:
        return getattr(importlib.import_module(module), "_PUBLIC", {}).get(name, module)
    return module


def _imports(module: str, at_load: bool = False) -> set[str]:
    found = set()
    for node in _nodes(_tree(module), at_load):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {_resolve(node.module or "", alias.name) for alias in node.names}
    return found - {module}


def _height(module: str) -> tuple[int, int]:
    """Return how high the folder of a module stands; ValueError if no list names it."""
    package, folder = module.split(".")[:2]
    return list(FOLDERS).index(package), FOLDERS[package].index(folder)


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


def test_every_module_and_folder_is_listed():
    found = {
        package: {m.split(".")[1] for m in PLACED if _within(m, (package,))} for package in FOLDERS
    }
    assert found == {package: set(folders) for package, folders in FOLDERS.items()}


def test_every_rule_is_about_a_module_that_exists():
    named = [*LOOSE, *NEVER, *WITHOUT_JAX, *WITH_JAX]
    assert not {name for name in named if name not in MODULES}


def test_nothing_else_lies_loose_at_the_top():
    loose = {
        m
        for m in PLACED
        if m.count(".") == 1 and (REPOSITORY / f"{m.replace('.', '/')}.py").exists()
    }
    assert loose == LOOSE


@pytest.mark.parametrize("folder", [m for m in PLACED if m not in LOOSE and m.count(".") == 1])
def test_every_folder_says_in_one_sentence_what_it_holds_and_imports(folder):
    summary, *rest = (ast.get_docstring(_tree(folder)) or "").split("\n\n")
    assert summary.endswith(".")
    assert "\n" not in summary
    assert "Imports" in "\n\n".join(rest)


@pytest.mark.parametrize("module", PLACED)
def test_no_import_points_up(module):
    known = [name for name in _imports(module) if name in PLACED]
    assert not {name for name in known if _height(name) > _height(module)}


@pytest.mark.parametrize("module", [m for m in PLACED if m.startswith("plateviz.dashboard.")])
def test_no_import_within_the_dashboard_points_up(module):
    def height(name):
        _, _, folder, *rest = name.split(".")
        return DASHBOARD.index(folder), VIEWS.index(rest[0]) if folder == "views" and rest else -1

    inside = [name for name in _imports(module) if _within(name, ("plateviz.dashboard",))]
    assert not {name for name in inside if name.count(".") > 1 and height(name) > height(module)}


@pytest.mark.parametrize("module", [m for m in PLACED if m.startswith("plateviz.plots.")])
def test_no_import_within_the_figures_points_up(module):
    def height(name):
        return PLOTS.index(name.split(".")[2])

    inside = [name for name in _imports(module) if _within(name, ("plateviz.plots",))]
    assert not {name for name in inside if name.count(".") > 1 and height(name) > height(module)}


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


def test_import_leaves_jax_out():
    """The lists above are of what the code says; this is what importing it does."""
    modules = "solver.io.read_orbit", "plateviz.tables", "plateviz.plots", "plateviz.dashboard.app"
    lines = [f"import {name}; assert 'jax' not in sys.modules, '{name}'" for name in modules]
    code = "\n".join(["import sys", *lines])
    run = subprocess.run([sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True)
    assert run.returncode == 0, run.stderr.decode()


def test_tests_mirror_the_folders():
    """A test module lies in the folder of the modules that it tests, or above it."""
    for package, folders in FOLDERS.items():
        tests = {p.name for p in (REPOSITORY / "tests" / package).iterdir() if p.is_dir()}
        assert tests - {"__pycache__"} <= set(folders)
