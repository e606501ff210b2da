"""`busflow ui`: shows a running graph in a browser."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from busflow.cli.commands import complete_runs, joined, tell

if TYPE_CHECKING:
    pass

_EXAMPLES = """\b
Examples:
  busflow ui --open
  busflow ui --run lab1 --read-only
  busflow ui --allow-origin http://dashboard.lab:8080"""


@click.command(epilog=_EXAMPLES)
@click.option("--run", metavar="NAME", shell_complete=complete_runs, help="The run to show, where there are several.")
@click.option("--host", default="127.0.0.1", show_default=True, help="The address to listen at.")
@click.option(
    "--port", type=click.IntRange(0, 65535), default=8766, show_default=True, help="The port; 0 is a free one."
)
@click.option("--open", "opens", is_flag=True, help="Open the page in the browser.")
@click.option("--read-only", is_flag=True, help="The page may look, and change nothing.")
@click.option(
    "--allow-origin",
    "origins",
    metavar="ORIGIN",
    multiple=True,
    help="Let pages of this site embed panels that look, such as http://robot.lab:8080.",
)
def ui(run: str | None, host: str, port: int, opens: bool, read_only: bool, origins: tuple[str, ...]) -> int:
    """Show a running graph in a browser, until Ctrl-C: one address is printed, which lets its browser in."""
    import asyncio

    with joined(run) as peer:
        name = peer.run.name
    asyncio.run(_serve(name, host, port, origins, opens=opens, read_only=read_only))
    return 0


async def _serve(name: str, host: str, port: int, origins: tuple[str, ...], *, opens: bool, read_only: bool) -> None:
    from busflow_ui.page_server.access import PageAdmission, Tokens
    from busflow_ui.page_server.files import PageFiles, page_folder
    from busflow_ui.page_server.run_source import RunSource
    from busflow_ui.page_server.server import PageServer

    tokens = Tokens(read_only=read_only)
    source = RunSource(name, print_message=tell)
    server = PageServer(
        source,
        admission=PageAdmission(host, origins),
        tokens=tokens,
        files=PageFiles(page_folder(), origins),
        print_message=tell,
    )
    try:
        port = await server.open(host, port)
        url = f"http://{f'[{host}]' if ':' in host else host}:{port}/#token={tokens.own}"
        click.echo(f"{name} is shown at {url}")
        if origins:
            click.echo(f"  pages of {', '.join(origins)} look with the token {tokens.foreign}")
        if opens:
            click.launch(url)
        await source.keep()
    finally:
        await server.close()
