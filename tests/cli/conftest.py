"""A small launch file with two nodes, in a folder of its own that is the current directory."""

from pathlib import Path

import pytest

TALKER = '''
from busflow import Node, Parameters, publisher, timer
from busflow.msgs.std_msgs import Float64


class TalkerParameters(Parameters):
    rate_hz: float = 100.0
    fail_at: int = 0


class Talker(Node):
    """Counts aloud."""

    parameters: TalkerParameters
    numbers = publisher(Float64, "numbers")
    count = 0

    @timer(hz="rate_hz")
    def talk(self) -> None:
        self.count += 1
        if self.count == self.parameters.fail_at:
            raise ValueError("\\x1b[31mlost count")
        self.numbers.publish(Float64(data=float(self.count)))
'''

LISTENER = '''
from busflow import Node, subscription
from busflow.msgs.std_msgs import Float64


class Listener(Node):
    """Says what it hears."""

    @subscription("numbers")
    def hear(self, number: Float64) -> None:
        self.log.info("heard", number=number.data)
'''

LAUNCH = """\
name: talk
plugins: [plugins]
args:
  rate_hz: {type: float, default: 100.0, max: 1000, help: How often to talk.}
nodes:
  talker:
    plugin: talker
    parameters: {rate_hz: "${args.rate_hz}"}
  listener:
    plugin: listener
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "plugins").mkdir()
    (tmp_path / "plugins/talker.py").write_text(TALKER)
    (tmp_path / "plugins/listener.py").write_text(LISTENER)
    (tmp_path / "talk.yaml").write_text(LAUNCH)
    monkeypatch.chdir(tmp_path)
    return tmp_path
