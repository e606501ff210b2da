"""Extras of busflow that tests need, e.g. `dds`: where one is missing, its tests are skipped and name it.

Also a mark for tests that a platform's encoding fails.
"""

import os
import sys
from importlib.metadata import requires
from importlib.util import find_spec

import pytest
from packaging.requirements import Requirement

FAILS_IN_ASCII = pytest.mark.xfail(
    sys.getfilesystemencoding() == "ascii", reason="ascii output: a name that cannot be encoded ends in a traceback"
)
"""A known fault in the locale C, e.g. with LC_ALL=C PYTHONUTF8=0 PYTHONCOERCECLOCALE=0."""
PACKAGES = {"dds": "cyclonedds", "sim": "mujoco", "uvloop": "uvloop"}
"""Extras that not every platform has, each with the package that it brings, whose module has the same name."""


def in_test(package: str) -> bool:
    """Whether the extra `test` brings a package on this Python and platform."""
    found = [Requirement(each) for each in requires("busflow") or ()]
    return any(each.name == package and each.marker and each.marker.evaluate({"extra": "test"}) for each in found)


def require_extra(extra: str) -> None:
    """Skip the test, or in a module the whole of it, without the extra; in CI fail where `test` brings the extra."""
    package = PACKAGES[extra]
    if find_spec(package) is None:
        assert not (os.environ.get("CI") and in_test(package)), f"{package} is missing, and the extra `test` brings it"
        pytest.skip(f"needs the extra {extra}: pip install '.[{extra}]'", allow_module_level=True)
