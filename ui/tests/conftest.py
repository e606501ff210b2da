"""The fixtures of busflow's own tests: a place where runs are found, and labs that run there."""

from typing import Any

import pytest

pytest_plugins = ("tests.conftest", "tests.cli.conftest")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Give each file to one worker: its tests share a run and a server, and a second pair costs more than it saves."""
    from xdist.scheduler import LoadFileScheduling

    config.option.loadscopereorder = False  # those in a browser come early, and take longest
    return LoadFileScheduling(config, log)
