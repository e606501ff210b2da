"""The node that reads the pages and follows their files."""

from __future__ import annotations

from pydantic import Field

from busflow import TRANSIENT_LOCAL, Node, Parameters, ReadOnly, publisher, timer
from busflow_assistant.conversions import page_to_message
from busflow_assistant.messages import Index
from busflow_assistant.page_files import ReadingLimits, Signature, read_pages, signature


class PageIndexParameters(Parameters):
    """Which pages there are, and how much of them is read."""

    pages: ReadOnly[list[str]] = Field(
        min_length=1, description="Markdown files, and folders of them; from the working directory."
    )
    look_hz: float = Field(default=1.0, ge=0, le=100, description="How often to look for changed files; 0 is never.")
    most_pages: ReadOnly[int] = Field(default=500, ge=1, le=10_000, description="Pages beyond these are left out.")
    most_page_bytes: ReadOnly[int] = Field(default=1_000_000, ge=1, description="A larger file is left out.")
    most_bytes: ReadOnly[int] = Field(default=16_000_000, ge=1, description="Pages beyond this sum are left out.")


class PageIndex(Node):
    """Reads pages of Markdown, and publishes their passages and sentences, again when a file changes."""

    parameters: PageIndexParameters

    index = publisher(Index, "assistant/index", qos=TRANSIENT_LOCAL)

    async def start(self) -> None:
        """Read the pages."""
        self.read: Signature | None = None
        self.left_out: tuple[str, ...] = ()
        await self.follow()

    @timer(hz="look_hz")
    async def look(self) -> None:
        """Look for changes."""
        await self.follow()

    async def follow(self) -> None:
        """Read the pages again if a file is new, changed or gone."""
        places = self.parameters.pages
        now = await self.run_sync(signature, places)
        if now != self.read:
            self.read = now
            await self.read_again(places)

    async def read_again(self, places: list[str]) -> None:
        """Read and publish the pages, and log what is left out."""
        given = self.parameters
        limits = ReadingLimits(given.most_pages, given.most_page_bytes, given.most_bytes)
        found = await self.run_sync(read_pages, places, limits)
        for each in found.left_out:
            if each not in self.left_out:
                self.log.warning("a page is left out", page=each)
        if not found.pages:
            self.log.warning("there is no page to answer from", looked_in=", ".join(places))
        self.left_out = found.left_out
        messages = [page_to_message(page) for page in found.pages]
        self.index.publish(Index(stamp=self.clock.now().to_msg(), pages=messages, left_out=found.left_out))
