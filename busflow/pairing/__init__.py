"""Pairing: messages of several topics that belong together, by their stamps: `@synchronized` above a handler.

Knows nothing of frames, and changes nothing of delivery: each topic keeps its own subscription, queue and line of the
ledger, in which a message without a partner is a drop with the reason `unpaired`.

- `matching`: pure. What belongs together depends on the stamps alone, not on the order of arrival.
- `members`: the subscription of one topic of a group, whose messages wait in its own queue until they are matched.
- `group`: takes what waits to the handler, in turns of the dispatcher or in a task for an `async def`.
- `words`: the decorator.
"""
