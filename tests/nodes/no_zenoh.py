"""The script `run_nodes.py` on a machine for which there is no Zenoh."""

import runpy
import sys
from importlib.abc import MetaPathFinder
from pathlib import Path


class Missing(MetaPathFinder):
    """Refuses Zenoh."""

    def find_spec(self, name, path=None, target=None):  # noqa: ARG002  # as it is called
        if name.partition(".")[0] == "zenoh":
            raise ImportError("no wheel of zenoh for this platform")


sys.meta_path.insert(0, Missing())
runpy.run_path(str(Path(__file__).with_name("run_nodes.py")), run_name="__main__")
