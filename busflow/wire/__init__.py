"""Everything that crosses a process boundary, over lines and Zenoh. Writes no file of messages, and prints nothing.

Another terminal is one more member of the run's Zenoh session (`client`). It imports none of the run's code, and
neither pydantic nor numpy: what it shows is made of liveliness tokens, of answers to queries (`queries`, plain data),
and of messages read by the descriptions that the run offers.

- `mirror/membership` opens the run's directory and session when a graph starts and closes them when it has ended;
  `mirror/mirror` shows every node and endpoint as tokens. A publisher has an `outlet`, which encodes only while
  another process subscribes. They share one `connection`: bus, session, lines, senders, log, and the function that
  passes work to the loop.
- Between processes of a machine messages go by `line`, unless their publisher keeps them; to all others they go through
  Zenoh, large ones from the thread of a `sender`, so that a slow link never holds up the loop.
- `mirror/remote_publishers` admits publishers of other processes, as far as they fit, through one `inlet` a topic.
  Its buffer (`mirror/arrival_buffer`) gets messages of lines from the loop, and messages of Zenoh from the thread of a
  `mirror/zenoh_feed`, whose ring loses its oldest. The inlet publishes a few at a time as the nodes keep up, and skips
  those that no queue would keep. `mirror/late_joiners` asks publishers for more kept messages, if a
  subscription wants more than the inlet asked for.
- `client/client` joins a run: one of this machine (`zenoh/run_directory`), or one on others (`machines/remote`). The
  run forwards messages between two clients. A `listener` receives for an echo; a `speaker` publishes.
- A publisher from outside waits until all processes know it (`settle`): one query after its token. Each process
  handles both on its loop, in that order, and declares its subscriber before it answers; Zenoh keeps the order of
  declarations, and lets no query or answer overtake them, across routers too. So a process that has answered receives
  the first message. A blocked loop gets 2 s. What it misses after that is counted nowhere, since nothing
  was sent to it. Where the topic has another publisher, nothing is missed even then: the inlet is there, and messages
  wait in its ring behind the token. `unsigned` are messages in an inlet without any publisher; an inlet closes with
  its last one.
- A publisher of a run does not wait, and its outlet holds the first messages until the same question is answered
  (`mirror/held_messages`). `mirror/arrivals` knows each message by its publisher's gid and number, over broken links.
- `client/graph_view` joins tokens and answers into a `GraphView`; the answer to `graph` also names the tokens that a
  process sees (`elsewhere`). `client/runs` asks every run on the machine what it is, and gives up after a second;
  `client/checkup` finds in a view what is wrong, each finding with a remedy.
- `queries/logs` keeps the last 1000 lines of the log as text for later readers.
"""
