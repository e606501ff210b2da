"""`type_description_interfaces`: 6 messages, 1 service, from its definition files."""

# busflow interface generate type_description_interfaces --to busflow/msgs
# wrote this from type_description_interfaces 2.2.0 (Apache License 2.0).
# The comments of its files are left out. The files:
#   msg/Field.msg                      RIHS01_c0b01379cd4226281285ccaf6be46653968f855f7c5e41614ff5d7a854efef7c
#   msg/FieldType.msg                  RIHS01_a70b6dd919645a03a3586f7f821defbc886ea3e531a1d95cc0f380a3973ccaa6
#   msg/IndividualTypeDescription.msg  RIHS01_55c827d86c3c141bdd318fe6c22e11190e4d3b37c8f4f9751a084aa05ce96560
#   msg/KeyValue.msg                   RIHS01_274fe56bf14f33c7512e34c646a37579ee36779f745f049a9760763e817f0c42
#   msg/TypeDescription.msg            RIHS01_739f2508c9fa3a6f330913ff5b9d25fb74159a077da71e1087f51a60c12a080b
#   msg/TypeSource.msg                 RIHS01_faeaec7596c04ecf5b6e99ad225e4c7cbb997ad5435f793526fb3984d011aae5
#   srv/GetTypeDescription.srv         RIHS01_69b9c19c1021405984cc60dbbb1edceb147a6538b411d812ba6afabeed962cd5

from collections.abc import Sequence
from typing import Annotated, ClassVar

from busflow.interfaces.message import Length, Message, ServiceType, uint8, uint64
from busflow.msgs import export_types


