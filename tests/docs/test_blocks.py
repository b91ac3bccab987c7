"""Commands and code of the pages: run in a folder with the files they name, or parsed."""

import ast
import re
import shlex
import shutil
import tomllib

import pytest
from typer.main import get_command

from plateviz.cli.main import app
from tests.docs.pages import DOCS, PAGES, README, REPOSITORY, blocks_of, section_of

COMMANDS = get_command(app).commands
SHELL = [block for page in (README, *PAGES) for block in blocks_of(page, "sh")]
PYTHON = [block for page in (README, *PAGES) for block in blocks_of(page, "python")]
# Its blocks are files and changes of the code; test_contributing.py runs them.
CONTRIBUTING = DOCS / "contributing.md"
# Commands too slow for a page's test, and the test that runs them.
ELSEWHERE = {"demo": "tests/ui/test_demo.py"}
# Options that make a command small, or avoid a port in use.
SMALLER = {
    "simulate": ["--orbits", "2", "--stars", "2000"],
    "serve": ["--port", "0"],
}
_OTHER_PROGRAMS = {
    "pytest",
    "ruff",
    "pyright",
    "dask",
    "pip-audit",
    "printf",
    "ssh",
    ".",
    "jupyter",
    "panel",
}
EXTRAS = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))["project"][
    "optional-dependencies"
]

of_shell = pytest.mark.parametrize("block", SHELL, ids=lambda block: block.name)
of_python = pytest.mark.parametrize("block", PYTHON, ids=lambda block: block.name)


def run_of(page, *languages):
    """Return the blocks of a page without a reason not to run them."""
    return [block for block in blocks_of(page, *languages) if not block.reason]


def parsed(words):
    """Parse a command line of plateviz; a wrong option or value fails the test."""
    _, name, *rest = words
    if name == "--help" or "--help" in rest:
        return
    COMMANDS[name].make_context(name, rest)


def programs(block):
    """Return the command lines of a block; a line with several is split."""
    return [shlex.split(part) for line in block.commands() for part in re.split(r"&&|\s&\s", line)]


@of_shell
def test_command_is_known(block):
    # The option of this recipe is known to the copy of the code in test_contributing.py alone.
    if block.text in section_of(CONTRIBUTING, "Add a setting"):
        assert "--min-obs" in block.text
        return
    for program, *rest in programs(block):
        known = {
            "plateviz": lambda rest=rest: parsed(["plateviz", *rest]),
            "pip": lambda rest=rest: _known_extra(rest),
            "python": lambda rest=rest: _known_script(rest),
            "sphinx-build": lambda rest=rest: _known_folder(rest),
        }
        if program in known:
            known[program]()
        else:
            assert program in _OTHER_PROGRAMS, program


def _known_extra(words):
    assert words[0] == "install"
    for extra in re.findall(r"\[(.+?)\]", " ".join(words)):
        assert extra in EXTRAS


def _known_script(words):
    if words[0] != "-m":
        script = (REPOSITORY / words[0]).read_text("utf-8")
        assert all(option in script for option in words if option.startswith("--"))


def _known_folder(words):
    assert (REPOSITORY / words[-2]).is_dir()


@of_python
def test_code_parses(block):
    ast.parse(block.text)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_page_says_why_a_block_is_not_run(page):
    reasons = [block.reason for block in blocks_of(page, "sh", "python") if block.reason]
    assert all(re.match(r"needs|takes", reason) for reason in reasons)
    # No mark is misspelt or without a block.
    assert page.read_text("utf-8").count("not run:") == len(reasons)


# The first page waits for the files of all, and a page has several programs that are compiled.
@pytest.mark.timeout(900)
@pytest.mark.slow
@pytest.mark.usefixtures("few_figures")
@pytest.mark.parametrize(
    "page",
    [
        # Its commands differ in their causes only, whose fits and options have tests of their own.
        pytest.param(page, marks=pytest.mark.full if page.stem == "causes" else ())
        for page in PAGES
        if page != CONTRIBUTING and run_of(page, "sh")
    ],
    ids=lambda page: page.stem,
)
def test_commands_of_a_page_run(page, command, workplace):
    for block in run_of(page, "sh"):
        for words in programs(block):
            if words[1] in ELSEWHERE:
                test = (REPOSITORY / ELSEWHERE[words[1]]).read_text("utf-8")
                assert f'"{words[1]}"' in test
                continue
            # The folder has what other pages need, which this command is to make.
            if words[1] == "simulate":
                shutil.rmtree(workplace / "DIR")
            if "-o" in words:
                (workplace / words[words.index("-o") + 1]).unlink(missing_ok=True)
            assert command([*words, *SMALLER.get(words[1], [])]) == 0, words


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if page != CONTRIBUTING and run_of(page, "python")],
    ids=lambda page: page.stem,
)
def test_code_of_a_page_runs(page, command, workplace):
    assert command(["plateviz", "survey", "DIR"]) == 0
    namespace = {}
    for block in run_of(page, "python"):
        exec(compile(block.text, block.name, "exec"), namespace)


def test_wrong_option_is_found():
    for wrong in (["fit", "OBS", "REF", "--oder", "5", "-o", "R"], ["serve", "DIR", "--port", "x"]):
        with pytest.raises(Exception, match=r"No such option|valid integer"):
            parsed(["plateviz", *wrong])
