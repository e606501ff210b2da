"""The fixtures of busflow's own tests, e.g. a place where runs are found, and limits that a busy machine keeps."""

from collections.abc import Iterator

import pytest

from busflow_ui import timeouts

pytest_plugins = ("tests.conftest", "tests.cli.conftest", "tests.whole_files")


@pytest.fixture(scope="session", autouse=True)
def unhurried_viewers() -> Iterator[None]:
    """Set limits that a busy machine would exceed, here and in all processes that the tests start."""
    limits = "hello=inf,call=inf,goal=inf,assistant=inf,connection=inf"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(timeouts.VARIABLE, limits)
        patch.setattr(timeouts, "current", timeouts.stated(limits, timeouts.Timeouts()))
        patch.setenv("BUSFLOW_ASSISTANT_TIMEOUTS", "reading=inf")
        yield
