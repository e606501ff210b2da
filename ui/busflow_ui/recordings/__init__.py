"""Recordings shown to pages in the protocol of live runs: topics, messages at their time, and a moment to go to."""
