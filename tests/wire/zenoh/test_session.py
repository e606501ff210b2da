"""Sessions that cannot be opened."""

import errno
import os

import pytest

from busflow.errors import InspectionUnavailable
from busflow.wire.zenoh.session import open_session


def test_run_that_ends_during_join_is_gone(tmp_path):
    with pytest.raises(InspectionUnavailable, match=os.strerror(errno.ENOENT)):
        open_session(tmp_path / "ended")


def test_run_without_a_socket_is_not_ready(tmp_path):
    with pytest.raises(InspectionUnavailable):
        open_session(tmp_path)


def test_a_panic_of_zenoh_is_its_refusal(tmp_path, monkeypatch):
    class PanicException(BaseException):
        """Exception of pyo3, which has no name that could be imported."""

    def panic(_config):
        raise PanicException("Failed to init net")

    monkeypatch.setattr("zenoh.open", panic)
    with pytest.raises(InspectionUnavailable, match="ulimit -n"):
        open_session(tmp_path, listen="main.sock")


def test_too_few_open_files_name_the_limit(tmp_path, monkeypatch):
    monkeypatch.setattr("resource.getrlimit", lambda _kind: (32, 32))
    with pytest.raises(InspectionUnavailable, match=r" 32 .*ulimit -n\D*\d+ "):
        open_session(tmp_path, listen="main.sock")


def test_an_interrupt_while_zenoh_opens_is_passed_on(tmp_path, monkeypatch):
    def interrupt(_config):
        raise KeyboardInterrupt

    monkeypatch.setattr("zenoh.open", interrupt)
    with pytest.raises(KeyboardInterrupt):
        open_session(tmp_path, listen="main.sock")
