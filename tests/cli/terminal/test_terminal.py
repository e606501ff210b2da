"""Tests of `graph_drawing.py`, `message_text.py`, `output.py` and `plugin_sheet.py`."""

import json
from math import nan
from pathlib import Path

import pytest

from busflow.cli.terminal.abridged import Abridger
from busflow.cli.terminal.graph_drawing import Drawing
from busflow.cli.terminal.message_text import TextForm, Wanted
from busflow.cli.terminal.output import colour, json_text, line_of, print_found, print_message
from busflow.cli.terminal.plugin_sheet import sheet
from busflow.errors import InvalidInput, PluginError
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import String
from busflow.wire.client.graph_view import view
from busflow.wire.client.listener import Received
from busflow.wire.zenoh.keys import Token, TokenKind
from tests.golden import Golden

Captured = pytest.CaptureFixture[str]
TEXT = TypeSupport(String)


def text_of(form: TextForm, text: str, **choices: str) -> str | None:
    type_ = ForeignType(TEXT.name, TEXT.type_hash, TEXT.description)
    printer = Wanted(form, Abridger(), **choices).printer("/note", type_)
    return printer(Received(TEXT.encode(String(data=text)), 7, 1_000, b""))


class TestMessageText:
    def test_formats_show_the_same_message(self):
        assert text_of(TextForm.YAML, "hi") == "data: hi\n---"
        assert text_of(TextForm.CSV, "hi") == "hi"
        assert text_of(TextForm.YAML, "hi", field="data") == "hi\n---"
        assert (text_of(TextForm.RAW, "hi") or "").startswith("b'")
        assert json.loads(text_of(TextForm.JSON, "hi") or "") == {
            "version": 1,
            "topic": "/note",
            "sequence": 7,
            "published_ns": 1_000,
            "message": {"data": "hi"},
        }
        field = json.loads(text_of(TextForm.JSON, "hi", field="data") or "")
        assert (field["field"], field["value"]) == ("data", "hi")

    def test_filter_leaves_messages_out(self):
        assert text_of(TextForm.YAML, "hi", filter="data == 'no'") is None
        assert text_of(TextForm.RAW, "hi", filter="data == 'hi'") is not None

    def test_unknown_field_is_refused(self):
        with pytest.raises(InvalidInput):
            text_of(TextForm.YAML, "hi", field="text")


class TestOutput:
    def test_json_has_a_version_and_only_finite_numbers(self):
        assert json.loads(line_of({"rate": nan})) == {"version": 1, "rate": ".nan"}
        assert json.loads(json_text([nan, "\x1b"])) == [".nan", "\x1b"]

    def test_messages_are_escaped_and_go_to_stderr(self, capsys: Captured):
        print_message("error: \x1b[31mred\n")
        assert capsys.readouterr() == ("", "error: \\x1b[31mred\n")

    def test_result_is_names_or_json(self, capsys: Captured):
        print_found({"topics": ["/a"]}, ["/a"], as_json=False)
        print_found({"topics": ["/a"]}, ["/a"], as_json=True)
        first, _, rest = capsys.readouterr().out.partition("\n")
        assert (first, json.loads(rest)) == ("/a", {"version": 1, "topics": ["/a"]})

    def test_environment_decides_about_colour(self, monkeypatch: pytest.MonkeyPatch):
        for name in ("NO_COLOR", "FORCE_COLOR", "TERM"):
            monkeypatch.delenv(name, raising=False)
        assert colour() is None
        monkeypatch.setenv("FORCE_COLOR", "1")
        assert colour() is True
        monkeypatch.setenv("NO_COLOR", "1")
        assert colour() is False


def token(number: int, kind: TokenKind, node: str, topic: str = "") -> Token:
    return Token("aa", number, number, kind, "/", node, topic, "std_msgs/msg/Float64", "", "::,10:,:,:,,")


class TestGraphDrawing:
    tokens = (
        token(1, TokenKind.NODE, "talker"),
        token(2, TokenKind.NODE, "listener"),
        token(3, TokenKind.PUBLISHER, "talker", "/numbers"),
        token(4, TokenKind.SUBSCRIPTION, "listener", "/numbers"),
        token(5, TokenKind.SUBSCRIPTION, "listener", "/orders"),
    )

    def test_each_format_has_nodes_topics_and_arrows(self, golden: Golden):
        drawing = Drawing.of_view("talk", view(list(self.tokens), []), all_=False)
        golden("\n".join([*drawing.text(), *drawing.mermaid(), *drawing.dot(), json.dumps(drawing.data())]))


class TestPluginSheet:
    @pytest.mark.usefixtures("project")
    def test_sheet_has_parameters_and_endpoints(self, capsys: Captured):
        described = sheet("talker", [Path("plugins")])
        assert described.complete
        assert described.as_json()["publishes"] == [{"topic": "/numbers", "type": "std_msgs/msg/Float64"}]
        described.print()
        assert "rate_hz" in capsys.readouterr().out

    def test_unknown_plugin_is_an_error(self, tmp_path: Path):
        with pytest.raises(PluginError):
            sheet("nothing_of_this_name", [tmp_path])
