"""The tests of `idl` and `known_types`: every type that busflow brings, as DDS describes it."""

import pytest

from busflow.dds.idl import Carriers
from busflow.dds.known_types import KnownTypes
from busflow.errors import UnknownType
from busflow.interfaces.encoding.builtin_types import builtin_types
from busflow.interfaces.encoding.description import rihs01
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.rcl_interfaces import ListParameters, SetParameters
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.msgs.std_srvs import Trigger


def described(name):
    description = builtin_types().description(name)
    return ForeignType(name, rihs01(description), description)


@pytest.mark.parametrize("cls", [Imu, JointState])
def test_independent_codec_reads_what_busflow_encodes(cls):
    """Cyclone's own code, made of our type, reads our bytes: each field is where DDS expects it."""
    support = TypeSupport(cls)
    carrier = Carriers().of(described(support.name))
    read = carrier.__idl__.deserialize(support.encode(cls()))
    assert carrier.__idl__.serialize(read)[4:] == support.encode(cls())[4:]


def test_sample_carries_bytes_untouched():
    carrier = Carriers().of(described("std_msgs/msg/String"))
    sample = carrier.of(b"any bytes")
    assert sample.serialize(use_version_2=False) == b"any bytes"
    assert carrier.deserialize(b"others").payload == b"others"


def test_half_of_a_service_begins_with_its_header():
    carrier = Carriers().of(described("std_srvs/srv/SetBool_Request"), is_half_of_service=True)
    assert list(carrier.__annotations__) == ["guid", "seq", "data"]
    assert carrier.__idl_typename__ == "std_srvs::srv::dds_::SetBool_Request_"


def test_type_that_cyclonedds_lacks_is_refused():
    with pytest.raises(UnknownType, match="wstring"):
        Carriers().of(described("example_interfaces/msg/WString"))


@pytest.mark.parametrize("cls", [Trigger, ListParameters, SetParameters])
def test_hash_of_an_installed_service_is_ros2s(cls):
    support = TypeSupport(cls)
    found = KnownTypes(None, None).installed_service("/x", support.name)
    assert (found.type, found.hash) == (support.name, support.type_hash)


def test_service_that_is_not_installed_is_unknown():
    assert KnownTypes(None, None).installed_service("/x", "my_msgs/srv/Missing") is None


@pytest.mark.long
def test_every_type_can_be_described():
    carriers = Carriers()
    halves = [f"{name}_{half}" for name in builtin_types().services for half in ("Request", "Response")]
    refused = []
    for name in [*builtin_types().messages, *halves]:
        try:
            carriers.of(described(name)).__idl__.fill_type_data()
        except UnknownType:
            refused.append(name)
    assert refused == ["example_interfaces/msg/WString"]
