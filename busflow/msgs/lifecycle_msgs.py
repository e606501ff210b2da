"""`lifecycle_msgs`: 4 messages, 4 services, from its definition files."""

# busflow interface generate lifecycle_msgs --to busflow/msgs
# wrote this from lifecycle_msgs 2.2.0 (Apache License 2.0). Change its files instead, and run that again:
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

__all__ = [
    "ChangeState",
    "GetAvailableStates",
    "GetAvailableTransitions",
    "GetState",
    "State",
    "Transition",
    "TransitionDescription",
    "TransitionEvent",
]


class State(Message, package="lifecycle_msgs"):
    """Primary state definitions as depicted in:
    http://design.ros2.org/articles/node_lifecycle.html
    """

    PRIMARY_STATE_UNKNOWN: ClassVar[uint8] = 0
    """These are the primary states. State changes can only be requested when the
    node is in one of these states.

    Indicates state has not yet been set.
    """
    PRIMARY_STATE_UNCONFIGURED: ClassVar[uint8] = 1
    """This is the life cycle state the node is in immediately after being
    instantiated.
    """
    PRIMARY_STATE_INACTIVE: ClassVar[uint8] = 2
    """This state represents a node that is not currently performing any processing."""
    PRIMARY_STATE_ACTIVE: ClassVar[uint8] = 3
    """This is the main state of the node's life cycle. While in this state, the node
    performs any processing, responds to service requests, reads and processes
    data, produces output, etc.
    """
    PRIMARY_STATE_FINALIZED: ClassVar[uint8] = 4
    """The finalized state is the state in which the node ends immediately before
    being destroyed.
    """
    TRANSITION_STATE_CONFIGURING: ClassVar[uint8] = 10
    """Temporary intermediate states. When a transition is requested, the node
    changes its state into one of these states.

    In this transition state the node's onConfigure callback will be called to
    allow the node to load its configuration and conduct any required setup.
    """
    TRANSITION_STATE_CLEANINGUP: ClassVar[uint8] = 11
    """In this transition state the node's callback onCleanup will be called to clear
    all state and return the node to a functionally equivalent state as when
    first created.
    """
    TRANSITION_STATE_SHUTTINGDOWN: ClassVar[uint8] = 12
    """In this transition state the callback onShutdown will be executed to do any
    cleanup necessary before destruction.
    """
    TRANSITION_STATE_ACTIVATING: ClassVar[uint8] = 13
    """In this transition state the callback onActivate will be executed to do any
    final preparations to start executing.
    """
    TRANSITION_STATE_DEACTIVATING: ClassVar[uint8] = 14
    """In this transition state the callback onDeactivate will be executed to do any
    cleanup to start executing, and reverse the onActivate changes.
    """
    TRANSITION_STATE_ERRORPROCESSING: ClassVar[uint8] = 15
    """This transition state is where any error may be cleaned up."""

    id: uint8 = 0
    """The state id value from the above definitions."""
    label: str = ""
    """A text label of the state."""


