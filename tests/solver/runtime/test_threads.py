import os
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

OVERLAP = """
from concurrent.futures import ThreadPoolExecutor
from threading import Event
import numpy
from threadpoolctl import threadpool_info
from solver.runtime.threads import one_blas_thread

def threads():
    return max(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")

first_is_in, second_is_in, first_is_out = Event(), Event(), Event()

def first():
    with one_blas_thread():
        first_is_in.set()
        second_is_in.wait(10)
    first_is_out.set()

def second():
    first_is_in.wait(10)
    with one_blas_thread():
        second_is_in.set()
        first_is_out.wait(10)
        inside = threads()
    return inside, threads()

before = threads()
with ThreadPoolExecutor(2) as helpers:
    one, two = helpers.submit(first), helpers.submit(second)
    print(before, *two.result())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="needs CPU affinity")
def test_a_worker_has_one_thread_and_may_run_on_any_core():
    run = subprocess.run([sys.executable, "-c", COUNT], capture_output=True, text=True)
    assert run.stdout.split() == ["1", "1"], run.stderr


def test_blas_has_one_thread_until_the_last_thread_needs_no_more():
    run = subprocess.run(
        [sys.executable, "-c", OVERLAP],
        capture_output=True,
        text=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "2"},
    )
    # With one core, it has one thread before.
    before, inside, after = run.stdout.split() or pytest.fail(run.stderr)
    assert (inside, after) == ("1", before)
