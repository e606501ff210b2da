"""Node, what its class declares, its parameters, and the plugins that offer nodes.

Builds no graph and reads no launch file.

Parameters while a run lasts: `node.parameters` is the truth, frozen, and replaced as a whole. A restart builds the
node from it and calls `take_over(former)` on the new store, which keeps sources and counts.
`runtime_of(node).parameters` is the node's `ParameterStore`. It belongs to the thread of the event loop;
`Graph.set_parameters` and `Bus.call` come from any other.

- `describe()` and `get(name)`: each parameter by its dotted name, with its declaration (`info`), its `value` as plain
  data, and its `source`: `default`, `code`, `lab1.yaml:21:16`, `command line`, or `set at run time`.
- `set(changes) -> SetResult`: all of `changes` or none. `changed` has old and new values, `faults` and `reason` say
  why the whole was refused. A refusal is a result, since a service answers with it; `Graph.set_parameters` raises it.
- `on_change`: called just after a change, the trace first, then the node's runtime, which publishes the event and
  calls the `@on_parameters` methods.

A set validates first: values, the model's validators, read-only parameters, and timers that could not tick so. Then,
with no await in between, it replaces the parameters, paces the timers and notifies. A `def` handler is never
interrupted by it; an `async def` handler can find other parameters after an `await`.

`/parameter_events` has no publisher until it is needed: where a node of the graph subscribes, or other processes see
the graph, every node with parameters has one from the start; for a later subscriber it is made at the first change.
"""
