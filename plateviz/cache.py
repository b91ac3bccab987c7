"""Where plateviz keeps what it can make again."""

import os
from pathlib import Path

import platformdirs


def cache_directory() -> Path:
    """Return the user's cache directory of plateviz; it need not exist."""
    return Path(platformdirs.user_cache_dir("plateviz", appauthor=False))


def keep_compilations() -> None:
    """Let JAX keep what it compiles between processes; call before JAX is imported.

    Compiling the model takes some seconds, reading it back a tenth of one. A user's own
    setting of the same variables is left alone.
    """
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(cache_directory() / "compiled"))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.3")
