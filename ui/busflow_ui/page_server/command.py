"""`busflow ui`: shows a running graph, a recording or a foxglove_bridge in a browser."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from busflow.commands import complete_runs, joined, print_message
from busflow.text import counted

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from ssl import SSLContext

    from busflow_ui.book.book import Book
    from busflow_ui.book.site import BookSite
    from busflow_ui.page_server.server import Source

_EXAMPLES = """\b
Examples:
  busflow ui --open
  busflow ui lab.mcap
  busflow ui --run lab1 --read-only
  busflow ui --book docs/tutorial
  busflow ui --book docs/tutorial --export site
  busflow ui --bridge ws://robot:8765
  busflow ui --host 0.0.0.0 --certificate robot.crt --key robot.key"""
_EXISTING = click.Path(exists=True, dir_okay=False, path_type=Path)


@dataclass(frozen=True, slots=True)
class _Place:
    """Where and for whom the page is served."""

    host: str
    port: int
    origins: tuple[str, ...]
    read_only: bool
    opens: bool
    book: Book | None
    certificate: SSLContext | None


@click.command(epilog=_EXAMPLES)
@click.argument("file", required=False, type=click.Path(exists=True, path_type=Path))
@click.option("--run", metavar="NAME", shell_complete=complete_runs, help="The run to show, where there are several.")
@click.option("--bridge", metavar="URL", help="Show what a foxglove_bridge serves, such as ws://robot:8765.")
@click.option(
    "--book",
    "places",
    metavar="DIR|FILE",
    multiple=True,
    type=click.Path(exists=True, path_type=Path),
    help="Show Markdown as a textbook, live beside the run; give it again for more files.",
)
@click.option(
    "--export", metavar="DIR", type=click.Path(path_type=Path), help="Write the book as a static site instead, and end."
)
@click.option("--host", default="127.0.0.1", show_default=True, help="The address to listen at.")
@click.option(
    "--port", type=click.IntRange(0, 65535), default=8766, show_default=True, help="The port; 0 is a free one."
)
@click.option("--open", "opens", is_flag=True, help="Open the page in the browser.")
@click.option("--read-only", is_flag=True, help="The page may look, and change nothing.")
@click.option("--control", is_flag=True, help="The page may steer from other machines too, which else only look.")
@click.option("--certificate", type=_EXISTING, help="The certificate for other machines, a PEM file.")
@click.option("--key", type=_EXISTING, help="Its key, a PEM file.")
@click.option(
    "--allow-origin",
    "origins",
    metavar="ORIGIN",
    multiple=True,
    help="Let pages of this site embed panels that look, and the assistant, such as http://robot.lab:8080.",
)
def ui(
    file: Path | None,
    run: str | None,
    bridge: str | None,
    places: tuple[Path, ...],
    export: Path | None,
    host: str,
    port: int,
    opens: bool,
    read_only: bool,
    control: bool,
    certificate: Path | None,
    key: Path | None,
    origins: tuple[str, ...],
) -> int:
    """Show a running graph in a browser until Ctrl-C; with FILE a recording, with --bridge another program's topics.

    With --book also a textbook, which waits for a run where there is none. One address is printed. It holds a token,
    new for each start, which lets its browser in.
    """
    from busflow_ui.foxglove.admission import is_local

    if sum(each is not None for each in (file, run, bridge)) > 1:
        raise click.UsageError("give one of FILE, --run and --bridge: they name what is shown")
    if export is not None and not places:
        raise click.UsageError("--export needs --book, which names what is written")
    if export is not None:
        return _export(places, export)
    if read_only and control:
        raise click.UsageError("--read-only and --control contradict each other")
    if (certificate is None) != (key is None):
        raise click.UsageError("--certificate and --key need each other")
    if not is_local(host) and certificate is None:
        why = f"{host} is reached from other machines, and the token would cross the network unencrypted"
        fix = "give --certificate and --key, or use ssh: ssh -L 8766:localhost:8766 robot"
        raise click.UsageError(f"{why}; {fix}")
    read_only = read_only or not (is_local(host) or control)
    place = _Place(host, port, origins, read_only, opens, _book(places), _tls(certificate, key))
    if file is not None:
        _show_recording(file, place)
    elif bridge is not None:
        _show_bridge(bridge, place)
    else:
        _show_run(run, place)
    return 0


def _tls(certificate: Path | None, key: Path | None) -> SSLContext | None:
    if certificate is None or key is None:
        return None
    from busflow_ui.page_server.certificate import tls

    return tls(certificate, key)


def _book(places: tuple[Path, ...]) -> Book | None:
    """Read a book, and print what is wrong in it."""
    if not places:
        return None
    from busflow_ui.book.book import Book

    book = Book(places)
    for fault in book.faults():
        print_message(f"warning: {fault}")
    return book


def _export(places: tuple[Path, ...], target: Path) -> int:
    from busflow_ui.book.export import export
    from busflow_ui.page_server.files import page_folder

    book = _book(places)
    if book is not None:
        pages = export(book, page_folder(), target)
        click.echo(f"{counted(pages, 'chapter')} in {target}: open {target / 'index.html'}")
    return 0


def _show_recording(file: Path, place: _Place) -> None:
    import asyncio

    from busflow_ui.page_server.recording_source import RecordingSource
    from busflow_ui.recordings.recording import opened

    recording = opened(file)
    with ExitStack() as closing:
        closing.callback(recording.close)
        source = RecordingSource(recording, print_message=print_message)
        asyncio.run(_serve(str(file), source, asyncio.Event().wait, place))


def _show_bridge(url: str, place: _Place) -> None:
    import asyncio

    from busflow_ui.page_server.bridge_source import BridgeSource

    async def main() -> None:
        source = BridgeSource(url, print_message=print_message)
        await source.check()
        await _serve(url, source, asyncio.Event().wait, place)

    asyncio.run(main())


def _show_run(run: str | None, place: _Place) -> None:
    import asyncio

    from busflow_ui.page_server.run_source import RunSource

    name = run
    if run is not None or place.book is None:
        with joined(run) as peer:
            name = run or peer.run.name

    async def main() -> None:
        source = RunSource(name, print_message=print_message, chapters=place.book)
        await _serve(name or "the next run", source, source.keep, place)

    asyncio.run(main())


def _site(book: Book | None) -> BookSite | None:
    if book is None:
        return None
    from busflow_ui.book.site import BookSite

    return BookSite(book)


async def _serve(what: str, source: Source, keep: Callable[[], Awaitable[object]], place: _Place) -> None:
    """Serve the page until `keep` returns."""
    from busflow_ui.page_server.access import PageAdmission, Tokens
    from busflow_ui.page_server.files import BOOK, PageFiles, page_folder
    from busflow_ui.page_server.server import PageServer

    tokens = Tokens(read_only=place.read_only)
    server = PageServer(
        source,
        admission=PageAdmission(place.host, place.origins),
        tokens=tokens,
        files=PageFiles(page_folder(), place.origins, _site(place.book)),
        print_message=print_message,
        certificate=place.certificate,
    )
    try:
        port = await server.open(place.host, place.port)
        host = f"[{place.host}]" if ":" in place.host else place.host
        path = "/" if place.book is None else f"{BOOK}/"
        url = f"http{'s' if place.certificate else ''}://{host}:{port}{path}#token={tokens.own}"
        click.echo(f"{what if place.book is None else place.book.title} is shown at {url}")
        if place.origins:
            sites = ", ".join(place.origins)
            click.echo(f"  pages of {sites} look with the token {tokens.foreign}")
            click.echo(f"  pages of {sites} ask the assistant, and no more, with the token {tokens.ask}")
        if place.opens:
            click.launch(url)
        await keep()
    finally:
        await server.close()
