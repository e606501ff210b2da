"""Node, what its class declares, its parameters, and the plugins that offer nodes.

Builds no graph and reads no launch file.
"""
