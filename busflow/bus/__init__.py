"""Topics, services and timers of one process: QoS, queues, and whose turn it is.

Knows no node, no launch file and no other process.
"""
