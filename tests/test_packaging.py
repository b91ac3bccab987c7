"""What is promised to those who install: pins, commands, and a wheel with everything in it."""

import ast
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

REPOSITORY = Path(__file__).resolve().parent.parent
PACKAGES = ("plateviz", "solver")
INSTALL_COMMAND = "pip install . && plateviz demo"
TEST_COMMAND = "pip install '.[test]' && pytest"


def _read(name: str) -> str:
    return (REPOSITORY / name).read_text("utf-8")


PROJECT = tomllib.loads(_read("pyproject.toml"))["project"]
RUNTIME = [Requirement(text) for text in PROJECT["dependencies"]]
TEST = [Requirement(text) for text in PROJECT["optional-dependencies"]["test"]]


# Each file of pins, and the versions of Python that it is for.
PINS = {
    "constraints.txt": ("3.11", "3.12", "3.13"),
    "constraints-3.13.txt": ("3.13",),
}
# The first version without the holes that are known.
KNOWN_HOLES = {
    "bokeh": "3.8.2",
    "jinja2": "3.1.6",
    "jupyter-server": "2.20",
    "pyarrow": "23.0.1",
    "tornado": "6.5.5",
}
of_every_pin_file = pytest.mark.parametrize("name", PINS)


def _pins(name: str, python: str) -> dict[str, str]:
    """Return package -> version of what a file pins for one version of Python."""
    lines = [line for line in _read(name).splitlines() if "==" in line]
    pins = [Requirement(line.rstrip(" \\")) for line in lines]
    environment = {"python_version": python, "python_full_version": f"{python}.0"}
    return {
        canonicalize_name(pin.name): str(pin.specifier).removeprefix("==")
        for pin in pins
        if pin.marker is None or pin.marker.evaluate(environment)
    }


def test_every_pin_file_is_tested():
    assert {path.name for path in REPOSITORY.glob("constraints*.txt")} == set(PINS)
    assert all(name in _read(".ci/run") for name in PINS)


@of_every_pin_file
def test_constraints_name_no_index(name):
    assert not re.search(r"://|pypi|^-", _read(name), flags=re.MULTILINE)


@of_every_pin_file
def test_every_pin_has_a_hash(name):
    blocks = re.split(r"\n(?=\S)", _read(name).strip())
    unhashed = [block for block in blocks if "--hash=sha256:" not in block]
    assert [block[0] for block in unhashed] == ["#"], "only the header has none"


@pytest.mark.parametrize(
    ("name", "python"), [(name, python) for name in PINS for python in PINS[name]]
)
@pytest.mark.parametrize("requirement", RUNTIME + TEST, ids=lambda requirement: requirement.name)
def test_dependency_is_pinned_within_its_bounds(requirement, name, python):
    pin = _pins(name, python).get(canonicalize_name(requirement.name))
    assert pin is not None, f"make {name} anew, with the command in its first line"
    assert requirement.specifier.contains(pin, prereleases=True)


@pytest.mark.parametrize("package", KNOWN_HOLES)
def test_floor_and_pins_are_above_known_holes(package):
    extras = PROJECT["optional-dependencies"].values()
    declared = [*RUNTIME, *(Requirement(text) for extra in extras for text in extra)]
    floors = [one.specifier for one in declared if one.name == package]
    safe = Version(KNOWN_HOLES[package])
    assert floors
    for specifier in floors:
        assert min(Version(one.version) for one in specifier if one.operator == ">=") >= safe
    for name, pythons in PINS.items():
        assert all(Version(_pins(name, python)[package]) >= safe for python in pythons)


def test_newest_pins_are_no_older():
    older, newer = _pins("constraints.txt", "3.13"), _pins("constraints-3.13.txt", "3.13")
    assert not {
        name for name in older if name in newer and Version(newer[name]) < Version(older[name])
    }


@pytest.mark.parametrize("package", PACKAGES)
def test_what_is_imported_is_declared(package):
    declared = {canonicalize_name(requirement.name) for requirement in RUNTIME}
    providers = packages_distributions()
    undeclared = {
        name
        for name in _top_level_imports(package)
        if not declared & {canonicalize_name(p) for p in providers.get(name, [])}
    }
    assert not undeclared


def _top_level_imports(package: str) -> set[str]:
    names: set[str] = set()
    for path in (REPOSITORY / package).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Import):
                names |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                names.add((node.module or "").partition(".")[0])
    return names - set(sys.stdlib_module_names) - set(PACKAGES)


@pytest.mark.parametrize("command", [INSTALL_COMMAND, TEST_COMMAND])
def test_readme_gives_the_command(command):
    assert command in _read("README.md")


def test_ci_runs_the_test_command_of_the_readme():
    assert TEST_COMMAND in _read(".ci/run")


def test_changelog_names_this_version_or_the_next():
    headings = re.findall(r"^## \[(.+?)\]", _read("CHANGELOG.md"), flags=re.MULTILINE)
    assert headings
    assert headings[0] in ("Unreleased", PROJECT["version"])


def test_wheel_holds_every_file_of_both_packages(tmp_path):
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    run = subprocess.run(build, cwd=REPOSITORY, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    with zipfile.ZipFile(next(tmp_path.glob("*.whl"))) as wheel:
        packed = set(wheel.namelist())
    files = [path for package in PACKAGES for path in (REPOSITORY / package).rglob("*")]
    expected = {
        path.relative_to(REPOSITORY).as_posix()
        for path in files
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert expected <= packed
