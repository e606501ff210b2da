"""Types are found in folders of definition files, and each is described with all within it.

Tests of `library.py` and `packages.py`.
"""

from pathlib import Path

import pytest

from busflow.definitions.library import Library
from busflow.definitions.packages import by_name, packages_in
from busflow.errors import InvalidDefinition, UnknownType
from busflow.interfaces.encoding.description import rihs01, types_in
from busflow.interfaces.encoding.typesupport import describe
from busflow.msgs.sensor_msgs import Imu
from busflow.msgs.std_srvs import SetBool


def write(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def refusal(library: Library, name: str) -> str:
    with pytest.raises((InvalidDefinition, UnknownType)) as refused:
        library.description(name)
    return str(refused.value)


def test_packages_are_named_by_package_xml_or_folder(tmp_path):
    xml = "<package><!-- <name>no</name> --><name>real_name</name>"
    xml += "<license>MIT</license><license>BSD</license></package>"
    write(
        tmp_path,
        {
            "src/one/package.xml": xml,
            "src/one/msg/A.msg": "",
            "src/group/two/srv/B.srv": "---",
            "src/group/two/msg/readme.msg": "",
            "src/build/three/msg/C.msg": "",
            "src/.hidden/four/msg/D.msg": "",
            "src/five/COLCON_IGNORE": "",
            "src/five/msg/E.msg": "",
            "src/six/msg/F.idl": "",
        },
    )
    found = by_name([tmp_path / "src"])
    assert {name: sorted(each.files) for name, each in found.items()} == {
        "two": ["two/srv/B"],
        "real_name": ["real_name/msg/A"],
        "six": [],
    }
    assert list(found["real_name"].stated("license")) == ["MIT", "BSD"]
    assert [each.name for each in packages_in(tmp_path / "src/one")] == ["real_name"]
    assert packages_in(tmp_path / "nowhere") == []


def test_first_folder_with_a_package_is_meant(tmp_path):
    write(tmp_path, {"a/p/msg/One.msg": "", "b/p/msg/Two.msg": "", "c/std_msgs/msg/Own.msg": ""})
    assert Library([tmp_path / "b", tmp_path / "a"]).names == ["p/msg/Two"]
    assert Library([tmp_path / "b"], lambda: [tmp_path / "a", tmp_path / "c"]).names == ["p/msg/Two"]
    assert "std_msgs/msg/Own" in Library([tmp_path / "c"])


def test_description_equals_that_of_the_class(tmp_path):
    imu = "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
    imu += "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    imu += "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"
    set_bool = "bool data\n---\nbool success\nstring message\n"
    write(tmp_path, {"sensor_msgs/msg/Imu.msg": imu, "std_srvs/srv/SetBool.srv": set_bool})
    library = Library([tmp_path])
    assert library.description("sensor_msgs/msg/Imu") == describe(Imu)
    assert library.description("std_srvs/srv/SetBool") == describe(SetBool)
    assert library.description("std_srvs/srv/SetBool_Request") == describe(SetBool.Request)


def test_action_is_described_as_ros_describes_it(tmp_path):
    """The hash is that of ROS 2's own generator for example_interfaces."""
    write(
        tmp_path,
        {"example_interfaces/action/Fibonacci.action": "int32 order\n---\nint32[] sequence\n---\nint32[] sequence\n"},
    )
    library = Library([tmp_path])
    described = library.description("example_interfaces/action/Fibonacci")
    assert rihs01(described) == "RIHS01_9508051da1ea4658de144b09bd0690ff3de52104683d847aed764d2915906f51"
    assert "example_interfaces/action/Fibonacci_GetResult_Event" in types_in(described)
    feedback = library.description("example_interfaces/action/Fibonacci_FeedbackMessage")
    assert [field["name"] for field in feedback["type_description"]["fields"]] == ["goal_id", "feedback"]


def test_file_is_read_when_its_type_is_needed(tmp_path, golden):
    write(tmp_path, {"p/msg/Good.msg": "int8 a", "p/msg/Bad.msg": "nonsense"})
    library = Library([tmp_path])
    assert library.names == ["p/msg/Bad", "p/msg/Good"]
    assert library.description("p/msg/Good")["type_description"]["type_name"] == "p/msg/Good"
    golden(refusal(library, "p/msg/Bad"))


def test_unknown_types_within_are_named_at_their_place(tmp_path, golden):
    files = {
        "p/msg/A.msg": "int8 a\nsensor_msgs/Imuu imu",
        "p/msg/B.msg": "other_msgs/Thing thing",
        "p/msg/C.msg": "Header header",
        "p/msg/Loop.msg": "int8 a\nRing[] ring",
        "p/msg/Ring.msg": "Loop loop",
        "p/msg/Self.msg": "Self[] inner",
    }
    library = Library([write(tmp_path, files)])
    for name in ("A", "B", "C", "Loop", "Self"):
        golden(refusal(library, f"p/msg/{name}"), name)


def test_file_that_names_no_type_is_said(tmp_path, golden):
    write(tmp_path, {"p/msg/my_grip.msg": "int8 a", "q/msg/Arm.msg": "int8 a", "q/msg/2D.msg": "int8 a"})
    library = Library([tmp_path])
    assert refusal(library, "p/msg/MyGrip") == refusal(library, "p/msg/my_grip")
    golden(refusal(library, "p/msg/my_grip"))
    golden(library.unreadable("p"), "of the package")
    assert (library.unreadable("q"), library.unreadable("q/msg/Arm")) == ("", "")


def test_unknown_and_idl_types_are_refused_in_words(tmp_path, golden):
    write(tmp_path, {"p/msg/Grip.msg": "int8 a", "p/msg/Odd.idl": "module p {};"})
    library = Library([tmp_path])
    for name in ("p/msg/Gripp", "p/msg/Odd"):
        golden(refusal(library, name), name)
    assert "q/msg/Grip" in refusal(library, "q/msg/Grip")
    assert library.unreadable("p/Odd").startswith("p/Odd ")
    assert (library.unreadable("p"), library.unreadable("p/msg/Gripp"), library.unreadable("q")) == ("", "", "")
    (tmp_path / "p/msg/Grip.msg").unlink()
    assert "Grip.msg" in refusal(library, "p/msg/Grip")
