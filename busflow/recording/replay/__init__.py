"""Nodes run anew on a recording, and compared with it, on virtual time.

Nothing waits: each event comes once everything that the one before caused has been handled. `nodes` builds the nodes
with their recorded parameters; `rerun` goes through the file and lets everything that came to them from outside
happen again: messages (`inputs`), requests and answers (`calls`), changes of parameters, and ticks. A recording holds
the ticks, since an instant can hold a tick and an input, in either order; `ticks` keeps a timer's callback back until
its recorded tick comes, if that is the tick that its own grid is waiting for. `comparison` compares both sides, topic
by topic, as they come in.
"""
