"""Links between machines: certificates, probes, and runs on other machines. Knows no graph.

Each machine has a run of its own: directory, main process, workers. One difference makes one graph of them: the main
process's session is a Zenoh router (`zenoh/session`), which listens and connects as the launch file's `network` says,
with the access control that `zenoh/network` writes. The other processes and the commands use the unix sockets as
ever.

A process is called `arm:eyes` everywhere outside its launch file (`launchfile/model/placement`), so that tokens,
queries and barriers of two machines do not meet; the barrier waits for processes of its own machine alone. The tokens
of other main processes say which machines are linked. `probe` connects by hand to a machine that is missing, since
Zenoh retries without a word. `runner/planning/machine` derives the description of one machine, and its credentials
are checked by a TLS handshake with themselves, in memory. `remote` is a run as `--run viewer@FILE` finds it.
docs/decisions/0009 has the reasons.
"""
