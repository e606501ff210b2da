"""`busflow ui` in a process of its own, and a page that speaks with it as the one in the browser does."""

import asyncio
import json
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

import pytest
from websockets.asyncio.client import connect as connect_on_a_loop
from websockets.sync.client import connect

from busflow.errors import InvalidInput
from busflow_ui.page_server.files import page_folder

PATIENCE_S = 60.0
PAGE = Path(__file__).parents[2] / "page"


class EncryptedSocket:
    """A connection whose one thread sends and receives: two on one TLS connection is more than Python 3.11 can."""

    def __init__(self, address: str, **options: Any) -> None:
        async def opened() -> Any:
            return await connect_on_a_loop(address, **options)

        self._runner = asyncio.Runner()
        self._connection = self._runner.run(opened())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._runner.run(self._connection.close())
        self._runner.close()

    def send(self, message: str) -> None:
        self._runner.run(self._connection.send(message))

    def recv(self, timeout: float) -> str | bytes:
        return self._runner.run(asyncio.wait_for(self._connection.recv(), timeout))


class Page:
    """A browser's page, which has sent its token."""

    def __init__(self, url: str, stack: ExitStack, *, token: str, **options: Any) -> None:
        options = {"subprotocols": ["foxglove.sdk.v1"], "max_size": None, "close_timeout": 0.5, **options}
        address = f"{url.removesuffix('/book').replace('http', 'ws', 1)}/ws"
        kind = EncryptedSocket if "ssl" in options else connect
        self.socket = stack.enter_context(kind(address, compression=None, **options))
        self.send("busflow/hello", token=token)
        self.channels: dict[str, int] = {}
        self.info: dict[str, Any] = {}
        self._asked = 0

    def send(self, op: str, **fields: Any) -> None:
        self.socket.send(json.dumps({"op": op, **fields}))

    def receive(self) -> dict[str, Any]:
        """The next frame; a binary one as its parts."""
        message = self.socket.recv(timeout=PATIENCE_S)
        if isinstance(message, bytes):
            if message[0] == 2:
                return {"op": "time", "now_ns": struct.unpack_from("<BQ", message)[1]}
            _, subscription, stamp_ns = struct.unpack_from("<BIQ", message)
            return {"op": "data", "subscription": subscription, "stamp_ns": stamp_ns, "payload": message[13:]}
        found: dict[str, Any] = json.loads(message)
        if found["op"] == "advertise":
            self.channels |= {each["topic"]: each["id"] for each in found["channels"]}
        if found["op"] == "serverInfo":
            self.info = found
        return found

    def until(self, holds: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """Receive until a frame is so, for as long as patience lasts: others may come for ever."""
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            found = self.receive()
            if holds(found):
                return found
        raise AssertionError(f"it did not come within {PATIENCE_S:g} s")

    def ask(self, question: str, /, **arguments: Any) -> dict[str, Any]:
        """Ask, and return the whole answer."""
        self._asked += 1
        self.send("busflow/ask", id=self._asked, question=question, arguments=arguments)
        return self.until(lambda found: found["op"] == "busflow/answer" and found["id"] == self._asked)

    def answer(self, question: str, /, **arguments: Any) -> Any:
        """Ask, and return what the answer holds."""
        found = self.ask(question, **arguments)
        assert "answer" in found, found
        return found["answer"]

    def follow(self, question: str) -> None:
        self.send("busflow/follow", question=question, on=True)

    def update(self, question: str, holds: Callable[[Any], Any] = lambda _: True) -> Any:
        """Wait for an update that is so."""
        return self.until(
            lambda found: found["op"] == "busflow/update" and found["question"] == question and holds(found["answer"])
        )["answer"]

    def subscribe(self, topic: str, id_: int = 1) -> None:
        if topic not in self.channels:
            self.until(lambda _: topic in self.channels)
        self.send("subscribe", subscriptions=[{"id": id_, "channelId": self.channels[topic]}])

    def message(self, id_: int = 1) -> dict[str, Any]:
        return self.until(lambda found: found["op"] == "data" and found["subscription"] == id_)


class Shown:
    """`busflow ui`, while it serves."""

    def __init__(self, *arguments: str, environment: dict[str, str], folder: Path | None = None) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "busflow", "ui", "--port", "0", *arguments],
            env={**environment, "PYTHONUNBUFFERED": "1"},
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout
        self.greeting = self.process.stdout.readline()
        found = re.search(r"(https?://\S+?)/#token=(\S+)", self.greeting)  # of a book, with its folder
        if found is None:
            raise AssertionError(self.process.communicate())
        self.url, self.token = found[1], found[2]
        self.pages = ExitStack()

    def page(self, **options: Any) -> Page:
        return Page(self.url, self.pages, **{"token": self.token, **options})

    def end(self) -> tuple[int, str, str]:
        """Press Ctrl-C; return the exit code and what was printed since."""
        self.pages.close()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            printed, warned = self.process.communicate(timeout=PATIENCE_S)
        finally:
            self.process.kill()
        return self.process.returncode, printed, warned


@pytest.fixture(scope="session")
def built_page() -> Path:
    """The folder of the built page; it is built where it is not there."""
    try:
        return page_folder()
    except InvalidInput:
        npm = shutil.which("npm")
        if npm is None:
            pytest.skip("the page is not built, and there is no npm to build it")
    for command in ([npm, "ci", "--ignore-scripts", "--no-audit", "--no-fund"], ["node", "build.mjs"]):
        subprocess.run(command, cwd=PAGE, check=True, capture_output=True)
    return page_folder()


@pytest.fixture(scope="module")
def show(built_page: Path) -> Iterator[Callable[..., Shown]]:
    """A function that starts `busflow ui`, which ends with the module."""
    assert built_page.is_dir()
    with ExitStack() as stack:

        def start(*arguments: str, **options: Any) -> Shown:
            shown = Shown(*arguments, **options)
            stack.callback(shown.end)
            return shown

        yield start


@pytest.fixture(scope="module")
def lab_folder() -> Iterator[Path]:
    """A copy of the project's lab, whose launch file may be written to."""
    root = Path(__file__).parents[3]
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as path:
        folder = Path(path)
        text = (root / "configs/lab1.yaml").read_text("utf-8")
        (folder / "lab1.yaml").write_text(text.replace("../plugins", str(root / "plugins")), "utf-8")
        yield folder