class Transition(Message, package="lifecycle_msgs"):
    """Default values for transitions as described in:
    http://design.ros2.org/articles/node_lifecycle.html
    """

    TRANSITION_CREATE: ClassVar[uint8] = 0
    """Reserved [0-9], publicly available transitions.
    When a node is in one of these primary states, these transitions can be
    invoked.

    This transition will instantiate the node, but will not run any code beyond
    the constructor.
    """
    TRANSITION_CONFIGURE: ClassVar[uint8] = 1
    """The node's onConfigure callback will be called to allow the node to load its
    configuration and conduct any required setup.
    """
    TRANSITION_CLEANUP: ClassVar[uint8] = 2
    """The node's callback onCleanup will be called in this transition to allow the
    node to load its configuration and conduct any required setup.
    """
    TRANSITION_ACTIVATE: ClassVar[uint8] = 3
    """The node's callback onActivate will be executed to do any final preparations
    to start executing.
    """
    TRANSITION_DEACTIVATE: ClassVar[uint8] = 4
    """The node's callback onDeactivate will be executed to do any cleanup to start
    executing, and reverse the onActivate changes.
    """
    TRANSITION_UNCONFIGURED_SHUTDOWN: ClassVar[uint8] = 5
    """This signals shutdown during an unconfigured state, the node's callback
    onShutdown will be executed to do any cleanup necessary before destruction.
    """
    TRANSITION_INACTIVE_SHUTDOWN: ClassVar[uint8] = 6
    """This signals shutdown during an inactive state, the node's callback onShutdown
    will be executed to do any cleanup necessary before destruction.
    """
    TRANSITION_ACTIVE_SHUTDOWN: ClassVar[uint8] = 7
    """This signals shutdown during an active state, the node's callback onShutdown
    will be executed to do any cleanup necessary before destruction.
    """
    TRANSITION_DESTROY: ClassVar[uint8] = 8
    """This transition will simply cause the deallocation of the node."""
    TRANSITION_ON_CONFIGURE_SUCCESS: ClassVar[uint8] = 10
    """Reserved [10-69], private transitions
    These transitions are not publicly available and cannot be invoked by a user.
    The following transitions are implicitly invoked based on the callback
    feedback of the intermediate transition states.
    """
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
    """Reserved [90-99]. Transition callback success values.
    These return values ought to be set as a return value for each callback.
    Depending on which return value, the transition will be executed correctly or
    fallback/error callbacks will be triggered.

    The transition callback successfully performed its required functionality.
    """
    TRANSITION_CALLBACK_FAILURE: ClassVar[uint8] = 98
    """The transition callback failed to perform its required functionality."""
    TRANSITION_CALLBACK_ERROR: ClassVar[uint8] = 99
    """The transition callback encountered an error that requires special cleanup, if
    possible.
    """

    id: uint8 = 0
    """Fields

    The transition id from above definitions.
    """
    label: str = ""
    """A text label of the transition."""


class TransitionDescription(Message, package="lifecycle_msgs"):
    """The message `lifecycle_msgs/msg/TransitionDescription`."""

    transition: Transition = Transition()
    """The transition id and label of this description."""
    start_state: State = State()
    """The current state from which this transition transitions."""
    goal_state: State = State()
    """The desired target state of this transition."""


class TransitionEvent(Message, package="lifecycle_msgs"):
    """The message `lifecycle_msgs/msg/TransitionEvent`."""

    timestamp: uint64 = 0
    """The time point at which this event occurred."""
    transition: Transition = Transition()
    """The id and label of this transition event."""
    start_state: State = State()
    """The starting state from which this event transitioned."""
    goal_state: State = State()
    """The end state of this transition event."""


class ChangeState(ServiceType, package="lifecycle_msgs"):
    """The service `lifecycle_msgs/srv/ChangeState`."""

    class Request(Message):
        """The request."""

        transition: Transition = Transition()
        """The requested transition.

        This change state service will fail if the transition is not possible.
        """

    class Response(Message):
        """The response."""

        success: bool = False
        """Indicates whether the service was able to initiate the state transition"""


class GetAvailableStates(ServiceType, package="lifecycle_msgs"):
    """The service `lifecycle_msgs/srv/GetAvailableStates`."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        available_states: Sequence[State] = ()
        """Array of possible states that can be transitioned to."""


class GetAvailableTransitions(ServiceType, package="lifecycle_msgs"):
    """The service `lifecycle_msgs/srv/GetAvailableTransitions`."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        available_transitions: Sequence[TransitionDescription] = ()
        """An array of the possible start_state-goal_state transitions"""


class GetState(ServiceType, package="lifecycle_msgs"):
    """The service `lifecycle_msgs/srv/GetState`."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        current_state: State = State()
        """The current state-machine state of the node."""
