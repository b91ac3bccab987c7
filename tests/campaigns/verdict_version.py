"""Version of the verdict: records of trials under different rules must not be mixed."""

import ast
import hashlib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# What decides on the state of a solution and on the first cause, what names it, and what a fit
# with a cause adjusts before its solution.
_PARTS = (
    "solver/results/diagnosis/*.py",
    "plateviz/verdict/catalogue_offset.py",
    "plateviz/verdict/causes.py",
    "plateviz/verdict/*cause_harm.py",
    "plateviz/verdict/*cause_words.py",
    "plateviz/verdict/left_out_together.py",
    "plateviz/verdict/verdict.py",
    "solver/engines/moves.py",
    "solver/engines/noise.py",
    "solver/engines/variance_model.py",
)


def verdict_version() -> str:
    """Return a digest of the code of the verdict, the same for other words and comments."""
    digest = hashlib.sha256()
    for path in verdict_files():
        digest.update(code_of(path.read_text(encoding="utf-8")).encode())
    return digest.hexdigest()[:12]


def verdict_files() -> list[Path]:
    """Return the files of the verdict."""
    return sorted(path for part in _PARTS for path in ROOT.glob(part))


def code_of(source: str) -> str:
    """Return a text of the code alone: without comments, docstrings and other sentences."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value:
            node.value = " "
    return ast.dump(tree)
