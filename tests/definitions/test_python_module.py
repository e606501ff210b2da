"""A generated module is source that Python and pyright take, and its classes are the types of the files.

Tests of `python_module.py` and `generator.py` over whole packages.
"""

import importlib
import sys
from pathlib import Path
from typing import Any

import pytest

from busflow.definitions.export import exported
from busflow.definitions.generator import generate
from busflow.definitions.library import Library
from busflow.errors import InvalidDefinition, UnknownType
from busflow.interfaces.encoding.description import rihs01
from busflow.interfaces.encoding.typesupport import TypeSupport
from tests.definitions.any_package import Made
from tests.definitions.test_library import write

FILES = {
    "grip_msgs/package.xml": "<name>grip_msgs</name><version>1.2.0</version><license>Apache-2.0</license>",
    "grip_msgs/msg/Finger.msg": "# One finger.\n\nstring<=8 name\n# In newtons,\n# never below 0.\nfloat32 force 0.5\n",
    "grip_msgs/msg/Grip.msg": """\
# How it holds.

uint8 OPEN=0  # nothing held
string NAME="a \\"b\\""
bool[2] pair [true, false]
int8[] numbers [1, -2]
float64[<=3] gains
string[<=2] words ["a", 'b']
string[3] three
string<=4[] short
wstring wide "é"
char letter 65
byte[] raw
Finger finger
Finger[2] two
Finger[] fingers
geometry_msgs/Point[<=4] contacts
Length length
Point point
geometry_msgs/Point other
float64 zeros
""",
    "grip_msgs/msg/Length.msg": "float64 value\n",
    "grip_msgs/msg/Point.msg": "int8 x\n",
    "grip_msgs/srv/Close.srv": "# Closes.\n\nfloat32 force 1e-3\n---\n# What came.\n\nbool done true\nGrip grip\n",
    "user_msgs/msg/Hand.msg": "grip_msgs/Finger[5] fingers\n# A path: C:\\new\nint64 x -9223372036854775808\n",
}


@pytest.fixture(scope="module")
def sources(tmp_path_factory) -> Path:
    return write(tmp_path_factory.mktemp("src"), FILES)


@pytest.fixture(scope="module")
def module(sources, tmp_path_factory):
    """The two packages as modules of a package `made_robot`, imported."""
    folder = tmp_path_factory.mktemp("made") / "made_robot"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    for made in generate(Library([sources]), ["grip_msgs", "user_msgs"], folder):
        made.path.write_text(made.text)
    sys.path.insert(0, str(folder.parent))
    yield {name: importlib.import_module(f"made_robot.{name}") for name in ("grip_msgs", "user_msgs")}
    sys.path.remove(str(folder.parent))


def test_classes_have_the_types_of_the_files(sources, module):
    library = Library([sources])
    for name in library.names:
        package, _, word = name.split("/")
        support = TypeSupport(getattr(module[package], word))
        assert (support.name, support.type_hash) == (name, rihs01(library.description(name)))
        assert f"RIHS01_{support.type_hash[7:]}" in Path(module[package].__file__).read_text()


def test_defaults_and_constants_are_those_of_the_files(module):
    grip_msgs = module["grip_msgs"]
    grip = grip_msgs.Grip()
    assert (grip_msgs.Grip.OPEN, grip_msgs.Grip.NAME) == (0, 'a "b"')
    assert (grip.pair.tolist(), grip.numbers.tolist(), grip.gains.tolist()) == ([True, False], [1, -2], [])
    assert (grip.words, grip.three, grip.short, grip.wide, grip.letter) == (("a", "b"), ("", "", ""), (), "é", 65)
    assert grip.two == (grip_msgs.Finger(), grip_msgs.Finger(force=0.5))
    assert (grip_msgs.Close.Request().force, grip_msgs.Close.Response().done) == (pytest.approx(1e-3), True)
    assert module["user_msgs"].Hand().x == -(1 << 63)
    assert "\\new" in Path(module["user_msgs"].__file__).read_text()


def test_comments_are_docstrings(module, golden):
    assert module["grip_msgs"].Finger.__doc__ == "One finger."
    assert module["grip_msgs"].Close.Response.__doc__ == "What came."
    golden(Path(module["grip_msgs"].__file__).read_text())


