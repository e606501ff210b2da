"""Lines between the processes of a run on one machine: every volatile message goes by them. Discovers nobody.

The reader decides the way: a process that is to receive a topic of another session connects to that session's socket in
the run's directory (`lines`). It does not find one on another machine, of another user, or in a container without the
directory, and then receives through Zenoh. One socket serves both directions (`line`). What travels is `packets`.

- For each topic that it receives, the reader opens a route. The sender's side of it is a `route`, the reader's side an
  `intake`. The sender may send as many packets as the reader's deepest queue can keep, at least 32; the reader
  acknowledges them. What the reader has no room for waits in the route, in a queue of the same depth, which drops
  messages as the reader's queue would. So no reader holds up a publisher or another topic, and nothing grows.
- The socket loses nothing and keeps the order. So a gap in a publisher's numbers is what that queue has dropped. What
  it has dropped last, no later message shows: a mark does.
- Small messages that follow each other closely leave as one packet at the end of the loop's turn.
- Large messages lie in the sender's `arena`, which the other end maps; the packet names the place. The place is used
  again when every reader has acknowledged the message. After a reader has gone that may still read, the process takes
  a new arena, so what anyone reads is never overwritten.
"""
