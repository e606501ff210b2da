"""Actions: goals that take their time, with feedback on the way and a cancel; the server, the client, their accounts.

This package knows no wire and no file. An action is three services and two topics of the bus under hidden names, with
ROS 2's types: `NAME/_action/send_goal`, `cancel_goal` and `get_result`; `feedback` and `status`. So what records,
replays, shows and carries services and topics does so for actions, and none of it is written twice. In one process
nothing is encoded: the goal, each feedback and the result are objects handed over.

Steps of a goal:

1. `SentGoal` registers for feedback, and its client calls `send_goal`. `ActionServer` asks the node whether it accepts
   the goal, then its `OpenGoals`, which apply what `when_busy` says: a goal is refused, waits, or begins.
2. A goal that begins runs in a task of the node's, which goes on with the next goal. Its handler runs as an `Activity`.
   So a service that the handler calls, and that waits for this goal, is a `DeadlockError`.
3. `get_result` is called at once, and answered when the goal ends. `ResultServer` keeps what came of a goal for those
   that ask later; `RESULT_KEPT_S` and `RESULTS_KEPT` bound that.
4. A cancel is `CancelledError` at the handler's next `await`. Every end of a goal goes through `ActionServer.finish`,
   which is called once for each: one terminal state, one count.
"""
