"""A node's own generator of random numbers: the same for a seed and a name, and imported only where it is used."""

import subprocess
import sys

import numpy as np

from busflow.node.rng import Rng


def test_a_random_generator_can_be_reset():
    one, two = Rng(7, "/left/arm"), Rng(7, "/left/arm")
    assert isinstance(one, np.random.Generator)
    first = one.normal(size=5).tolist()
    assert two.normal(size=5).tolist() == first
    one.reseed()
    assert one.normal(size=5).tolist() == first
    assert Rng(8, "/left/arm").normal(size=5).tolist() != first
    assert Rng(7, "/left/leg").normal(size=5).tolist() != first


def test_numpys_generators_are_imported_where_used():
    code = "import sys, busflow.runner.graph; print('numpy.random' in sys.modules)"
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "False\n"
