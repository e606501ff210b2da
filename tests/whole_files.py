"""A pytest plugin that gives each file to one worker, for tests that share what takes long to make.

`ui` and `assistant` use it: a second run with its server, or a second round of answers, costs more than it saves.
"""

from typing import Any

import pytest


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Keep files whole, in their order: those in a browser come early, and take longest."""
    from xdist.scheduler import LoadFileScheduling

    config.option.loadscopereorder = False
    return LoadFileScheduling(config, log)
