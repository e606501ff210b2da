"""`owner_of`: which process listens at a port."""

import os
import socket

from busflow.ros2.port_owner import owner_of
from tests.ros2.sessions import free_port


def test_the_listening_process_is_named():
    with socket.create_server(("127.0.0.1", 0)) as server:
        assert owner_of(server.getsockname()[1]).startswith(f"the process {os.getpid()} (")


def test_a_port_without_a_listener_has_no_owner():
    assert owner_of(free_port()) == ""