class FieldType(Message, package="type_description_interfaces"):
    """Represents the type of a field and related meta-data."""

    FIELD_TYPE_NOT_SET: ClassVar[uint8] = 0
    """A constant for each type supported according to:
      http://design.ros2.org/articles/legacy_interface_definition.html
    and:
      http://design.ros2.org/articles/idl_interface_definition.html
    Order is loosely coupled to the order of appearance in the IDL 4.2 spec:
     https://www.omg.org/spec/IDL/4.2

    Layout of constants across the 0-255 decimal values in the uint8:

    - 000    : Reserved for "not set"
    - 001-048: Primitive types, strings, and reserved space for future primitive types
    - 049-096: Fixed sized array of primitive and string types
    - 097-144: Bounded Sequences of primitive and string types
    - 145-192: Unbounded Sequences of primitive and string types
    - 193-255: Reserved space for future array/sequence-like types
    """
    FIELD_TYPE_NESTED_TYPE: ClassVar[uint8] = 1
    """Nested type defined in other .msg/.idl files."""
    FIELD_TYPE_INT8: ClassVar[uint8] = 2
    """Integer Types"""
    FIELD_TYPE_UINT8: ClassVar[uint8] = 3
    FIELD_TYPE_INT16: ClassVar[uint8] = 4
    FIELD_TYPE_UINT16: ClassVar[uint8] = 5
    FIELD_TYPE_INT32: ClassVar[uint8] = 6
    FIELD_TYPE_UINT32: ClassVar[uint8] = 7
    FIELD_TYPE_INT64: ClassVar[uint8] = 8
    FIELD_TYPE_UINT64: ClassVar[uint8] = 9
    FIELD_TYPE_FLOAT: ClassVar[uint8] = 10
    """Floating-Point Types"""
    FIELD_TYPE_DOUBLE: ClassVar[uint8] = 11
    FIELD_TYPE_LONG_DOUBLE: ClassVar[uint8] = 12
    FIELD_TYPE_CHAR: ClassVar[uint8] = 13
    """Char and WChar Types"""
    FIELD_TYPE_WCHAR: ClassVar[uint8] = 14
    FIELD_TYPE_BOOLEAN: ClassVar[uint8] = 15
    """Boolean Type"""
    FIELD_TYPE_BYTE: ClassVar[uint8] = 16
    """Byte/Octet Type"""
    FIELD_TYPE_STRING: ClassVar[uint8] = 17
    """String Types"""
    FIELD_TYPE_WSTRING: ClassVar[uint8] = 18
    FIELD_TYPE_FIXED_STRING: ClassVar[uint8] = 19
    """Fixed String Types"""
    FIELD_TYPE_FIXED_WSTRING: ClassVar[uint8] = 20
    FIELD_TYPE_BOUNDED_STRING: ClassVar[uint8] = 21
    """Bounded String Types"""
    FIELD_TYPE_BOUNDED_WSTRING: ClassVar[uint8] = 22
    FIELD_TYPE_NESTED_TYPE_ARRAY: ClassVar[uint8] = 49
    """Fixed Sized Array Types"""
    FIELD_TYPE_INT8_ARRAY: ClassVar[uint8] = 50
    FIELD_TYPE_UINT8_ARRAY: ClassVar[uint8] = 51
    FIELD_TYPE_INT16_ARRAY: ClassVar[uint8] = 52
    FIELD_TYPE_UINT16_ARRAY: ClassVar[uint8] = 53
    FIELD_TYPE_INT32_ARRAY: ClassVar[uint8] = 54
    FIELD_TYPE_UINT32_ARRAY: ClassVar[uint8] = 55
    FIELD_TYPE_INT64_ARRAY: ClassVar[uint8] = 56
    FIELD_TYPE_UINT64_ARRAY: ClassVar[uint8] = 57
    FIELD_TYPE_FLOAT_ARRAY: ClassVar[uint8] = 58
    FIELD_TYPE_DOUBLE_ARRAY: ClassVar[uint8] = 59
    FIELD_TYPE_LONG_DOUBLE_ARRAY: ClassVar[uint8] = 60
    FIELD_TYPE_CHAR_ARRAY: ClassVar[uint8] = 61
    FIELD_TYPE_WCHAR_ARRAY: ClassVar[uint8] = 62
    FIELD_TYPE_BOOLEAN_ARRAY: ClassVar[uint8] = 63
    FIELD_TYPE_BYTE_ARRAY: ClassVar[uint8] = 64
    FIELD_TYPE_STRING_ARRAY: ClassVar[uint8] = 65
    FIELD_TYPE_WSTRING_ARRAY: ClassVar[uint8] = 66
    FIELD_TYPE_FIXED_STRING_ARRAY: ClassVar[uint8] = 67
    FIELD_TYPE_FIXED_WSTRING_ARRAY: ClassVar[uint8] = 68
    FIELD_TYPE_BOUNDED_STRING_ARRAY: ClassVar[uint8] = 69
    FIELD_TYPE_BOUNDED_WSTRING_ARRAY: ClassVar[uint8] = 70
    FIELD_TYPE_NESTED_TYPE_BOUNDED_SEQUENCE: ClassVar[uint8] = 97
    """Bounded Sequence Types"""
    FIELD_TYPE_INT8_BOUNDED_SEQUENCE: ClassVar[uint8] = 98
    FIELD_TYPE_UINT8_BOUNDED_SEQUENCE: ClassVar[uint8] = 99
    FIELD_TYPE_INT16_BOUNDED_SEQUENCE: ClassVar[uint8] = 100
    FIELD_TYPE_UINT16_BOUNDED_SEQUENCE: ClassVar[uint8] = 101
    FIELD_TYPE_INT32_BOUNDED_SEQUENCE: ClassVar[uint8] = 102
    FIELD_TYPE_UINT32_BOUNDED_SEQUENCE: ClassVar[uint8] = 103
    FIELD_TYPE_INT64_BOUNDED_SEQUENCE: ClassVar[uint8] = 104
    FIELD_TYPE_UINT64_BOUNDED_SEQUENCE: ClassVar[uint8] = 105
    FIELD_TYPE_FLOAT_BOUNDED_SEQUENCE: ClassVar[uint8] = 106
    FIELD_TYPE_DOUBLE_BOUNDED_SEQUENCE: ClassVar[uint8] = 107
    FIELD_TYPE_LONG_DOUBLE_BOUNDED_SEQUENCE: ClassVar[uint8] = 108
    FIELD_TYPE_CHAR_BOUNDED_SEQUENCE: ClassVar[uint8] = 109
    FIELD_TYPE_WCHAR_BOUNDED_SEQUENCE: ClassVar[uint8] = 110
    FIELD_TYPE_BOOLEAN_BOUNDED_SEQUENCE: ClassVar[uint8] = 111
    FIELD_TYPE_BYTE_BOUNDED_SEQUENCE: ClassVar[uint8] = 112
    FIELD_TYPE_STRING_BOUNDED_SEQUENCE: ClassVar[uint8] = 113
    FIELD_TYPE_WSTRING_BOUNDED_SEQUENCE: ClassVar[uint8] = 114
    FIELD_TYPE_FIXED_STRING_BOUNDED_SEQUENCE: ClassVar[uint8] = 115
    FIELD_TYPE_FIXED_WSTRING_BOUNDED_SEQUENCE: ClassVar[uint8] = 116
    FIELD_TYPE_BOUNDED_STRING_BOUNDED_SEQUENCE: ClassVar[uint8] = 117
    FIELD_TYPE_BOUNDED_WSTRING_BOUNDED_SEQUENCE: ClassVar[uint8] = 118
    FIELD_TYPE_NESTED_TYPE_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 145
    """Unbounded Sequence Types"""
    FIELD_TYPE_INT8_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 146
    FIELD_TYPE_UINT8_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 147
    FIELD_TYPE_INT16_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 148
    FIELD_TYPE_UINT16_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 149
    FIELD_TYPE_INT32_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 150
    FIELD_TYPE_UINT32_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 151
    FIELD_TYPE_INT64_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 152
    FIELD_TYPE_UINT64_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 153
    FIELD_TYPE_FLOAT_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 154
    FIELD_TYPE_DOUBLE_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 155
    FIELD_TYPE_LONG_DOUBLE_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 156
    FIELD_TYPE_CHAR_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 157
    FIELD_TYPE_WCHAR_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 158
    FIELD_TYPE_BOOLEAN_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 159
    FIELD_TYPE_BYTE_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 160
    FIELD_TYPE_STRING_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 161
    FIELD_TYPE_WSTRING_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 162
    FIELD_TYPE_FIXED_STRING_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 163
    FIELD_TYPE_FIXED_WSTRING_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 164
    FIELD_TYPE_BOUNDED_STRING_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 165
    FIELD_TYPE_BOUNDED_WSTRING_UNBOUNDED_SEQUENCE: ClassVar[uint8] = 166

    type_id: uint8 = 0
    """Identifying number for the type of the field, using one of the above constants."""
    capacity: uint64 = 0
    """Only used when the type is an array or a bounded sequence.
    In the case of an array, this is the fixed capacity of the array.
    In the case of a bounded sequence, this is the maximum capacity of the sequence.
    In all other cases this field is unused.
    """
    string_capacity: uint64 = 0
    """Only used when the type is a fixed or bounded string/wstring, or a array/sequence of those.
    In the case of a fixed string/wstring, it is the fixed length of the string.
    In the case of a bounded string/wstring, it is the maximum capacity of the string.
    In the case of an array/sequence of fixed string/wstring, it is the fixed length of the strings.
    In the case of an array/sequence of bounded string/wstring, it is the maximum capacity of the strings.
    It is not currently possible to have different string capacities per element in the array/sequence.
    """
    nested_type_name: Annotated[str, Length(max=255)] = ""
    """Only used when the type is a nested type or array/sequence of nested types.
    This is limited to 255 characters.
    TODO(wjwwood): this 255 character limit was chosen due to this being the limit
      for DDSI-RTPS based middlewares, which is the most commonly used right now.
      We lack a ROS 2 specific limit in our design documents, but we should update
      this and/or link to the design doc when that is available.
    """


