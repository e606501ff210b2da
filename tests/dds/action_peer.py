"""A program of DDS alone with an action of ROS 2: its server, or a client of one. Used as `peer.py` is."""

import threading

from action_types import (
    SERVICES,
    TOPICS,
    CancelReply,
    CancelRequest,
    Feedback,
    Goal,
    GoalInfo,
    GoalStatus,
    Progress,
    Result,
    ResultReply,
    ResultRequest,
    SendReply,
    SendRequest,
    States,
    Uuid,
)
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from peer import Peer, main, qos, tell

EXECUTING, SUCCEEDED, CANCELED = 2, 4, 5
STEP_S = 0.05
LATCHED = {"latched": True, "depth": 1}


def text(goal_id):
    return bytes(goal_id.uuid).hex()


def uuid(goal_id):
    return Uuid(list(bytes.fromhex(goal_id)))


class RunningGoal:
    """A goal of a server, whose sequence grows by one number in each step."""

    def __init__(self, order):
        self.order, self.sequence, self.status, self.asked = order, [0, 1], EXECUTING, []


class Server:
    """A server as those of ROS 2 are: it takes goals of any order that is not negative."""

    def __init__(self, peer, name):
        self.name, self.goals, self.lock, self.ending = name, {}, threading.Lock(), threading.Event()
        feedback, status = (peer.topic(f"rt{name}/_action/{part}", kind) for part, kind in TOPICS.items())
        self.feedback = DataWriter(peer.participant, feedback, qos=qos({}))
        self.status = DataWriter(peer.participant, status, qos=qos({**LATCHED, "writes": True}))
        self.writers = {}
        functions = {"send_goal": self.on_send, "cancel_goal": self.on_cancel, "get_result": self.on_ask}
        for part, function in functions.items():
            self.writers[part], reader = peer.ends(name, part, is_server=True)
            peer.watch_valid(reader, function)
        threading.Thread(target=self.step, daemon=True).start()

    def on_send(self, request):
        goal_id, order = text(request.goal_id), request.goal.order
        tell(asked=self.name, id=goal_id, order=order)
        with self.lock:
            if order >= 0:
                self.goals[goal_id] = RunningGoal(order)
                self.publish_states()
        self.writers["send_goal"].write(SendReply(request.guid, request.seq, order >= 0))

    def on_cancel(self, request):
        goal_id = text(request.goal_info.goal_id)
        tell(cancel=self.name, id=goal_id)
        with self.lock:
            goal = self.goals.get(goal_id)
            code = 2 if goal is None else 0 if goal.status == EXECUTING else 3
            ending = [] if code else [GoalInfo(uuid(goal_id))]
            self.writers["cancel_goal"].write(CancelReply(request.guid, request.seq, code, ending))
            if not code:
                self.end(goal, CANCELED)

    def on_ask(self, request):
        with self.lock:
            goal = self.goals.get(text(request.goal_id))
            if goal is not None and goal.status == EXECUTING:
                goal.asked.append(request)
            else:
                self.answer(request, goal)

    def answer(self, request, goal):
        found = (0, Result()) if goal is None else (goal.status, Result(goal.sequence))
        self.writers["get_result"].write(ResultReply(request.guid, request.seq, *found))

    def end(self, goal, status):
        goal.status = status
        self.publish_states()
        for request in goal.asked:
            self.answer(request, goal)

    def publish_states(self):
        states = [GoalStatus(GoalInfo(uuid(each)), goal.status) for each, goal in self.goals.items()]
        self.status.write(States(states))

    def step(self):
        while not self.ending.wait(STEP_S):
            with self.lock:
                for goal_id, goal in self.goals.items():
                    if goal.status == EXECUTING and len(goal.sequence) > goal.order:
                        self.end(goal, SUCCEEDED)
                    elif goal.status == EXECUTING:
                        goal.sequence.append((goal.sequence[-1] + goal.sequence[-2]) % 1_000_000)
                        self.feedback.write(Feedback(uuid(goal_id), Progress(goal.sequence[-20:])))


class ActionPeer(Peer):
    def ends(self, name, part, is_server):
        """The writer of one side of an action's service, and the reader of what the other side writes."""
        number = list(SERVICES).index(part) + 1
        data = Policy.Userdata(f"{'serviceid' if is_server else 'clientid'}= 1.2.{number};".encode())
        names = [f"rq{name}/_action/{part}Request", f"rr{name}/_action/{part}Reply"]
        asked, answered = (self.topic(each, kind) for each, kind in zip(names, SERVICES[part], strict=True))
        read, written = (asked, answered) if is_server else (answered, asked)
        writer = DataWriter(self.participant, written, qos=qos({}, data))
        return writer, DataReader(self.participant, read, qos=qos({}, data))

    def watch_valid(self, reader, function):
        """Call a function with each valid sample of a reader."""
        self.watch(reader, lambda samples: [function(each) for each in samples if each.sample_info.valid_data])

    def serve_action(self, name):
        self.own[name] = Server(self, name)

    def client_of_action(self, name):
        def on_reply(part):
            def say(reply):
                said = {"part": part, "seq": reply.seq, "guid": reply.guid}
                if part == "send_goal":
                    tell(**said, accepted=reply.accepted)
                elif part == "get_result":
                    tell(**said, status=reply.status, sequence=list(reply.result.sequence))
                else:
                    tell(**said, code=reply.return_code, ending=[text(each.goal_id) for each in reply.goals_canceling])

            return say

        for part in SERVICES:
            self.writers[name, part], reader = self.ends(name, part, is_server=False)
            self.watch_valid(reader, on_reply(part))
        feedback = DataReader(self.participant, self.topic(f"rt{name}/_action/feedback", Feedback), qos=qos({}))
        self.watch_valid(
            feedback, lambda each: tell(feedback=text(each.goal_id), sequence=list(each.feedback.sequence))
        )
        states = DataReader(self.participant, self.topic(f"rt{name}/_action/status", States), qos=qos(LATCHED))
        self.watch_valid(
            states,
            lambda each: [tell(state=one.status, id=text(one.goal_info.goal_id)) for one in each.status_list],
        )

    def send_goal(self, name, goal, order, seq):
        self.writers[name, "send_goal"].write(SendRequest(77, seq, uuid(goal), Goal(order)))

    def get_result(self, name, goal, seq):
        self.writers[name, "get_result"].write(ResultRequest(77, seq, uuid(goal)))

    def cancel_goal(self, name, goal, seq):
        self.writers[name, "cancel_goal"].write(CancelRequest(77, seq, GoalInfo(uuid(goal))))


if __name__ == "__main__":
    main(ActionPeer)