def test_types_of_one_name_stand_apart(tmp_path):
    """As in control_msgs, which has a message and an action GripperCommand."""
    library = Library([write(tmp_path, {"q/msg/B.msg": "int8 a\n", "q/srv/B.srv": "B asked\n---\nB[] given\n"})])
    (made,) = generate(library, ["q"], tmp_path)
    namespace: dict[str, Any] = {"__name__": "q"}
    exec(made.text, namespace)  # noqa: S102  # the module just made
    service = TypeSupport(namespace["srv"].B)
    assert (service.name, service.type_hash) == ("q/srv/B", rihs01(library.description("q/srv/B")))
    assert namespace["srv"].B.Request().asked == namespace["B"]()


def test_what_no_module_can_hold_is_refused(sources, tmp_path, golden):
    library = Library([sources])
    with golden.raises(InvalidDefinition, mask={r"--to .*": "--to FOLDER"}):
        generate(library, ["user_msgs"], tmp_path)
    with golden.raises(UnknownType):
        generate(library, ["grip_msg"], tmp_path)
    library = Library([write(tmp_path, {"r/msg/C.idl": ""})])
    with golden.raises(UnknownType):
        generate(library, ["r"], tmp_path)


HIDING = {
    "words of Python": "string str\nstring text\nbool bool\nbool flag\nstring[2] texts",
    "numbers without an end": "float32 float\nfloat64 inf\nfloat32 x nan\nfloat64[] y [inf, -inf]",
    "a constant of a type": "uint8 IMU=1\nIMU imu\nIMU[2] two",
    "a type of typing": "ClassVar[1] held\nuint8 A=1\nint8[<=2] few",
    "modules": "p_msgs/B other\nint8 p_msgs\np_msgs/IMU imu",
    "words of another package": "p_msgs/Length length\nstring<=2 text",
}


@pytest.mark.parametrize("text", HIDING.values(), ids=HIDING)
def test_names_that_a_module_uses_may_be_those_of_the_package(tmp_path, text):
    files = {"q_msgs/msg/A.msg": f"{text}\n", "q_msgs/msg/IMU.msg": "int8 x\n", "q_msgs/msg/ClassVar.msg": "int8 x\n"}
    files |= {f"p_msgs/msg/{word}.msg": "int8 y\n" for word in ("B", "IMU", "Length")}
    made = Made(write(tmp_path / "src", files), tmp_path)
    support = TypeSupport(made.classes["q_msgs/msg/A"])
    assert support.type_hash == rihs01(made.library.description("q_msgs/msg/A"))
    assert repr(support.decode(support.encode(support.cls()))) == repr(support.cls())


def test_minus_zero_is_a_default_of_its_own(tmp_path):
    made = Made(write(tmp_path / "src", {"p_msgs/msg/A.msg": "float64 x -0.0\nfloat32[1] y [-0.0]\n"}), tmp_path)
    assert exported("p_msgs", [*made.classes.values()], "MIT")["msg/A.msg"] == "float64 x -0\nfloat32[1] y [-0]\n"


def test_words_of_python_name_no_class(tmp_path):
    files = {"p_msgs/msg/None.msg": "int8 x\n", "p_msgs/msg/A.msg": "None x\n", "p_msgs/msg/B.msg": "int8 x\n"}
    (made,) = generate(Library([write(tmp_path / "src", files)]), ["p_msgs"], tmp_path)
    assert [each.message for each in made.left_out] == [
        f"p_msgs/msg/{word} can be no class: None, of p_msgs/msg/None, is a word of Python" for word in ("A", "None")
    ]
    with pytest.raises(InvalidDefinition):
        generate(Library([write(tmp_path / "more", {"lambda/msg/A.msg": "int8 x\n"})]), ["lambda"], tmp_path)


def test_types_that_fit_no_class_are_left_out(tmp_path, golden):
    files = {
        "p/msg/A.msg": "int8 json\n",
        "p/msg/B.msg": "A[] held\n",
        "p/msg/C.msg": "int8 cls\nbool[2] flags\nuint64[2] most [0, 18446744073709551615]\n",
        "p/srv/D.srv": "---\nint8 class\n",
    }
    (made,) = generate(Library([write(tmp_path, files)]), ["p"], tmp_path)
    golden("\n".join(each.render() for each in made.left_out))
    namespace: dict[str, Any] = {"__name__": "p"}
    exec(made.text, namespace)  # noqa: S102  # the module just made
    made_c = namespace["C"](cls=1)
    assert (made_c.flags.tolist(), made_c.most.tolist(), made.count) == ([False, False], [0, 2**64 - 1], 1)
    (tmp_path / "p/msg/C.msg").unlink()
    with pytest.raises(InvalidDefinition) as caught:
        generate(Library([tmp_path]), ["p"], tmp_path)
    assert [each.place for each in caught.value.problems] == [each.place for each in made.left_out]
