"""A run in several processes: starts them, holds them back until they see each other, supervises and ends them.

Runs no node in the main process that its graph does not have, and is imported only where a run has several processes.

The main process plans the whole graph, then keeps only its own nodes (`ProcessGroup`). For each other process a
`WorkerProcess` starts a `Child`: a new interpreter with `busflow run FILE --process NAME`, which reads on standard
input what it is to run (`Assignment`). The end of that pipe is the end of the main process, and so of the child
(`worker`). On another pipe the child reports its log, its figures, parameters that were set, and how it ended; a thread
here reads it, so neither can hold up the other. Parameters set at run time are in the assignment of the next life.

Each process mirrors its bus as any run does. Before its nodes start, each passes the barrier: it shows a token that
says how many tokens its endpoints have, and links to every other process of which it has seen all. A process that all
others link to cannot be missed by them. A restarted process does the same with those that are there.

The end: whatever ends the run sets `ending` of the main graph. Its own nodes stop, and at the same time the others
get SIGTERM, which is there what Ctrl-C is here. Each stops its nodes within the grace, writes the end of its file
(`Spool.close` waits `CLOSE_TIMEOUT_S` for the disk), reports on its pipe, and ends; only then the main process writes
the end of its own file and the recording's metadata. A process that takes longer is ended: by its `SignalGuard` 0.1 s
after both limits, which names what held it up, or, where it is stopped or holds the interpreter's lock, by
`WorkerProcess.kill` 0.1 s later. Without its last report it has failed. A second Ctrl-C ends the main process
at once, and so the others.

`report.merged` makes one report of all: a message counts as published where its publisher is, and as received where a
subscription is. docs/decisions/0008 has the reasons.
"""
