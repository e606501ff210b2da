"""A program of DDS alone with a type of its own, which it describes as nodes of ROS 2 do. Used as `peer.py` is."""

from dataclasses import dataclass, field

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import bounded_str, float32, int64, sequence, uint8, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from peer import KNOWN, Peer, main, qos, tell

FLOAT32, INT64 = 10, 8
"""Numbers of types in a description."""


@dataclass
class Reading(IdlStruct, typename="lab::msg::dds_::Reading_"):
    value: float32 = 0.0
    quality: int64 = 0


@dataclass
class FieldType(IdlStruct, typename="type_description_interfaces::msg::dds_::FieldType_"):
    type_id: uint8 = 0
    capacity: uint64 = 0
    string_capacity: uint64 = 0
    nested_type_name: bounded_str[255] = ""


@dataclass
class Field(IdlStruct, typename="type_description_interfaces::msg::dds_::Field_"):
    name: str = ""
    type: FieldType = field(default_factory=FieldType)
    default_value: str = ""


@dataclass
class Individual(IdlStruct, typename="type_description_interfaces::msg::dds_::IndividualTypeDescription_"):
    type_name: bounded_str[255] = ""
    fields: sequence[Field] = ()


@dataclass
class Description(IdlStruct, typename="type_description_interfaces::msg::dds_::TypeDescription_"):
    type_description: Individual = field(default_factory=Individual)
    referenced_type_descriptions: sequence[Individual] = ()


@dataclass
class Source(IdlStruct, typename="type_description_interfaces::msg::dds_::TypeSource_"):
    type_name: str = ""
    encoding: str = ""
    raw_file_contents: str = ""


@dataclass
class KeyValue(IdlStruct, typename="type_description_interfaces::msg::dds_::KeyValue_"):
    key: str = ""
    value: str = ""


@dataclass
class Request(IdlStruct, typename="type_description_interfaces::srv::dds_::GetTypeDescription_Request_"):
    guid: uint64 = 0
    seq: int64 = 0
    type_name: str = ""
    type_hash: str = ""
    include_type_sources: bool = True


@dataclass
class Reply(IdlStruct, typename="type_description_interfaces::srv::dds_::GetTypeDescription_Response_"):
    guid: uint64 = 0
    seq: int64 = 0
    successful: bool = False
    failure_reason: str = ""
    type_description: Description = field(default_factory=Description)
    type_sources: sequence[Source] = ()
    extra_information: sequence[KeyValue] = ()


KNOWN["Reading"] = Reading
FIELDS = [Field("value", FieldType(FLOAT32)), Field("quality", FieldType(INT64))]
DESCRIPTION = Description(Individual("lab/msg/Reading", FIELDS))


class DescriptionPeer(Peer):
    def describe(self, node):
        """Answer as a node of this name which types it has."""
        data, service = Policy.Userdata(b"serviceid= 1.2.9;"), f"{node}/get_type_description"
        asked, answered = (f"rq/{service}Request", Request), (f"rr/{service}Reply", Reply)
        writer = DataWriter(self.participant, self.topic(*answered), qos=qos({}, data))
        self.own[service] = DataReader(self.participant, self.topic(*asked), qos=qos({}, data))

        def on_requests(samples):
            for each in samples:
                if each.sample_info.valid_data:
                    tell(described=each.type_name)
                    writer.write(Reply(each.guid, each.seq, True, "", DESCRIPTION))

        self.watch(self.own[service], on_requests)


if __name__ == "__main__":
    main(DescriptionPeer)