class Field(Message, package="type_description_interfaces"):
    """Represents a single field in a type."""

    name: str = ""
    """Name of the field."""
    type: FieldType = FieldType()
    """Type of the field, including details about the type like length, nested name, etc."""
    default_value: str = ""
    """Literal default value of the field as a string, as it appeared in the original
    message description file, whether that be .msg/.srv/.action or .idl.
    """


class IndividualTypeDescription(Message, package="type_description_interfaces"):
    """Represents a single type, without the types it references, if any."""

    type_name: Annotated[str, Length(max=255)] = ""
    """Name of the type.
    This is limited to 255 characters.
    TODO(wjwwood): this 255 character limit was chosen due to this being the limit
      for DDSI-RTPS based middlewares, which is the most commonly used right now.
      We lack a ROS 2 specific limit in our design documents, but we should update
      this and/or link to the design doc when that is available.
    """
    fields: Sequence[Field] = ()
    """Fields of the type."""


class KeyValue(Message, package="type_description_interfaces"):
    """Represents an arbitrary key-value pair for application-specific information."""

    key: str = ""
    value: str = ""


class TypeDescription(Message, package="type_description_interfaces"):
    """Represents a complete type description, including the type itself as well as the types it references."""

    type_description: IndividualTypeDescription = IndividualTypeDescription()
    """Description of the type."""
    referenced_type_descriptions: Sequence[IndividualTypeDescription] = ()
    """Descriptions of all referenced types, recursively."""


