"""`lifecycle_msgs`: 4 messages, 4 services, from its definition files."""

# busflow interface generate lifecycle_msgs --to busflow/msgs
# wrote this from lifecycle_msgs 2.2.0 (Apache License 2.0). The comments of its files are left out. The files:
#   msg/State.msg                    RIHS01_dd2d02b82f3ebc858e53c431b1e6e91f3ffc71436fc81d0715214ac6ee2107a0
#   msg/Transition.msg               RIHS01_c65d7b31ea134cba4f54fc867b817979be799f7452035cd35fac9b7421fb3424
#   msg/TransitionDescription.msg    RIHS01_c5f1cd4bb1ad2ba0e3329d4ac7015c52a674a72c1faf7974c37a33f4f6048b28
#   msg/TransitionEvent.msg          RIHS01_d5f8873a2f0146498f812d7885c7327ce27e463d36811d8792f35ee38c0d6c38
#   srv/ChangeState.srv              RIHS01_356fe34f0475a43acf54542013af4167b0e729f77ea22ffb045c6ad8e20668e5
#   srv/GetAvailableStates.srv       RIHS01_00a07d79d2207d71e81a8cbc1880e5d924cc16d4688ea8e8e06e443dc8f8aa1d
#   srv/GetAvailableTransitions.srv  RIHS01_59b7ecefce0982a8a844b9f2c4f14764c1c4543cc55e72924e2aa4adad83e9bc
#   srv/GetState.srv                 RIHS01_800a0a5aae599782b02932de0caf563f6dc4e7e94b794eadde075ba2cbef9795

from collections.abc import Sequence
from typing import ClassVar

from busflow.interfaces.message import Message, ServiceType, uint8, uint64
from busflow.msgs import export_types


class State(Message, package="lifecycle_msgs"):
    """The message `lifecycle_msgs/msg/State`."""

    PRIMARY_STATE_UNKNOWN: ClassVar[uint8] = 0
    PRIMARY_STATE_UNCONFIGURED: ClassVar[uint8] = 1
    PRIMARY_STATE_INACTIVE: ClassVar[uint8] = 2
    PRIMARY_STATE_ACTIVE: ClassVar[uint8] = 3
    PRIMARY_STATE_FINALIZED: ClassVar[uint8] = 4
    TRANSITION_STATE_CONFIGURING: ClassVar[uint8] = 10
    TRANSITION_STATE_CLEANINGUP: ClassVar[uint8] = 11
    TRANSITION_STATE_SHUTTINGDOWN: ClassVar[uint8] = 12
    TRANSITION_STATE_ACTIVATING: ClassVar[uint8] = 13
    TRANSITION_STATE_DEACTIVATING: ClassVar[uint8] = 14
    TRANSITION_STATE_ERRORPROCESSING: ClassVar[uint8] = 15

    id: uint8 = 0
    label: str = ""


class Transition(Message, package="lifecycle_msgs"):
    """The message `lifecycle_msgs/msg/Transition`."""

    TRANSITION_CREATE: ClassVar[uint8] = 0
    TRANSITION_CONFIGURE: ClassVar[uint8] = 1
    TRANSITION_CLEANUP: ClassVar[uint8] = 2
    TRANSITION_ACTIVATE: ClassVar[uint8] = 3
    TRANSITION_DEACTIVATE: ClassVar[uint8] = 4
    TRANSITION_UNCONFIGURED_SHUTDOWN: ClassVar[uint8] = 5
    TRANSITION_INACTIVE_SHUTDOWN: ClassVar[uint8] = 6
    TRANSITION_ACTIVE_SHUTDOWN: ClassVar[uint8] = 7
    TRANSITION_DESTROY: ClassVar[uint8] = 8
    TRANSITION_ON_CONFIGURE_SUCCESS: ClassVar[uint8] = 10
    TRANSITION_ON_CONFIGURE_FAILURE: ClassVar[uint8] = 11
    TRANSITION_ON_CONFIGURE_ERROR: ClassVar[uint8] = 12
    TRANSITION_ON_CLEANUP_SUCCESS: ClassVar[uint8] = 20
    TRANSITION_ON_CLEANUP_FAILURE: ClassVar[uint8] = 21
    TRANSITION_ON_CLEANUP_ERROR: ClassVar[uint8] = 22
    TRANSITION_ON_ACTIVATE_SUCCESS: ClassVar[uint8] = 30
    TRANSITION_ON_ACTIVATE_FAILURE: ClassVar[uint8] = 31
    TRANSITION_ON_ACTIVATE_ERROR: ClassVar[uint8] = 32
    TRANSITION_ON_DEACTIVATE_SUCCESS: ClassVar[uint8] = 40
    TRANSITION_ON_DEACTIVATE_FAILURE: ClassVar[uint8] = 41
    TRANSITION_ON_DEACTIVATE_ERROR: ClassVar[uint8] = 42
    TRANSITION_ON_SHUTDOWN_SUCCESS: ClassVar[uint8] = 50
    TRANSITION_ON_SHUTDOWN_FAILURE: ClassVar[uint8] = 51
    TRANSITION_ON_SHUTDOWN_ERROR: ClassVar[uint8] = 52
    TRANSITION_ON_ERROR_SUCCESS: ClassVar[uint8] = 60
    TRANSITION_ON_ERROR_FAILURE: ClassVar[uint8] = 61
    TRANSITION_ON_ERROR_ERROR: ClassVar[uint8] = 62
    TRANSITION_CALLBACK_SUCCESS: ClassVar[uint8] = 97
    TRANSITION_CALLBACK_FAILURE: ClassVar[uint8] = 98
    TRANSITION_CALLBACK_ERROR: ClassVar[uint8] = 99

    id: uint8 = 0
    label: str = ""


class TransitionDescription(Message, package="lifecycle_msgs"):
    """The message `lifecycle_msgs/msg/TransitionDescription`."""

    transition: Transition = Transition()
    start_state: State = State()
    goal_state: State = State()


class TransitionEvent(Message, package="lifecycle_msgs"):
    """The message `lifecycle_msgs/msg/TransitionEvent`."""

    timestamp: uint64 = 0
    transition: Transition = Transition()
    start_state: State = State()
    goal_state: State = State()


class ChangeState(ServiceType, package="lifecycle_msgs"):
    """The service `lifecycle_msgs/srv/ChangeState`."""

    class Request(Message):
        """The request."""

        transition: Transition = Transition()

    class Response(Message):
        """The response."""

        success: bool = False


class GetAvailableStates(ServiceType, package="lifecycle_msgs"):
    """The service `lifecycle_msgs/srv/GetAvailableStates`."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        available_states: Sequence[State] = ()


class GetAvailableTransitions(ServiceType, package="lifecycle_msgs"):
    """The service `lifecycle_msgs/srv/GetAvailableTransitions`."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        available_transitions: Sequence[TransitionDescription] = ()


class GetState(ServiceType, package="lifecycle_msgs"):
    """The service `lifecycle_msgs/srv/GetState`."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        current_state: State = State()


export_types(globals())
