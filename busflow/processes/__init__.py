"""Processes of a run: starts them, delays their nodes until all are linked, supervises the processes and ends them.

Runs no node in the main process that its graph does not have. It is imported only if a run has several processes.

The main process plans the whole graph, then keeps only its own nodes (`ProcessGroup`). For each other process a
`WorkerProcess` starts a `Child`: a new interpreter with `python -m busflow.processes.worker NAME`, which reads on
standard input which launch file and which of its nodes to run (`Assignment`). That pipe stays open until the main
process ends; then the child ends too (`worker`). On another pipe the child sends its log, its report, parameters that
were set, and how it ended. A thread of the main process reads that pipe, so neither process delays the other. The
assignment after a restart has the parameters that were set at run time.

Each process mirrors its bus as any run does. Before its nodes start, each passes the barrier: it shows a token that
says how many tokens its nodes have, and declares a link to every other process of which it has seen all tokens. Once
all others have declared a link to a process, they miss none of its messages. A restarted process does the same with the
processes that are there.

The end: everything that ends the run sets `ending` of the main graph. The nodes of the main process stop, and at the
same time each other process gets the exit code on its pipe, and sends itself SIGTERM, which stops it as Ctrl-C stops
the main process (one that does not read its pipe yet gets SIGTERM alone). Each stops its nodes within the grace,
writes the end of its recording file (`Spool.close` waits `Timeouts.recording_end` for the disk), reports on its pipe,
and ends. Only then the main process writes the end of its own file and the recording's metadata. If a process takes
longer than both limits, its `SignalGuard` ends it after 0.1 s more, and names what delayed it. If it is suspended or
holds the interpreter's lock, `WorkerProcess.kill` ends it 0.1 s later. A process without a last report has failed. A
second Ctrl-C ends the main process at once, and so the others.

`report.merged` makes one report of all: a message counts as published in the process of its publisher, and as received
in the process of a subscription. docs/decisions/0008 has the reasons.
"""