class TypeSource(Message, package="type_description_interfaces"):
    """Represents the original source of a ROS 2 interface definition."""

    type_name: str = ""
    """ROS interface type name, in PACKAGE/NAMESPACE/TYPENAME format."""
    encoding: str = ""
    """The type of the original source file, typically matching the file extension.
    Well-known encodings: "idl", "msg", "srv", "action", "dynamic", "implicit".
    "dynamic" specifies a type created programmatically by a user, thus having no source.
    "implicit" specifies a type created automatically as a subtype of a
    complex type (service or action) - such as the request message for a service.
    Implicit types will have no contents, the full source will be available on the parent srv/action.
    """
    raw_file_contents: str = ""
    """Dumped contents of the interface definition source file.
    If `encoding` is "dynamic" or "implicit", this field will be empty.
    """


class GetTypeDescription(ServiceType, package="type_description_interfaces"):
    """The service `type_description_interfaces/srv/GetTypeDescription`."""

    class Request(Message):
        """The request."""

        type_name: str = ""
        """ROS interface type name, in PACKAGE/NAMESPACE/TYPENAME format."""
        type_hash: str = ""
        """REP-2011 RIHS hash string."""
        include_type_sources: bool = True
        """Whether to return the original idl/msg/etc. source file(s) in the response."""

    class Response(Message):
        """The response."""

        successful: bool = False
        """True if the type description information is available and populated in the response.
        If false, all other fields except `failure_reason` are considered undefined.
        """
        failure_reason: str = ""
        """If `successful` is false, contains a reason for failure.
        If `successful` is true, this is left empty.
        """
        type_description: TypeDescription = TypeDescription()
        """The parsed type description which can be used programmatically."""
        type_sources: Sequence[TypeSource] = ()
        """A list containing the interface definition source text of the requested type,
        plus all types it recursively depends on.
        Each source text is a copy of the original contents of the
        .msg, .srv, .action, .idl, or other file if it exists, including comments and whitespace.
        Sources can be matched with IndividualTypeDescriptions by their `type_name`.
        The `encoding` field of each entry informs how to interpret its contents.
        """
        extra_information: Sequence[KeyValue] = ()
        """Key-value pairs of extra information."""


export_types(globals())
