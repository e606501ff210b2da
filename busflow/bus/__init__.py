"""Topics, services and timers of one process: QoS, queues, and the order in which handlers run.

This package knows no node, no launch file and no other process. docs/architecture.md follows a message through it.
"""
