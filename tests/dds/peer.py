"""A program of DDS alone: it declares ROS 2's types by itself, and does what lines of JSON on standard input say.

It imports nothing of busflow. What it is asked to do it answers with a line of JSON on standard output; what arrives is
a line too. Run by the tests in a process of its own: `python peer.py DOMAIN ENCLAVE`.
"""

import json
import socket
import struct
import sys
import threading
from dataclasses import dataclass, field

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, bounded_str, int64, sequence, uint8, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from ros2_types import Float64, Image

CONFIGURATION = """<CycloneDDS><Domain Id="any"><General><Interfaces>
<NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces></General><Discovery>
<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""
SECOND_NS = 1_000_000_000
MOST_PARTICIPANTS = 10
"""Participants of a domain that get a packet; the bridge is among the first."""


@dataclass
class Int64(IdlStruct, typename="std_msgs::msg::dds_::Int64_"):
    data: int64 = 0


@dataclass
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str = ""


@dataclass
class AddRequest(IdlStruct, typename="example_interfaces::srv::dds_::AddTwoInts_Request_"):
    guid: uint64 = 0
    seq: int64 = 0
    a: int64 = 0
    b: int64 = 0


@dataclass
class AddReply(IdlStruct, typename="example_interfaces::srv::dds_::AddTwoInts_Response_"):
    guid: uint64 = 0
    seq: int64 = 0
    sum: int64 = 0


@dataclass
class Gid(IdlStruct, typename="rmw_dds_common::msg::dds_::Gid_"):
    data: array[uint8, 16] = (0,) * 16


@dataclass
class NodeInfo(IdlStruct, typename="rmw_dds_common::msg::dds_::NodeEntitiesInfo_"):
    node_namespace: bounded_str[256] = ""
    node_name: bounded_str[256] = ""
    reader_gid_seq: sequence[Gid] = ()
    writer_gid_seq: sequence[Gid] = ()


@dataclass
class Nodes(IdlStruct, typename="rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"):
    gid: Gid = field(default_factory=Gid)
    node_entities_info_seq: sequence[NodeInfo] = ()


KNOWN = {each.__name__: each for each in (Float64, Int64, String, Image)}


def qos(stated, *policies):
    latched = stated.get("latched", False)
    depth = Policy.History.KeepLast(stated.get("depth", 10))
    durability = [Policy.DurabilityService(0, depth, -1, -1, -1)] if latched and stated.get("writes") else []
    return Qos(
        depth,
        Policy.Reliability.BestEffort if stated.get("best_effort") else Policy.Reliability.Reliable(SECOND_NS),
        Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
        Policy.DataRepresentation(use_cdrv0_representation=True),
        *durability,
        *policies,
    )


def tell(**values):
    with TELLING:
        sys.stdout.write(json.dumps(values) + "\n")
        sys.stdout.flush()


TELLING = threading.Lock()


class Peer:
    def __init__(self, domain, enclave):
        self.number, self.domain = domain, Domain(domain, CONFIGURATION)
        self.participant = DomainParticipant(domain, qos=Qos(Policy.Userdata(enclave.encode())))
        self.writers, self.readers, self.functions = {}, [], {}
        self.own = {}
        self.waiting = WaitSet(self.participant)
        self.lock = threading.Lock()
        for kind, topic in (("writer", BuiltinTopicDcpsPublication), ("reader", BuiltinTopicDcpsSubscription)):
            self.watch(BuiltinDataReader(self.participant, topic), lambda ends, kind=kind: self.on_ends(kind, ends))
        threading.Thread(target=self.take, daemon=True).start()

    def watch(self, reader, function):
        with self.lock:
            self.readers.append((reader, function))
            self.waiting.attach(ReadCondition(reader, SampleState.NotRead | ViewState.Any | InstanceState.Any))

    def take(self):
        while True:
            self.waiting.wait(SECOND_NS // 10)
            with self.lock:
                readers = list(self.readers)
            for reader, function in readers:
                if samples := reader.take(N=100):
                    function(samples)

    def on_ends(self, kind, ends):
        for end in ends:
            alive = end.sample_info.instance_state == InstanceState.Alive and end.sample_info.valid_data
            if alive and end.participant_key != self.participant.guid:
                data = end.qos[Policy.Userdata]
                tell(
                    found=kind,
                    topic=end.topic_name,
                    type=end.type_name,
                    data=data.data.decode() if data else "",
                    gid=end.key.bytes.hex(),
                    latched=end.qos[Policy.Durability] == Policy.Durability.TransientLocal,
                    reliable=end.qos[Policy.Reliability] != Policy.Reliability.BestEffort,
                )

    def read(self, topic, kind, data="", **stated):
        reader = DataReader(
            self.participant, self.topic(topic, KNOWN[kind]), qos=qos(stated, Policy.Userdata(data.encode()))
        )
        self.own[topic] = reader

        def on_samples(samples):
            for sample in samples:
                if sample.sample_info.valid_data:
                    value = sample.data if not isinstance(sample, Image) else [len(sample.data), sum(sample.data[:9])]
                    tell(got=topic, value=value)

        self.watch(reader, on_samples)

    def topic(self, name, kind):
        return Topic(self.participant, name, kind)

    def advertise(self, topic, kind, data="", **stated):
        stated = qos({**stated, "writes": True}, Policy.Userdata(data.encode()))
        kind = KNOWN[kind]
        self.writers[topic] = self.own[topic] = DataWriter(self.participant, self.topic(topic, kind), qos=stated)
        self.functions[topic] = kind

    def write(self, topic, value, count=1):
        kind = self.functions[topic]
        for number in range(count):
            if kind is Image:
                self.writers[topic].write(
                    Image(height=1, width=value, step=value, data=bytes(range(250)) * (value // 250))
                )
            else:
                self.writers[topic].write(kind(data=value if count == 1 else number))

    def write_bytes(self, topic, payload):
        sample = self.functions[topic]()
        sample.serialize = lambda **_: bytes.fromhex(payload)
        self.writers[topic].write(sample)

    def inject(self, topic, payloads):
        """Send messages of a writer as packets, past Cyclone, which writes none that its type does not allow."""
        gid = self.writers[topic].guid.bytes
        for number, payload in enumerate(payloads, start=1):
            body = bytes.fromhex(payload)
            data = struct.pack("<HH", 0, 16) + bytes(4) + gid[12:] + struct.pack("<iI", 0, number) + body
            packet = b"RTPS" + bytes([2, 1, 1, 16]) + gid[:12] + struct.pack("<BBH", 0x15, 0x05, len(data)) + data
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
                for index in range(MOST_PARTICIPANTS):
                    sender.sendto(packet, ("127.0.0.1", 7411 + 250 * self.number + 2 * index))

    def list_nodes(self, nodes):
        """List nodes: `{"name": …, "namespace": …, "topics": […]}`, with the readers and writers of these topics."""
        if "nodes" not in self.own:
            stated = qos({"latched": True, "depth": 1, "writes": True})
            self.own["nodes"] = DataWriter(self.participant, self.topic("ros_discovery_info", Nodes), qos=stated)
        listed = []
        for node in nodes:
            ends = [self.own[topic] for topic in node.get("topics", ())]
            gids = {
                kind: [Gid(list(end.guid.bytes)) for end in ends if isinstance(end, kind)]
                for kind in (DataReader, DataWriter)
            }
            listed.append(NodeInfo(node.get("namespace", "/"), node["name"], gids[DataReader], gids[DataWriter]))
        self.own["nodes"].write(Nodes(Gid(list(self.participant.guid.bytes)), listed))

    def read_nodes(self):
        def on_lists(samples):
            for sample in samples:
                if sample.sample_info.valid_data:
                    for node in sample.node_entities_info_seq:
                        ends = {"readers": node.reader_gid_seq, "writers": node.writer_gid_seq}
                        gids = {kind: [bytes(gid.data).hex() for gid in each] for kind, each in ends.items()}
                        tell(node=node.node_name, namespace=node.node_namespace, **gids)

        self.watch(
            DataReader(self.participant, self.topic("ros_discovery_info", Nodes), qos=qos({"latched": True})), on_lists
        )

    def serve(self, name):
        data = Policy.Userdata(b"serviceid= 1.2.3;")
        writer = DataWriter(self.participant, self.topic(f"rr{name}Reply", AddReply), qos=qos({}, data))
        reader = DataReader(self.participant, self.topic(f"rq{name}Request", AddRequest), qos=qos({}, data))
        self.own[name] = writer

        def on_requests(samples):
            for each in samples:
                if each.sample_info.valid_data:
                    tell(asked=name, a=each.a, b=each.b)
                    writer.write(AddReply(each.guid, each.seq, each.a + each.b))

        self.watch(reader, on_requests)

    def client(self, name):
        data = Policy.Userdata(b"clientid= 4.5.6;")
        writer = DataWriter(self.participant, self.topic(f"rq{name}Request", AddRequest), qos=qos({}, data))
        reader = DataReader(self.participant, self.topic(f"rr{name}Reply", AddReply), qos=qos({}, data))
        self.writers[name] = writer

        def on_replies(samples):
            for each in samples:
                if each.sample_info.valid_data:
                    tell(answered=name, guid=each.guid, seq=each.seq, sum=each.sum)

        self.watch(reader, on_replies)

    def call(self, name, a, b, seq):
        self.writers[name].write(AddRequest(77, seq, a, b))


def main(kind):
    peer = kind(int(sys.argv[1]), sys.argv[2])
    tell(ready=True)
    for line in sys.stdin:
        command = json.loads(line)
        getattr(peer, command.pop("do"))(**command)
        tell(done=True)


if __name__ == "__main__":
    main(Peer)
