"""`block.py`: a value as YAML, whose comments say where each scalar comes from."""

from busflow.launchfile.yaml.block import lines, origins, text_of
from busflow.launchfile.yaml.document import parse

TEXT = "nodes:\n  imu:\n    rate: 5.0\n    axes: [1, {deep: yes}]\n    nothing: {}\n    off: []\n"


def test_text_reads_back_as_the_value():
    value = parse(TEXT.encode(), "lab1.yaml")
    assert parse(text_of(value).encode(), "again.yaml").data == value.data


def test_comments_name_origins_and_are_aligned():
    found = list(lines(parse(TEXT.encode(), "lab1.yaml")))
    assert found[2] == "    rate: 5.0        # from lab1.yaml:3:11"
    assert len({line.index("#") for line in found if "#" in line}) == 1


def test_origins_are_found_by_dotted_path():
    assert origins(parse(TEXT.encode(), "lab1.yaml"))["nodes.imu.rate"] == "lab1.yaml:3:11"
