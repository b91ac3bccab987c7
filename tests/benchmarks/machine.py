"""Description of the machine, timing and printing, shared by all benchmarks."""

import os
import platform
import resource
import statistics
import sys
import time
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

import jax

_PACKAGES = ("numpy", "scipy", "jax", "jaxlib")


def machine() -> str:
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in _PACKAGES)
    return f"{cpu_model()}, {usable_cores()} cores, Python {platform.python_version()}, {versions}"


def device() -> str:
    """Return the device that JAX uses: "cpu", or the platform and the name of the device."""
    used = jax.devices()[0]
    return used.platform if used.platform == "cpu" else f"{used.platform} ({used.device_kind})"


def cpu_model() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text(encoding="utf-8").splitlines() if cpuinfo.exists() else []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or platform.machine())


def usable_cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def peak_memory_mib() -> float:
    """Return the peak memory of this process so far."""
    # `ru_maxrss` is in KiB on Linux and in bytes on macOS.
    per_mib = 1024.0**2 if sys.platform == "darwin" else 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / per_mib


def memory_mb(process: int) -> float:
    """Return the memory, MB, that a process of Linux has at the moment."""
    lines = Path(f"/proc/{process}/status").read_text(encoding="utf-8").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) * 1024 / 1e6


def processor_seconds(process: int) -> float:
    """Return the time, s, for which a process of Linux has used processors."""
    # The name, in parentheses, may have spaces.
    fields = Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def time_of(work: Callable[[], object], repeat: int, least_seconds: float = 0.0) -> float:
    """Return the median time, s, of at least `repeat` runs that take `least_seconds` together."""
    seconds: list[float] = []
    while len(seconds) < repeat or sum(seconds) < least_seconds:
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds)


def write(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()
