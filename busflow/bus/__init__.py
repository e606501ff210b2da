"""Topics, services and timers of one process: QoS, queues, and whose turn it is.

Knows no node, no launch file and no other process. docs/architecture.md follows a message through it.

The way of a call:

1. `Client.call` hands its request to the `Service` of that name, which makes a `Call` of it: the request, and a
   future for the answer. Without a server, the future fails at once.
2. A context variable holds the `Activity` on whose behalf the call is made: the request that this task answers, or
   the node's `start`. If the server is held up, through however many others, by that very activity, the call would
   close a circle, and fails with `DeadlockError`. Calls are the only edges of this graph, so it is searched only when
   a handler calls.
3. The server queues the call or refuses it. Its handler is called as a subscription's is, in the dispatcher's turn or
   in a task of its own, one request at a time; what it returns or raises settles the future.
4. A timeout, by the run's clock, settles the future too; no task is cancelled for it. When the node ends, the server
   settles all its calls. The first result counts, and a caller that has gone withdraws a call that has not begun.

Another process uses two places: its requests come in as `await bus.services[name].call(request)`, and one of its
servers is an `Answerer` that joins `bus.service(name, type, origin)`.
"""
