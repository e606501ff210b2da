"""A run served to Foxglove and Lichtblick over their WebSocket protocol, as one more peer of the run."""
