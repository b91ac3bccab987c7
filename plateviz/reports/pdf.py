"""Printing of a report as PDF with an installed Chromium."""

import os
import shutil
import subprocess
from pathlib import Path

from solver.errors import InputError
from solver.io.atomic import write_atomically
from solver.io.scratch import ScratchFolder, temporary_folder

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
# Limit of Chromium's virtual time, which advances as fast as the figures are drawn.
_BUDGET_MS = 60_000
_TIMEOUT_S = 180.0


def find_chromium() -> Path:
    """Return the path of the installed Chromium.

    Raises
    ------
    InputError
        If none is found.
    """
    for name in _NAMES:
        found = shutil.which(name)
        if found is not None:
            return Path(found)
    raise InputError(f"--pdf: expected one of {', '.join(_NAMES)} on the path, found none")


def print_pdf(page: Path, target: Path, overwrite: bool = False) -> None:
    """Print a report as PDF.

    Raises
    ------
    InputError
        If there is no Chromium, it fails, or `target` cannot be written.
    """
    chromium = find_chromium()
    profile_folder = ScratchFolder(temporary_folder(), "plateviz-chromium")
    with write_atomically(target, overwrite) as temporary, profile_folder as scratch:
        # As root, as in many containers, Chromium starts only without its sandbox.
        as_root = ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
        command = [
            str(chromium),
            "--headless",
            *as_root,
            "--disable-gpu",
            "--no-first-run",
            "--disable-background-networking",
            f"--user-data-dir={scratch.path}",
            f"--virtual-time-budget={_BUDGET_MS}",
            "--no-pdf-header-footer",
            f"--print-to-pdf={temporary.resolve()}",
            page.resolve().as_uri(),
        ]
        try:
            subprocess.run(command, check=True, capture_output=True, timeout=_TIMEOUT_S)
        except (OSError, subprocess.SubprocessError) as error:
            raise InputError(f"{target}: expected {chromium} to print, found: {error}") from error
        if not temporary.stat().st_size:
            raise InputError(f"{target}: expected {chromium} to print, found an empty file")
