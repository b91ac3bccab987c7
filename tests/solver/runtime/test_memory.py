import subprocess
import sys

import pytest

# Page faults of repeated allocations of an array, without those of the first two.
FAULTS = """
import resource, sys
import numpy as np
from solver.runtime.memory import keep_memory

def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt

if sys.argv[1:]:
    keep_memory()
for _ in range(2):
    np.ones(6_000_000)
before = faults()
for _ in range(5):
    np.ones(6_000_000)
print(faults() - before)
"""


def faults(*arguments):
    command = [sys.executable, "-c", FAULTS, *arguments]
    return int(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


@pytest.mark.skipif(sys.platform != "linux", reason="needs glibc")
def test_freed_memory_is_reused():
    assert faults("keep") < faults() / 10
