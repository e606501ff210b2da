"""Pairing: messages that wait for others of their time, or for a transform to a frame.

Changes nothing of delivery: each topic keeps its own subscription, queue and line of the
ledger, in which a message without a partner is a drop with the reason `unpaired`.

- `matching`: pure. What belongs together depends on the stamps alone, not on the order of arrival.
- `members`: the subscription of one topic of a group, whose messages wait in its own queue until they are matched.
- `group`: takes what waits to the handler, in turns of the dispatcher or in a task for an `async def`.
- `declarations`: the decorator `@synchronized`.
- `in_frame`: `@subscription(topic, in_frame=…)`, whose messages wait for a transform; late ones drop
  as `no_transform`.
"""
