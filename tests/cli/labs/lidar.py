"""Commands of a lidar."""

import click

from busflow.errors import NoSuchTarget


@click.command()
@click.option("--speed", type=int, default=1)
def spin(speed: int) -> int:
    """Spin the lidar.

    As fast as it goes.
    """
    click.echo(f"spins at {speed}")
    return 3 if speed > 9 else 0


@click.command()
def stop() -> None:
    raise NoSuchTarget("there is no lidar")


@click.command()
def fail() -> None:
    raise KeyError("a mistake")


number = 5
