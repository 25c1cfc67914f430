"""A run's bytes do not depend on how many cores the machine's linear algebra may use."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from threadpoolctl import threadpool_info

import pbrg_mj as pbrg

RUN = """
{first}
import pbrg_mj as pbrg
scenario = pbrg.load("scale/hundred_robots", {{"log.timings": False}}, duration=0.2)
pbrg.run(scenario, log="{name}.mcap")
"""


@pytest.mark.parametrize("first", ["", "import numpy", "import scipy.linalg"])
def test_a_hundred_robots_have_the_same_bytes_whatever_threads_are_asked_for(first, tmp_path):
    for threads in ("1", "8"):
        program = RUN.format(first=first, name=threads)
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": threads, "MKL_NUM_THREADS": threads}
        subprocess.run([sys.executable, "-c", program], cwd=tmp_path, env=environment, check=True)
    assert (tmp_path / "1.mcap").read_bytes() == (tmp_path / "8.mcap").read_bytes()


def test_every_library_that_is_loaded_works_on_one_thread():
    assert pbrg.TickRecord is not None  # the simulator is loaded, and with it NumPy
    libraries = [one for one in threadpool_info() if one["user_api"] == "blas"]
    assert libraries
    assert {one["num_threads"] for one in libraries} == {1}
