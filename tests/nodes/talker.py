"""A node that logs texts which a terminal must not act on, and the network sockets of its process."""

from pathlib import Path

from busflow import Node

TEXT = "%s%n {0.__class__} %(x)s [red]x[/red] [link=a]"


class Talker(Node):
    """Logs at its start."""

    async def start(self) -> None:
        self.log.info(TEXT)
        self.log.info("two\n18:00:00.000 error lines")
        inodes = {link[8:-1] for fd in Path("/proc/self/fd").iterdir() if (link := name(fd)).startswith("socket:")}
        tables = [Path(f"/proc/self/net/{kind}").read_text() for kind in ("tcp", "tcp6", "udp", "udp6")]
        found = [line for table in tables for line in table.splitlines()[1:] if line.split()[9] in inodes]
        self.log.info("sockets", count=len(found))


def name(fd: Path) -> str:
    return str(fd.readlink()) if fd.is_symlink() else ""
