"""Programs around a graph that end in every way: a process for each argument, whose exit code and runs are printed."""

import asyncio
import os
import sys

import busflow
from busflow import Node, launch, publisher
from busflow.msgs.std_msgs import Int64
from busflow.wire.client.client import Peer
from busflow.wire.zenoh.run_directory import find_run, runs


class Talker(Node):
    """Only there."""

    numbers = publisher(Int64, "numbers")


class Fails(Node):
    """Fails at once."""

    async def run(self) -> None:
        raise ValueError("its own")


async def exits() -> None:
    async with launch(Talker, inspect="end"):
        sys.exit(3)


async def never_stops() -> None:
    await launch(Talker, inspect="end").start()


async def fails() -> None:
    async with launch(Fails, inspect="end") as graph:
        await graph.wait()


async def is_refused() -> None:
    await launch(Talker, Talker, inspect="end").start()


async def leaves_the_interpreter() -> None:
    await launch(Talker, inspect="end").start()
    os._exit(0)


async def stops_twice() -> None:
    graph = launch(Talker, inspect="end")
    async with graph:
        pass
    await graph.stop()


async def fails_while_a_peer_publishes() -> None:
    async with busflow.launch(Talker, inspect="end") as graph:
        late = graph.subscribe(Int64, "other")
        peer = await asyncio.to_thread(lambda: Peer(find_run("end")))
        type_ = await asyncio.to_thread(peer.type, "std_msgs/msg/Int64")

        def publish() -> None:
            with peer.advertise("/other", type_) as speaker:
                speaker.publish({"data": 1})

        await asyncio.to_thread(publish)
        await anext(late)
        peer.close()
        raise ValueError("its own")


for ending in sys.argv[1:]:
    if (child := os.fork()) == 0:  # with all imports; it ends as a program does
        asyncio.run(vars()[ending]())
        break
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    print(ending, code, [run.card.name for run in runs()], flush=True)
