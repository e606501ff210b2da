"""Services: a client's call, the queue of the server that answers it, and the name that joins them.

This package knows no topic and no other process.

Steps of a call:

1. `Client.call` hands its request to the `Service` of that name, which makes a `Call` of it: the request, and a
   future for the answer. Without a server, the future fails at once.
2. A context variable holds the `Activity` that makes the call: the request that this task answers, or the node's
   `start`. If the server waits for that activity, directly or through other servers, the call would close a circle:
   it fails with `DeadlockError`. Calls are the only edges of this graph, so it is searched only when a handler calls.
3. The server queues the call or refuses it. Its handler is called as a subscription's is, in the dispatcher's turn or
   in its own task, one request at a time; the result or exception settles the future.
4. A timeout, by the run's clock, settles the future too; it cancels no task. When the node ends, the server settles
   all its calls. The first result counts. A caller that no longer waits withdraws a call that has not begun.

Other processes connect at two places. Their requests come in as `await bus.services[name].call(request)`. Their
servers are represented by an `Answerer` that joins `bus.service(name, type, origin)`.
"""
