"""`busflow dds`: opens a bridge between a running graph and the nodes of ROS 2 in a DDS domain."""

from __future__ import annotations

import click

from busflow.cli.options.lazy_group import importing
from busflow.cli.options.run import complete_runs

_LAST_DOMAIN = 232


_EXAMPLES = """\b
Examples:
  busflow dds --domain 7
  busflow dds --topics '/imu/*' --topics /cmd_vel
  busflow dds --interface eth0"""


@click.command(epilog=_EXAMPLES)
@click.option("--run", metavar="NAME", shell_complete=complete_runs, help="The run, if there are several.")
@click.option(
    "--domain",
    type=click.IntRange(0, _LAST_DOMAIN),
    envvar="ROS_DOMAIN_ID",
    default=0,
    help="The DDS domain; else that of ROS_DOMAIN_ID, or 0.",
)
@click.option("--topics", metavar="PATTERN", multiple=True, help="Only these topics, services and actions: /arm/**.")
@click.option("--interface", metavar="NAME", help="The network interface, such as eth0; else loopback.")
def dds(run: str | None, domain: int, topics: tuple[str, ...], interface: str | None) -> None:
    """Connect a running graph with nodes of ROS 2 that speak DDS.

    Without --interface only nodes of this machine do.
    """
    with importing():
        from busflow.dds.process import serve
        from busflow.wire.zenoh.run_directory import find_run

    serve(find_run(run), domain, topics, interface=interface)
