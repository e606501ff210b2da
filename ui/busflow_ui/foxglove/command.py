"""`busflow foxglove`: serves a running graph to Foxglove and Lichtblick."""

from __future__ import annotations

from typing import TYPE_CHECKING
from urllib.parse import quote

import click

from busflow.commands import complete_runs, complete_topics, joined, print_message, takes_interfaces

if TYPE_CHECKING:
    from busflow.commands import Peer
    from busflow_ui.foxglove.admission import Admission

_EXAMPLES = """\b
Examples:
  busflow foxglove
  busflow foxglove --run lab1 --topics 'imu/*' joint_states --read-only"""
_DISTRO = "jazzy"
"""The distribution of ROS 2 whose standard types these are; viewers then offer all of them for publishing."""
_APP = "https://app.foxglove.dev/~/view?ds=foxglove-websocket&ds.url="


@click.command(epilog=_EXAMPLES)
@takes_interfaces
@click.option("--run", metavar="NAME", shell_complete=complete_runs, help="The run to serve, where there are several.")
@click.option("--host", default="127.0.0.1", show_default=True, help="The address to listen at.")
@click.option(
    "--port", type=click.IntRange(0, 65535), default=8765, show_default=True, help="The port; 0 is a free one."
)
@click.option(
    "--topics",
    metavar="PATTERN...",
    multiple=True,
    shell_complete=complete_topics,
    help="Only topics that match; * is a part of a name, ** several. May be given several times.",
)
@click.argument("more", metavar="[PATTERN]...", nargs=-1)
@click.option("--read-only", is_flag=True, help="Viewers may look, and not publish, call services or set parameters.")
@click.option(
    "--allow-origin",
    "origins",
    metavar="ORIGIN",
    multiple=True,
    help="Let pages of this site connect too, such as http://robot.lab:8080.",
)
def foxglove(
    run: str | None,
    host: str,
    port: int,
    topics: tuple[str, ...],
    more: tuple[str, ...],
    read_only: bool,
    origins: tuple[str, ...],
) -> int:
    """Serve a running graph to Foxglove and Lichtblick over WebSocket, until Ctrl-C or the end of the run.

    Each PATTERN is one more of those of --topics.
    """
    if more and not topics:
        raise click.UsageError(f"unexpected {more[0]!r}; patterns follow --topics")
    import asyncio

    from busflow_ui.foxglove.admission import Admission

    with joined(run) as peer:
        asyncio.run(_serve(peer, host, port, (*topics, *more), Admission(host, origins), read_only=read_only))
    click.echo(f"the run {peer.run.name} has ended")
    return 0


async def _serve(
    peer: Peer, host: str, port: int, topics: tuple[str, ...], admission: Admission, *, read_only: bool
) -> None:
    from busflow_ui.foxglove.admission import is_local
    from busflow_ui.foxglove.bridge import Bridge, Terms
    from busflow_ui.foxglove.websocket_server import WebSocketServer

    bridge = Bridge(peer, topics, print_message=print_message)
    terms = Terms(read_only, metadata={"ROS_DISTRO": _DISTRO})
    server = WebSocketServer(admission, lambda connection: bridge.serve(connection, terms), print_message=print_message)
    try:
        port = await server.open(host, port)
        if not is_local(host):
            print_message(f"warning: {_risk(host, read_only=read_only)}")
        url = f"ws://{f'[{host}]' if ':' in host else host}:{port}"
        click.echo(f"{peer.run.name} is served at {url} (Foxglove WebSocket), until Ctrl-C")
        click.echo(f"  {_APP}{quote(url, safe='')}")
        await bridge.ended()
        await bridge.announce_end()
    finally:
        await server.close()
        bridge.close()


def _risk(host: str, *, read_only: bool) -> str:
    may = "read every topic" if read_only else "read every topic, publish commands, call services and set parameters"
    return f"anyone that reaches {host} over the network can {may}: there is no password and no encryption"
