"""Lint, format and types, and the house rules that no linter knows."""

import ast
import os
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import TypeCheckError

from solver.model.aberration import inverse_lorentz_factor

REPOSITORY = Path(__file__).resolve().parent.parent
CODE = ("solver", "plateviz")
MAX_LINES = {"solver": 300, "plateviz": 300, "tests": 500}
MAX_STATEMENTS = 40
PICKLES = {"pickle", "cPickle", "cloudpickle", "dill", "joblib", "marshal", "shelve"}

Rule = Callable[[ast.AST], bool]


def _files(*folders: str) -> list[Path]:
    return [path for folder in folders for path in sorted((REPOSITORY / folder).rglob("*.py"))]


def _called(node: ast.AST) -> str:
    """Return the last name of what `node` calls: "c" for a.b.c()."""
    if not isinstance(node, ast.Call):
        return ""
    return getattr(node.func, "attr", getattr(node.func, "id", ""))


def _is_assert(node: ast.AST) -> bool:
    return isinstance(node, ast.Assert)


def _is_print(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and ast.unparse(node.func) == "print"


def _is_broad_except(node: ast.AST) -> bool:
    if not isinstance(node, ast.ExceptHandler):
        return False
    if node.type is None:
        return True
    caught = node.type.elts if isinstance(node.type, ast.Tuple) else [node.type]
    return any(
        ast.unparse(name).split(".")[-1] in ("Exception", "BaseException") for name in caught
    )


def _is_pickle(node: ast.AST) -> bool:
    if isinstance(node, ast.Import):
        return any(alias.name.split(".")[0] in PICKLES for alias in node.names)
    if isinstance(node, ast.ImportFrom):
        return (node.module or "").split(".")[0] in PICKLES
    allowed = isinstance(node, ast.keyword) and node.arg == "allow_pickle"
    return _called(node) in ("read_pickle", "to_pickle") or (
        allowed and ast.unparse(node.value) != "False"
    )


def _is_eval(node: ast.AST) -> bool:
    return _called(node) in ("eval", "exec", "__import__")


def _is_stub(node: ast.AST) -> bool:
    return isinstance(node, ast.Name) and node.id == "NotImplementedError"


def _is_vector_field(node: ast.AST) -> bool:
    # By default it draws all arrows to one length, whatever their magnitude.
    return _called(node) == "VectorField"


def _is_long_function(node: ast.AST) -> bool:
    if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        return False
    return sum(isinstance(child, ast.stmt) for child in ast.walk(node)) - 1 > MAX_STATEMENTS


BANNED: dict[str, tuple[Rule, str]] = {
    "assert": (_is_assert, "assert x"),
    "print": (_is_print, "print(x)"),
    "bare except": (_is_broad_except, "try:\n    f()\nexcept:\n    pass"),
    "broad except": (_is_broad_except, "try:\n    f()\nexcept (OSError, Exception):\n    pass"),
    "pickle": (_is_pickle, "from pickle import load"),
    "pickled array": (_is_pickle, "np.load(path, allow_pickle=True)"),
    "pickled frame": (_is_pickle, "pd.read_pickle(path)"),
    "evaluated text": (_is_eval, "eval(text)"),
    "stub": (_is_stub, "raise NotImplementedError"),
    "arrows of one length": (_is_vector_field, "hv.VectorField(rows)"),
    "long function": (_is_long_function, "def f():\n" + "    g()\n" * (MAX_STATEMENTS + 1)),
}


@cache
def _trees() -> dict[Path, ast.Module]:
    """Return the parsed code by its file: only the process that looks at it takes the time."""
    return {path: ast.parse(path.read_text("utf-8")) for path in _files(*CODE, "tests")}


def _found(rule: Rule, *folders: str) -> list[str]:
    """Return "file:line" of all in the folders that breaks the rule."""
    return [
        f"{path}:{getattr(node, 'lineno', '?')}"
        for path, tree in _trees().items()
        if path.relative_to(REPOSITORY).parts[0] in folders
        for node in ast.walk(tree)
        if rule(node)
    ]


def _run(*command: str) -> subprocess.CompletedProcess[str]:
    # The wrapper of pyright would ask an index for its newest version.
    environment = {**os.environ, "PYRIGHT_PYTHON_IGNORE_WARNINGS": "1"}
    return subprocess.run(
        [sys.executable, "-m", *command],
        cwd=REPOSITORY,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.tools
@pytest.mark.parametrize(
    "command",
    [
        pytest.param(("ruff", "check", *CODE, "tests"), id="lint"),
        pytest.param(("ruff", "format", "--diff", *CODE, "tests"), id="format"),
        pytest.param(("pyright", "--pythonpath", sys.executable), id="types"),
    ],
)
def test_tool_finds_nothing(command):
    run = _run(*command)
    assert run.returncode == 0, f"{run.stdout}\n{run.stderr}"


@pytest.mark.parametrize("folder", MAX_LINES)
def test_files_are_short(folder):
    lines = {str(path): len(path.read_text("utf-8").splitlines()) for path in _files(folder)}
    assert not {path: n for path, n in lines.items() if n > MAX_LINES[folder]}


@pytest.mark.parametrize("what", BANNED)
def test_code_has_none(what):
    rule, _ = BANNED[what]
    assert not _found(rule, *CODE)


@pytest.mark.parametrize("what", BANNED)
def test_rule_finds_what_it_bans(what):
    rule, example = BANNED[what]
    assert any(rule(node) for node in ast.walk(ast.parse(example)))


def test_functions_of_the_tests_are_short():
    assert not _found(_is_long_function, "tests")


def test_shapes_are_checked_while_tests_run():
    with pytest.raises(TypeCheckError):
        inverse_lorentz_factor(np.zeros((2, 5)))


def test_shapes_are_checked_in_every_module_that_annotates_them(pytestconfig):
    checked = pytestconfig.getoption("--jaxtyping-packages").split(",")
    annotated = {
        ".".join(path.relative_to(REPOSITORY).with_suffix("").parts)
        for path, tree in _trees().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module == "jaxtyping"
    }
    solver = {name for name in annotated if name.startswith("solver.")}
    assert not {
        name for name in solver if not any(f"{name}.".startswith(f"{one}.") for one in checked)
    }
