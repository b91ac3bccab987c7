"""The user's cache directory, and JAX's compilation cache in it."""

import os
import warnings
from pathlib import Path

import platformdirs


def cache_directory() -> Path:
    """Return the user's cache directory of plateviz; it need not exist."""
    return Path(platformdirs.user_cache_dir("plateviz", appauthor=False))


def keep_compilations() -> None:
    """Make JAX store compiled code in the cache directory; call before JAX is imported.

    Compiling the model takes some seconds, reading it back a tenth of one. Values that the
    user has set for the same environment variables are kept. A cache that cannot be written or
    read, on a full disk for instance, costs time only, and is not reported.
    """
    warnings.filterwarnings(
        "ignore", message="Error (reading|writing) persistent compilation cache entry"
    )
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(cache_directory() / "compiled"))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.3")
