"""A recording of a graph that runs. Reads no bag.

`Recorder` is no node: a node has a task, and one task more would change what a seed of `explore` finds. It is
notified of every endpoint that comes to the bus, as the trace is, and taps each topic (`capture`).

1. The tap turns the message into bytes (`channels`; of a large array the array itself, in parts that are never
   joined), and under a lock gives it the recording's next number and the run's time.
2. `Spool` takes it in, or has no room for it, which is a gap and a count. On the system's time its thread is woken
   when a chunk is to be begun or a MiB has gathered, and otherwise looks ten times a second; on simulated time there
   is none.
3. `McapWriter` adds it to the chunk, and cuts the chunk by its size. The spool cuts chunks by time: by the wall's in
   the thread, by the messages' without one.
4. `Destination` writes, unbuffered, and sees each time that the file is still there under its name. A failure leaves
   the file as it was after the last whole record.

Parameters, calls, ticks and the log take the same way, as messages that the recorder makes. Of several processes each
records its `Share`: the tap asks where a message comes from, and leaves to others what they have recorded.
docs/decisions/0010 has the reasons.
"""
