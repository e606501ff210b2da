"""Links between machines: certificates, probes and remote runs. Knows no graph."""
