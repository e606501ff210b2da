import pytest

from busflow.errors import InspectionUnavailable
from busflow.wire.zenoh.session import open_session


def test_run_that_ends_during_join_is_gone(tmp_path):
    with pytest.raises(InspectionUnavailable, match="is gone: No such file or directory"):
        open_session(tmp_path / "ended")


def test_run_without_a_socket_is_not_ready(tmp_path):
    with pytest.raises(InspectionUnavailable, match="has no socket yet"):
        open_session(tmp_path)
