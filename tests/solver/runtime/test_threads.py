import subprocess
import sys

import pytest

COUNT = """
import os, sys
from solver.runtime.threads import use_one_thread
before = os.sched_getaffinity(0)
use_one_thread()
import jax.numpy as jnp, numpy
from threadpoolctl import threadpool_info
jnp.ones((300, 300)).sum().block_until_ready()
threads = os.listdir('/proc/self/task')
names = [open(f'/proc/self/task/{thread}/comm').read().strip() for thread in threads]
for thread in threads:
    assert os.sched_getaffinity(int(thread)) == before
print(names.count('tf_XLAEigen'), max(pool['num_threads'] for pool in threadpool_info()))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="needs CPU affinity")
def test_a_worker_has_one_thread_and_may_run_on_any_core():
    run = subprocess.run([sys.executable, "-c", COUNT], capture_output=True, text=True)
    assert run.stdout.split() == ["1", "1"], run.stderr
