"""`control_msgs`: 38 messages, 3 services, 8 actions, from its definition files."""

# busflow interface generate control_msgs --to busflow/msgs
# wrote this from control_msgs 6.8.0 (BSD-3-Clause). Change its files instead, and run that again:
#   msg/AdmittanceControllerState.msg             RIHS01_8a23c54184ba101c9a733a0a882001edae478c8c3ea37132f9aae1d82fad0b73
#   msg/BatteryStateArray.msg                     RIHS01_51ce72fa9e20d9bf19438c68725f360ba3daa51d8cd2b17fdf630c1aa8c4a3ce
#   msg/CANopenState.msg                          RIHS01_9a99909feb08be78066dc0922dad6d98e4e156883bca5bfac6f69d7cfa0d8c59
#   msg/DynamicInterfaceGroupValues.msg           RIHS01_0ebef56c55cdde46b4622f7e0a4dbf26fefbf0296205463e955047252b434cbc
#   msg/DynamicInterfaceValues.msg                RIHS01_715f733fee51b15fa3b3b5f5ab89bd2c0e38999cc5641960b0bbb32da29d1b8e
#   msg/DynamicJointState.msg                     RIHS01_18024c98a62697680f581108eeed40b28fb4542fa0ac5a8e36f56c62b6813d26
#   msg/EtherCATState.msg                         RIHS01_baea23cdc1772b7c5b012bcaadee0a763b02938b9bc463fe5898a0021c7b1e09
#   msg/Float64Values.msg                         RIHS01_ea84ee6911c0fad1cf103debf8bd65ac330dd5c94a316d861b78dd2617f8a92c
#   msg/GenericHardwareState.msg                  RIHS01_bcaf0de2186757418ed4bb211738c0bb59fccb10f0612660e2c5048eb567d7bc
#   msg/GripperCommand.msg                        RIHS01_57eb8f326c9889ca8bb34ead82cc94cc09bf6bc5c3b6c09546dca3a00b589890
#   msg/HardwareDeviceDiagnostics.msg             RIHS01_03c3fbf76f7f28d45622b5031f48784bb2d9bee38586d973028a56971d592ce8
#   msg/HardwareDeviceStatus.msg                  RIHS01_ecbdff2572d29afc687e31fe6e2006c95eda8d7bb5bb98fca1a262942c5e96cd
#   msg/HardwareDiagnostics.msg                   RIHS01_e3b287cd0fba0f7702bcd728d76c8e598b329edd6333fe6b5d4b5ff6ac54ea22
#   msg/HardwareStatus.msg                        RIHS01_d4d081efebdea6d8863855733ea95c58338ac4ffdb501a9524da4cbbad9927a2
#   msg/InterfaceValue.msg                        RIHS01_74a12144ef6b7af67533195cb30f7f607d3301b66950208a72d280695f3e190c
#   msg/JointComponentTolerance.msg               RIHS01_739ea7566931944d33830fa10f1bf5e7a7fbdc3172bce7a7eaac642bd6e3ffa4
#   msg/JointControllerState.msg                  RIHS01_1f6ee64b3b1f1947951f34694f8e19a10ea32f34fe3552df26514f8b30976e90
#   msg/JointJog.msg                              RIHS01_ba249455a20f70168a1acb7bf43b776b72ff1f7eb5fc4cfea443f749e963c6e7
#   msg/JointTolerance.msg                        RIHS01_c254f9cece0f3b733017b6990fd46d1326e25242d6b8844398c97d9a88e7d648
#   msg/JointTrajectoryControllerState.msg        RIHS01_51d8dd89cc624cbe9daaeeb4d80d6de9b86168ffdc3be41fefc0953e3c26e480
#   msg/JointWrenchTrajectory.msg                 RIHS01_5534591b14e9605ce8e3d6858adb3249d2e46e33122f9b84c09b84bedddd0a25
#   msg/JointWrenchTrajectoryPoint.msg            RIHS01_777b7eb05a00f3bd497edefabc06fb8273fa37b228d23d65ade484ccc70ac613
#   msg/Keys.msg                                  RIHS01_b897c1e1a1ef079862dfa0c09b816901f3646caf37c32e04825cbc75c43f0828
#   msg/MecanumDriveControllerState.msg           RIHS01_c560d21a4484fd5f2c05896a11de3315f4c33535a203d3e8d62af4b6a9cd3355
#   msg/MotionArgument.msg                        RIHS01_687b5ea43abbba3ab7c3a22d39c25d1eca0b71287aa097d93bc9d94d1d900b7b
#   msg/MotionPrimitive.msg                       RIHS01_04bc62c55472206d3b9719201a9f81e084a93d2a885056fc7c1d94db5fdb5ca5
#   msg/MotionPrimitiveSequence.msg               RIHS01_91c33402c47df62886152255a68846f61699bb2a36d061b3bd1b3898e0f51523
#   msg/MultiDOFCommand.msg                       RIHS01_033fb0fa1ffc63a872ca73c61a49ded83a22daa5cc3f074cc28949f73359e677
#   msg/MultiDOFStateStamped.msg                  RIHS01_08e47e3e734a7d08131b57e14e9f740782f3bf9a1aadabd2a16b54d27e551f0a
#   msg/PidState.msg                              RIHS01_02d464a78563dce5014a2b8f9e3d3bd5344f537891c4b9f089d71feadd7f6e4b
#   msg/SingleDOFState.msg                        RIHS01_fe8365f86265bddfefbd26698975a818bf024a1c267c8ce577cd366ef06d7163
#   msg/SingleDOFStateStamped.msg                 RIHS01_33859c01b46943f1458f83f2627249d34332b38e545c723ddbdabea2b6675af1
#   msg/SpeedScalingFactor.msg                    RIHS01_0c240f349f2b74e33e8741f83e0f196ddeb6585923663876ed3c1f51f0566037
#   msg/SteeringControllerCommand.msg             RIHS01_19fba4bf598c8755a79d33c7742c999bec87ebedc2fc99dd38c51479ffcfac14
#   msg/SteeringControllerStatus.msg              RIHS01_c5e01a345d3104d84631193fd94ed5d9781a4a6bed95de1744dfb42c752f2931
#   msg/VDA5050SafetyState.msg                    RIHS01_7c7aa367aa9f12f1ed5bf56a0863633570fbb92498291233b60f156766e9b180
#   msg/VDA5050State.msg                          RIHS01_f80ff130c012ef7efd918e8056bb914b38fb36e84339d889bca5fc5681414a34
#   msg/WrenchFramed.msg                          RIHS01_c3154e85334ede6531b15c0f847b0afeaad2fc69061ec12cebd826cfa0e27764
#   srv/QueryCalibrationState.srv                 RIHS01_c6b9d1fd88cba488075ee9fd7b69ea4ff6b12bcdd01afeb9c608dd6f8274de57
#   srv/QueryTrajectoryState.srv                  RIHS01_4a0935dffef18bc5b9e101c9d03d84e681ecd4cebd724b8f11fde008751a325a
#   srv/SetOdometry.srv                           RIHS01_cf3fe2bf6627a67b4883ba6e876a7b46cdd991417ece9f4f4dac5452fbfdea48
#   action/ExecuteMotionPrimitiveSequence.action  RIHS01_e3a57ab17377b5921790c8c8dd6e130436aecaf2c91369f48954827ecb9b45b2
#   action/FollowJointTrajectory.action           RIHS01_ff29901b2693f5deb847e96084a1c2cdb26e70b7c847be21859b70a55fb29cf0
#   action/FollowJointWrenchTrajectory.action     RIHS01_68bdc50dd95a2dac9c91b6cb38a6868a945c03c0775f851f0b20a5e3bd02f923
#   action/GripperCommand.action                  RIHS01_e17c0e644eccf14bea84a0a93e0977182872c2eb7873ca6694900059b46dbc84
#   action/JointTrajectory.action                 RIHS01_8db0176d9778d501036234e238568b82af95ce3f69271592fbf9887ca9421380
#   action/ParallelGripperCommand.action          RIHS01_adfd3c1ebe8abc38ebcc0e454b6423d291d4010dd5697d14eca5b9be4726ae18
#   action/PointHead.action                       RIHS01_7074c3bddad393f3db72da02a8bb0fe3d832c21447452694b496965bdbfc9cc1
#   action/SingleJointPosition.action             RIHS01_1b330d11638c0b1d3228cc80b1123e5b3db3d24592e95429812bf30056e3db7b

from collections.abc import Sequence
from typing import ClassVar

from busflow.interfaces.action import ActionType
from busflow.interfaces.message import (
    Float64Array,
    Message,
    ServiceType,
    UInt8Array,
    float64,
    int8,
    int32,
    string,
    uint8,
    uint16,
    uint32,
    zeros,
)
from busflow.msgs import trajectory_msgs
from busflow.msgs.builtin_interfaces import Duration, Time
from busflow.msgs.diagnostic_msgs import KeyValue
from busflow.msgs.geometry_msgs import (
    PointStamped,
    PoseStamped,
    Quaternion,
    TransformStamped,
    Twist,
    TwistStamped,
    Vector3,
    Wrench,
    WrenchStamped,
)
from busflow.msgs.sensor_msgs import BatteryState, JointState
from busflow.msgs.std_msgs import Float64MultiArray, Header, Int8MultiArray, String
from busflow.msgs.trajectory_msgs import JointTrajectoryPoint, MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

__all__ = [
    "AdmittanceControllerState",
    "BatteryStateArray",
    "CANopenState",
    "DynamicInterfaceGroupValues",
    "DynamicInterfaceValues",
    "DynamicJointState",
    "EtherCATState",
    "ExecuteMotionPrimitiveSequence",
    "Float64Values",
    "FollowJointTrajectory",
    "FollowJointWrenchTrajectory",
    "GenericHardwareState",
    "GripperCommand",
    "HardwareDeviceDiagnostics",
    "HardwareDeviceStatus",
    "HardwareDiagnostics",
    "HardwareStatus",
    "InterfaceValue",
    "JointComponentTolerance",
    "JointControllerState",
    "JointJog",
    "JointTolerance",
    "JointTrajectory",
    "JointTrajectoryControllerState",
    "JointWrenchTrajectory",
    "JointWrenchTrajectoryPoint",
    "Keys",
    "MecanumDriveControllerState",
    "MotionArgument",
    "MotionPrimitive",
    "MotionPrimitiveSequence",
    "MultiDOFCommand",
    "MultiDOFStateStamped",
    "ParallelGripperCommand",
    "PidState",
    "PointHead",
    "QueryCalibrationState",
    "QueryTrajectoryState",
    "SetOdometry",
    "SingleDOFState",
    "SingleDOFStateStamped",
    "SingleJointPosition",
    "SpeedScalingFactor",
    "SteeringControllerCommand",
    "SteeringControllerStatus",
    "VDA5050SafetyState",
    "VDA5050State",
    "WrenchFramed",
    "action",
]


class AdmittanceControllerState(Message, package="control_msgs"):
    """The message `control_msgs/msg/AdmittanceControllerState`."""

    mass: Float64MultiArray = Float64MultiArray()
    """Admittance parameters

    6-vector of mass terms used in the admittance calculation
    """
    damping: Float64MultiArray = Float64MultiArray()
    """6-vector of damping terms used in the admittance calculation"""
    stiffness: Float64MultiArray = Float64MultiArray()
    """6-vector of stiffness terms used in the admittance calculation"""
    rot_base_control: Quaternion = Quaternion()
    """Frame information

    quaternion describing the orientation of the control frame
    """
    ref_trans_base_ft: TransformStamped = TransformStamped()
    """force torque sensor transform at the reference joint configuration"""
    selected_axes: Int8MultiArray = Int8MultiArray()
    """6-vector of 0/1 describing if admittance is enable in the corresponding control frame axis"""
    ft_sensor_frame: String = String()
    """name of the force torque frame"""
    admittance_position: TransformStamped = TransformStamped()
    """State information

    calculated admittance position in cartesian space
    """
    admittance_acceleration: TwistStamped = TwistStamped()
    """calculated admittance acceleration in cartesian space"""
    admittance_velocity: TwistStamped = TwistStamped()
    """calculated admittance velocity in cartesian space"""
    wrench_base: WrenchStamped = WrenchStamped()
    """wrench used in the admittance calculation"""
    joint_state: JointState = JointState()
    """calculated admittance offsets in joint space"""


class BatteryStateArray(Message, package="control_msgs"):
    """This message publishes values for multiple batteries at once."""

    battery_states: Sequence[BatteryState] = ()


class CANopenState(Message, package="control_msgs"):
    """This message presents CANopen-specific device state information
    Refer CiA 301 and CiA 402 application layer documentation
    """

    NMT_INITIALISING: ClassVar[uint8] = 0
    """--- NMT State Constants -------------------------------------------
    CiA 301 Network Management states

    Device is initializing
    """
    NMT_PRE_OPERATIONAL: ClassVar[uint8] = 127
    """Device is in pre-operational state"""
    NMT_OPERATIONAL: ClassVar[uint8] = 5
    """Device is operational"""
    NMT_STOPPED: ClassVar[uint8] = 4
    """Device is stopped"""
    DSP402_NOT_READY_TO_SWITCH_ON: ClassVar[uint8] = 0
    """--- DSP 402 State Constants ---------------------------------------
    CiA 402 Drive state machine states

    Not ready to switch on
    """
    DSP402_SWITCH_ON_DISABLED: ClassVar[uint8] = 1
    """Switch on disabled"""
    DSP402_READY_TO_SWITCH_ON: ClassVar[uint8] = 2
    """Ready to switch on"""
    DSP402_SWITCHED_ON: ClassVar[uint8] = 3
    """Switched on"""
    DSP402_OPERATION_ENABLED: ClassVar[uint8] = 4
    """Operation enabled"""
    DSP402_QUICK_STOP_ACTIVE: ClassVar[uint8] = 5
    """Quick stop active"""
    DSP402_FAULT_REACTION_ACTIVE: ClassVar[uint8] = 6
    """Fault reaction active"""
    DSP402_FAULT: ClassVar[uint8] = 7
    """Fault state"""

    node_id: uint8 = 0
    """The CANopen node ID of the device (1-127)"""
    nmt_state: uint8 = 0
    """--- CiA 301 State -------------------------------------------------
    Network Management state, see NMTState constants below
    """
    dsp_402_state: uint8 = 0
    """--- CiA 402 State (for drives) ------------------------------------
    Drive state machine state for motion control devices, see DSP402State constants below
    """
    last_emcy_code: uint32 = 0
    """--- Error Reporting -----------------------------------------------
    Last Emergency (EMCY) error code received from the device
    """


class InterfaceValue(Message, package="control_msgs"):
    """The message `control_msgs/msg/InterfaceValue`."""

    interface_names: Sequence[str] = ()
    """List of resource interface names"""
    values: Float64Array = zeros()
    """Values corresponding to the list of interfaces in `interface_names`, [1.0, 0.0] for example"""


class DynamicInterfaceGroupValues(Message, package="control_msgs"):
    """The message `control_msgs/msg/DynamicInterfaceGroupValues`."""

    header: Header = Header()
    interface_groups: Sequence[str] = ()
    """List of interface group names , e.g. ["flange_analog_IOs", "flange_vacuum"]"""
    interface_values: Sequence[InterfaceValue] = ()
    """Key-value pairs representing interfaces and their corresponding values for each interface group listed in
    `interface_groups`

    """


class DynamicInterfaceValues(Message, package="control_msgs"):
    """The message `control_msgs/msg/DynamicInterfaceValues`."""

    header: Header = Header()
    states: InterfaceValue = InterfaceValue()
    commands: InterfaceValue = InterfaceValue()


class DynamicJointState(Message, package="control_msgs"):
    """The message `control_msgs/msg/DynamicJointState`."""

    header: Header = Header()
    joint_names: Sequence[str] = ()
    """List of resource names, e.g. ["arm_joint_1", "arm_joint_2", "gripper_joint"]"""
    interface_values: Sequence[InterfaceValue] = ()
    """Key-value pairs representing interfaces and their corresponding values for each joint listed in `joint_names`"""


class EtherCATState(Message, package="control_msgs"):
    """This message presents EtherCAT-specific device state information
    Refer ETG.1000 EtherCAT Specification
    """

    AL_STATE_INIT: ClassVar[uint8] = 1
    """--- Application Layer State Constants -----------------------------
    EtherCAT slave states according to ETG.1000

    INIT state - slave initialization
    """
    AL_STATE_PREOP: ClassVar[uint8] = 2
    """PREOP state - pre-operational, mailbox communication"""
    AL_STATE_BOOTSTRAP: ClassVar[uint8] = 3
    """BOOTSTRAP state - firmware update mode"""
    AL_STATE_SAFEOP: ClassVar[uint8] = 4
    """SAFEOP state - safe operational, inputs updated"""
    AL_STATE_OP: ClassVar[uint8] = 8
    """OP state - operational, full communication"""

    slave_position: uint16 = 0
    """Position of the slave on the bus (0, 1, 2...)"""
    vendor_id: str = ""
    """Unique vendor identifier from the device's ESI file"""
    product_code: str = ""
    """Unique product code for the device from the device's ESI file"""
    al_state: uint8 = 0
    """--- EtherCAT State Machine (ESM) ----------------------------------
    Application Layer state, see ALState constants below
    """
    has_error: bool = False
    """True if the slave is in an error state"""
    al_status_code: uint16 = 0
    """AL Status Code indicating the reason for an error (0 = no error)"""


class Float64Values(Message, package="control_msgs"):
    """The message `control_msgs/msg/Float64Values`."""

    header: Header = Header()
    values: Float64Array = zeros()
    """List of values corresponding to the interfaces or joints defined in Keys.msg
    The size and order must match that of Keys.msg
    Each value corresponds to the key at the same index in Keys.msg

    For example. if Keys.msg has keys = ["joint1/position", "joint2/velocity"], then
    InterfacesValues.msg could have values = [1.57, 0.0]. The first value (1.57) corresponds to "joint1/position"
    and the second value (0.0) corresponds to "joint2/velocity"

    This message is used by the interfaces_state_broadcaster to publish the values of the interfaces via
    ROS 2 topics ~/names (Keys.msg) and ~/values (InterfacesValues.msg)
    """


class GenericHardwareState(Message, package="control_msgs"):
    """This message encapsulates the general-purpose status fields, serving as a baseline for any hardware component"""

    HEALTH_UNKNOWN: ClassVar[uint8] = 0
    """--- Health Status Constants -------------------------------------
    High-level health indicators
    """
    HEALTH_OK: ClassVar[uint8] = 1
    HEALTH_DEGRADED: ClassVar[uint8] = 2
    HEALTH_WARNING: ClassVar[uint8] = 3
    HEALTH_ERROR: ClassVar[uint8] = 4
    """Hardware stops publishing state when it returns ERROR/FATAL, how are these set/updated?"""
    HEALTH_FATAL: ClassVar[uint8] = 5
    ERROR_NONE: ClassVar[uint8] = 0
    """--- Error Domain Constants --------------------------------------
    Error categories
    """
    ERROR_UNKNOWN: ClassVar[uint8] = 1
    ERROR_HW: ClassVar[uint8] = 2
    """generic hardware fault/error"""
    ERROR_SW: ClassVar[uint8] = 3
    """generic software fault/error"""
    ERROR_OVER_TRAVEL: ClassVar[uint8] = 4
    """Hardware stopped motion because position is over limits"""
    EMERGENCY_STOP_HW: ClassVar[uint8] = 5
    """Hardware/Software emergency and safety states

    state of the emergency stop hardware (i.e. e-stop button state)
    """
    EMERGENCY_STOP_SW: ClassVar[uint8] = 6
    """state of the emergency stop software system (over travel, pinch point)"""
    PROTECTIVE_STOP_HW: ClassVar[uint8] = 7
    """state of the protective stop hardware (i.e. safety field state)"""
    PROTECTIVE_STOP_SW: ClassVar[uint8] = 8
    """state of the software protective stop"""
    SAFETY_STOP: ClassVar[uint8] = 9
    CALIBRATION_REQUIRED: ClassVar[uint8] = 10
    MODE_UNKNOWN: ClassVar[uint8] = 0
    """--- Operational Mode Constants ----------------------------------
    Mode of operation
    """
    MODE_MANUAL: ClassVar[uint8] = 1
    MODE_AUTO: ClassVar[uint8] = 2
    """automatic mode when the driver is remote controlling the hardware"""
    MODE_SAFE: ClassVar[uint8] = 3
    """what is the expected use case for this mode?"""
    MODE_MAINTENANCE: ClassVar[uint8] = 4
    MODE_JOG_MANUAL: ClassVar[uint8] = 5
    MODE_ADMITTANCE: ClassVar[uint8] = 6
    MODE_MONITORED_STOP: ClassVar[uint8] = 7
    MODE_HOLD_TO_RUN: ClassVar[uint8] = 8
    MODE_CARTESIAN_TWIST: ClassVar[uint8] = 9
    MODE_CARTESIAN_POSE: ClassVar[uint8] = 10
    MODE_TRAJECTORY_FORWARDING: ClassVar[uint8] = 11
    MODE_TRAJECTORY_STREAMING: ClassVar[uint8] = 12
    POWER_UNKNOWN: ClassVar[uint8] = 0
    """--- Power State Constants ---------------------------------------
    Power states
    """
    POWER_OFF: ClassVar[uint8] = 1
    POWER_STANDBY: ClassVar[uint8] = 2
    POWER_ON: ClassVar[uint8] = 3
    POWER_SLEEP: ClassVar[uint8] = 4
    POWER_ERROR: ClassVar[uint8] = 5
    POWER_LEVEL_LOW: ClassVar[uint8] = 6
    """Battery power states see BatteryState.msg"""
    POWER_LEVEL_CRITICAL: ClassVar[uint8] = 7
    POWER_CHARGING: ClassVar[uint8] = 8
    POWER_CHARGING_ERROR: ClassVar[uint8] = 9
    CONNECT_UNKNOWN: ClassVar[uint8] = 0
    """--- Connectivity Status Constants -------------------------------
    Connectivity states
    """
    CONNECT_UP: ClassVar[uint8] = 1
    CONNECT_DOWN: ClassVar[uint8] = 2
    CONNECT_FAILURE: ClassVar[uint8] = 3
    CONNECTION_SLOW: ClassVar[uint8] = 4
    """to tell the controlling system it is struggling to communicate at rate"""

    health_status: uint8 = 0
    """--- Health & Error ----------------------------------------------
    Overall health status of the device, see HealthStatus constants below
    """
    error_domain: UInt8Array = zeros()
    """Array of device errors by category, see ErrorDomain constants below"""
    operational_mode: uint8 = 0
    """--- Operational State -------------------------------------------
    Current operational mode of the device, see ModeStatus constants below
    """
    power_state: uint8 = 0
    """Current power state of the device, see PowerState constants below"""
    connectivity_status: uint8 = 0
    """Current connectivity status of the device, see ConnectivityStatus constants below"""
    manufacturer: str = ""
    """--- Vendor & Version Info ----------------------------------------
    Device manufacturer name, e.g. "Bosch"
    """
    model: str = ""
    """Device model identifier, e.g. "Lidar-XYZ-v2"

    """
    firmware_version: str = ""
    """Current firmware version, e.g. "1.2.3"

    """
    state_details: Sequence[KeyValue] = ()
    """--- Optional Details for Context ---------------------------------
    Provides specific quantitative values related to the enums above.
    e.g., for power_state, could have {key: "voltage", value: "24.1"}
    e.g., for connectivity, could have {key: "signal_strength", value: "-55dBm"}
    """


class GripperCommand(Message, package="control_msgs"):
    """The message `control_msgs/msg/GripperCommand`."""

    position: float64 = 0.0
    max_effort: float64 = 0.0


class HardwareDeviceDiagnostics(Message, package="control_msgs"):
    """This message presents current hardware device status information"""

    header: Header = Header()
    """Header timestamp should be update time of device diagnostics"""
    device_id: str = ""
    """Unique identifier for the device, e.g. "base_motor", "gripper_joint_1"

    """
    entries: Sequence[KeyValue] = ()
    """--- Diagnostic Entries --------------------------------------------
    Key-value pairs representing diagnostic information for the device.
    """


class VDA5050State(Message, package="control_msgs"):
    """This message presents VDA5050-specific vehicle state information
    For AGVs and AMRs compliant with VDA5050, this provides a snapshot of the vehicle's high-level status
    Refer Official Specification document for the VDA 5050 - https://github.com/VDA5050/VDA5050
    """

    ACTION_WAITING: ClassVar[string] = "WAITING"
    """--- Action Status Constants ---------------------------------------
    VDA5050 action execution states

    Action is waiting to be executed
    """
    ACTION_INITIALIZING: ClassVar[string] = "INITIALIZING"
    """Action is being initialized"""
    ACTION_RUNNING: ClassVar[string] = "RUNNING"
    """Action is currently executing"""
    ACTION_PAUSED: ClassVar[string] = "PAUSED"
    """Action execution is paused"""
    ACTION_FINISHED: ClassVar[string] = "FINISHED"
    """Action completed successfully"""
    ACTION_FAILED: ClassVar[string] = "FAILED"
    """Action execution failed"""
    MODE_AUTOMATIC: ClassVar[string] = "AUTOMATIC"
    """--- Operating Mode Constants -------------------------------------
    VDA5050 vehicle operating modes

    Vehicle operates autonomously
    """
    MODE_SEMI_AUTOMATIC: ClassVar[string] = "SEMIAUTOMATIC"
    """Vehicle requires operator confirmation"""
    MODE_MANUAL: ClassVar[string] = "MANUAL"
    """Vehicle is under manual control"""
    MODE_SERVICE: ClassVar[string] = "SERVICE"
    """Vehicle is in service/maintenance mode"""
    MODE_EMERGENCY: ClassVar[string] = "EMERGENCY"
    """Vehicle is in emergency mode"""
    MODE_TEACHIN: ClassVar[string] = "TEACHIN"
    """Vehicle is in teach-in mode for route learning"""

    order_id: str = ""
    """--- Order and Action Status ---------------------------------------
    ID of the currently executed order
    """
    action_status: str = ""
    """Current action execution status, see ActionStatus constants below"""
    last_node_id: uint32 = 0
    """ID of the last reached node in the topology"""
    driving: bool = False
    """--- Vehicle State -------------------------------------------------
    True if the vehicle's drives are active and vehicle is in motion
    """
    battery_charge: float64 = 0.0
    """Current battery charge level in percent (0.0 - 100.0)"""
    operating_mode: str = ""
    """Current operating mode of the vehicle, see OperatingMode constants below"""
    error_type: str = ""
    """--- Error Reporting -----------------------------------------------
    Type/category of the current error, empty string if no error
    """
    error_description: str = ""
    """Human-readable description of the current error, empty string if no error"""


class HardwareDeviceStatus(Message, package="control_msgs"):
    """This message presents current hardware device status information"""

    header: Header = Header()
    """Header timestamp should be update time of device status"""
    device_id: str = ""
    """Unique identifier for the device, e.g. "base_motor", "gripper_joint_1"

    """
    hardware_status: Sequence[GenericHardwareState] = ()
    """--- Standard-Specific States --------------------------------------
    States populated based on the standards relevant to this device.
    A device will only fill the arrays for the standards it implements, rest will be empty

    Generic hardware status information applicable to any device, it is suggested to fill this for all devices
    """
    canopen_states: Sequence[CANopenState] = ()
    """CANopen-specific device states (DS-301/DS-402 compliant devices)"""
    ethercat_states: Sequence[EtherCATState] = ()
    """EtherCAT-specific device states (CoE, FoE, etc.)"""
    vda5050_states: Sequence[VDA5050State] = ()
    """VDA5050-specific states for AGV/mobile robot devices"""


class HardwareDiagnostics(Message, package="control_msgs"):
    """This message presents current hardware diagnostics"""

    header: Header = Header()
    """Header timestamp should be update time of device diagnostics"""
    hardware_id: str = ""
    """Unique identifier per hardware component, ideally the name of the hardware derived from HardwareInfo e.g.
    "pal_arm"

    """
    hardware_device_diagnostics: Sequence[HardwareDeviceDiagnostics] = ()
    """--- Device Diagnostics Aggregation ---------------------------------
    Diagnostics for individual devices within this hardware set
    """


class HardwareStatus(Message, package="control_msgs"):
    """This message presents current hardware component status information"""

    header: Header = Header()
    """Header timestamp should be update time of hardware status"""
    hardware_id: str = ""
    """Unique identifier per hardware component, ideally the name of the hardware derived from HardwareInfo e.g.
    "pal_arm"

    """
    hardware_device_states: Sequence[HardwareDeviceStatus] = ()
    """--- Device Status Aggregation ---------------------------------
    An array containing the status of individual devices in the hardware component
    """


class JointComponentTolerance(Message, package="control_msgs"):
    """Version of JointTolerance.msg with added component field for joints with multiple degrees of freedom
    The difference between two MultiDOFJointTrajectoryPoint cannot be represented as a single number,
    hence we use the component field to represent how to calculate the difference in a way that can
    be represented as a single number.
    """

    X_AXIS: ClassVar[uint16] = 1
    """Since each joint has multiple degrees of freedom,
    there can be multiple tolerances for each joint, each looking
    at different components.

    If the component is X_AXIS, Y_AXIS, or Z_AXIS, then the tolerance
    is only applied for the specific axis.
    However, if the component is TRANSLATION, then the tolerance is for
    the overall Euclidean distance.
    For these components, the units are meters, meters/sec and meters/sec^2.
    Z_AXIS is only valid with a floating joint, not planar.

    If the component is ROTATION the tolerance is measured in
    radians, radians/sec and radians/sec^2, computed
    between the difference in quaternions.
    """
    Y_AXIS: ClassVar[uint16] = 2
    Z_AXIS: ClassVar[uint16] = 3
    TRANSLATION: ClassVar[uint16] = 4
    ROTATION: ClassVar[uint16] = 5

    joint_name: str = ""
    component: uint16 = 0
    position: float64 = 0.0
    velocity: float64 = 0.0
    acceleration: float64 = 0.0


class JointControllerState(Message, package="control_msgs"):
    """This message presents current controller state of one joint."""

    header: Header = Header()
    """It is deprecated as of Humble in favor of SingleDOFStateStamped.msg

    Header timestamp should be update time of controller state
    """
    set_point: float64 = 0.0
    """The set point, that is, desired state."""
    process_value: float64 = 0.0
    """Current value of the process (ie: latest sensor measurement on the controlled value)."""
    process_value_dot: float64 = 0.0
    """First time-derivative of the process value."""
    error: float64 = 0.0
    """The error of the controlled value, essentially process_value - set_point (for a regular PID implementation)."""
    time_step: float64 = 0.0
    """Time between two consecutive updates/execution of the control law."""
    command: float64 = 0.0
    """Current output of the controller."""
    p: float64 = 0.0
    """Current PID parameters of the controller."""
    i: float64 = 0.0
    d: float64 = 0.0
    i_clamp: float64 = 0.0
    antiwindup: bool = False


class JointJog(Message, package="control_msgs"):
    """The message `control_msgs/msg/JointJog`."""

    header: Header = Header()
    """Used in time-stamping the message."""
    joint_names: Sequence[str] = ()
    """Name list of the joints. You don't need to specify all joints of the
    robot. Joint names are case-sensitive.
    """
    displacements: Float64Array = zeros()
    """A position command to the joints listed in joint_names.
    The order must be identical.
    Units are meters or radians.
    If displacements and velocities are filled, a profiled motion is requested.

    or position_deltas
    """
    velocities: Float64Array = zeros()
    """A velocity command to the joints listed in joint_names.
    The order must be identical.
    Units are m/s or rad/s.
    If displacements and velocities are filled, a profiled motion is requested.
    """
    duration: float64 = 0.0


class JointTolerance(Message, package="control_msgs"):
    """The tolerances specify the amount the position, velocity, and
    accelerations can vary from the setpoints.  For example, in the case
    of trajectory control, when the actual position varies beyond
    (desired position + position tolerance), the trajectory goal may
    abort.

    There are two special values for tolerances:
     * 0 - The tolerance is unspecified and will remain at whatever the default is
     * -1 - The tolerance is "erased".  If there was a default, the joint will be
            allowed to move without restriction.
    """

    name: str = ""
    position: float64 = 0.0
    """in radians or meters (for a revolute or prismatic joint, respectively)"""
    velocity: float64 = 0.0
    """in rad/sec or m/sec"""
    acceleration: float64 = 0.0
    """in rad/sec^2 or m/sec^2"""


class JointTrajectoryControllerState(Message, package="control_msgs"):
    """This message presents current controller state of JTC"""

    header: Header = Header()
    """Header timestamp should be update time of controller state"""
    joint_names: Sequence[str] = ()
    reference: JointTrajectoryPoint = JointTrajectoryPoint()
    """The set point, that is, desired state."""
    feedback: JointTrajectoryPoint = JointTrajectoryPoint()
    """Current value of the process (ie: latest sensor measurement on the controlled value)."""
    error: JointTrajectoryPoint = JointTrajectoryPoint()
    """The error of the controlled value, essentially reference - feedback (for a regular PID implementation)."""
    output: JointTrajectoryPoint = JointTrajectoryPoint()
    """Current output of the controller."""
    multi_dof_joint_names: Sequence[str] = ()
    multi_dof_reference: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
    """The set point, that is, desired state."""
    multi_dof_feedback: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
    """Current value of the process (ie: latest sensor measurement on the controlled value)."""
    multi_dof_error: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
    """The error of the controlled value, essentially reference - feedback (for a regular PID implementation)."""
    multi_dof_output: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
    """Current output of the controller."""
    speed_scaling_factor: float64 = 0.0
    """The speed scaling factor the trajectory is currently being executed with"""


class WrenchFramed(Message, package="control_msgs"):
    """This message represents a wrench (force and torque) expressed in a specific reference frame."""

    frame_id: str = ""
    """The reference frame in which the wrench is expressed."""
    wrench: Wrench = Wrench()
    """The wrench applied."""


class JointWrenchTrajectoryPoint(Message, package="control_msgs"):
    """The message `control_msgs/msg/JointWrenchTrajectoryPoint`."""

    point: JointTrajectoryPoint = JointTrajectoryPoint()
    """A joint-wrench trajectory point defines joint positions, joint velocities, joint accelerations, joint efforts,
    and a task space wrench, typically used by controllers.
    Note: The time_from_start field is included in the JointTrajectoryPoint.
    """
    wrench: WrenchFramed = WrenchFramed()
    """The task-space wrench to apply at this trajectory point."""


class JointWrenchTrajectory(Message, package="control_msgs"):
    """The message `control_msgs/msg/JointWrenchTrajectory`."""

    header: Header = Header()
    """The header is used to specify the reference time for the trajectory durations"""
    joint_names: Sequence[str] = ()
    """The names of the active joints in each trajectory point. These names are
    ordered and must correspond to the values in each trajectory point.
    """
    points: Sequence[JointWrenchTrajectoryPoint] = ()
    """Array of trajectory points, which describe the joint positions, velocities,
    accelerations and/or efforts, and task space wrenches at each time point.
    """


class Keys(Message, package="control_msgs"):
    """The message `control_msgs/msg/Keys`."""

    header: Header = Header()
    keys: Sequence[str] = ()
    """List of names defining interfaces or joints or other string-based entities
    being published with Keys.msg
    """


class MecanumDriveControllerState(Message, package="control_msgs"):
    """The message `control_msgs/msg/MecanumDriveControllerState`."""

    header: Header = Header()
    front_left_wheel_velocity: float64 = 0.0
    back_left_wheel_velocity: float64 = 0.0
    back_right_wheel_velocity: float64 = 0.0
    front_right_wheel_velocity: float64 = 0.0
    reference_velocity: Twist = Twist()


class MotionArgument(Message, package="control_msgs"):
    """Key Value pair to be used in MotionPrimitive messages"""

    name: str = ""
    value: float64 = 0.0


class MotionPrimitive(Message, package="control_msgs"):
    """The message `control_msgs/msg/MotionPrimitive`."""

    UNKNOWN: ClassVar[int8] = -1
    LINEAR_JOINT: ClassVar[int8] = 0
    """Often referred as PTP"""
    LINEAR_CARTESIAN: ClassVar[int8] = 50
    """Often referred as LIN"""
    CIRCULAR_CARTESIAN: ClassVar[int8] = 51
    """Often referred as CIRC"""

    type: int8 = -1
    """potentially more, such as spline motion

    one of the above
    """
    blend_radius: float64 = 0.0
    additional_arguments: Sequence[MotionArgument] = ()
    """MotionArguments are meant to be used as vendor-specific or use-case-specific arguments to
    MotionPrimitive messages. This is to avoid bloating the MotionPrimitive message with all possible
    uses cases but rather add specific data using as a list of key-value pairs, which is what this
    message represents.

    (max) velocity, (max) acceleration, efficiency
    """
    poses: Sequence[PoseStamped] = ()
    """Targets should be either specified through joint configurations or Cartesian poses.
    Depending on the motion type and implementation, there might be multiple poses allowed.
    For example, circular motions are often specified as via and target
    Usually one of these is empty, in some edge cases even both can be empty, when all input is given
    in the more flexible MotionArgument[] field.
    """
    joint_positions: Float64Array = zeros()


class MotionPrimitiveSequence(Message, package="control_msgs"):
    """The message `control_msgs/msg/MotionPrimitiveSequence`."""

    motions: Sequence[MotionPrimitive] = ()


class MultiDOFCommand(Message, package="control_msgs"):
    """The message defines command for multiple degrees of freedom (DoF) typically used by many controllers.
    The message intentionally avoids 'joint' nomenclature because it can be generally use for command with
    different semantic meanings, e.g., joints, Cartesian axes, or have abstract meaning like GPIO interface.
    """

    dof_names: Sequence[str] = ()
    """names of degrees of freedom"""
    values: Float64Array = zeros()
    """values used by most of the controller"""
    values_dot: Float64Array = zeros()
    """First derivation of the values, e.g., velocity if values are positions.
    This is useful for PID and similar controllers.
    """


class SingleDOFState(Message, package="control_msgs"):
    """This message presents current controller state of one degree of freedom."""

    name: str = ""
    """DoF name, e.g., joint or Cartesian axis name"""
    reference: float64 = 0.0
    """The set point, that is, desired state."""
    feedback: float64 = 0.0
    """Current value of the process (ie: latest sensor measurement on the controlled value)."""
    feedback_dot: float64 = 0.0
    """First time-derivative of the process value. E.g., velocity."""
    error: float64 = 0.0
    """The error of the controlled value, essentially reference - feedback (for a regular PID implementation)."""
    error_dot: float64 = 0.0
    """First time-derivative of the error of the controlled value."""
    time_step: float64 = 0.0
    """Time between two consecutive updates/execution of the control law."""
    output: float64 = 0.0
    """Current output of the controller."""


class MultiDOFStateStamped(Message, package="control_msgs"):
    """This message presents current controller state of multiple degrees of freedom."""

    header: Header = Header()
    """Header timestamp should be update time of controller state"""
    dof_states: Sequence[SingleDOFState] = ()


class PidState(Message, package="control_msgs"):
    """The message `control_msgs/msg/PidState`."""

    header: Header = Header()
    timestep: Duration = Duration()
    error: float64 = 0.0
    """error = target - state"""
    error_dot: float64 = 0.0
    """derivative of error"""
    i_term: float64 = 0.0
    """weighted integral of error"""
    p_gain: float64 = 0.0
    """proportional gain"""
    i_gain: float64 = 0.0
    """integral gain"""
    d_gain: float64 = 0.0
    """derivative gain"""
    output: float64 = 0.0
    """output of the PID controller"""


class SingleDOFStateStamped(Message, package="control_msgs"):
    """This message presents current controller state of one degree of freedom."""

    header: Header = Header()
    """Header timestamp should be update time of controller state"""
    dof_state: SingleDOFState = SingleDOFState()


class SpeedScalingFactor(Message, package="control_msgs"):
    """This message contains a scaling factor to scale trajectory execution. A factor of 1.0 means
    execution at normal speed, a factor of 0.0 means a full pause.
    Negative values are not allowed (Which should be checked by any instance consuming this message).
    """

    factor: float64 = 0.0


class SteeringControllerCommand(Message, package="control_msgs"):
    """The message `control_msgs/msg/SteeringControllerCommand`."""

    header: Header = Header()
    steering_angle: float64 = 0.0
    """in rad"""
    linear_velocity: float64 = 0.0
    """in m/s"""


class SteeringControllerStatus(Message, package="control_msgs"):
    """The message `control_msgs/msg/SteeringControllerStatus`."""

    header: Header = Header()
    traction_wheels_position: Float64Array = zeros()
    """positions of traction wheels if the robot is controlled by position"""
    traction_wheels_velocity: Float64Array = zeros()
    """velocities of traction wheels if the robot is controlled by velocity"""
    steer_positions: Float64Array = zeros()
    """positions of steering joints"""
    traction_command: Float64Array = zeros()
    """values commanded to traction joints"""
    steering_angle_command: Float64Array = zeros()
    """values commanded to steering joints"""


class VDA5050SafetyState(Message, package="control_msgs"):
    """The message `control_msgs/msg/VDA5050SafetyState`."""

    AUTO_ACK: ClassVar[string] = "autoAck"
    """Enums for eStop"""
    MANUAL: ClassVar[string] = "manual"
    REMOTE: ClassVar[string] = "remote"
    NONE: ClassVar[string] = "none"

    e_stop: str = ""
    """Enum {autoAck, manual, remote, none} Acknowledge-Type of eStop:
    autoAck: autoacknowledgeable e-stop is activated e.g. by bumper or protective field
    manual: e-stop has to be acknowledged manually at the vehicle
    remote: facility estop has to be acknowledged remotely
    none: no e-stop activated
    """
    field_violation: bool = False
    """Protective field violation. True: field is violated False: field is not violated"""


class QueryCalibrationState(ServiceType, package="control_msgs"):
    """The service `control_msgs/srv/QueryCalibrationState`."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        is_calibrated: bool = False


class QueryTrajectoryState(ServiceType, package="control_msgs"):
    """The service `control_msgs/srv/QueryTrajectoryState`."""

    class Request(Message):
        """The request."""

        time: Time = Time()

    class Response(Message):
        """The response."""

        success: bool = False
        """indicate successful run of triggered service"""
        message: str = ""
        """informational, e.g. for error messages"""
        name: Sequence[str] = ()
        position: Float64Array = zeros()
        velocity: Float64Array = zeros()
        acceleration: Float64Array = zeros()


class SetOdometry(ServiceType, package="control_msgs"):
    """The service `control_msgs/srv/SetOdometry`."""

    class Request(Message):
        """The request."""

        x: float64 = 0.0
        y: float64 = 0.0
        z: float64 = 0.0
        roll: float64 = 0.0
        pitch: float64 = 0.0
        yaw: float64 = 0.0

    class Response(Message):
        """The response."""

        success: bool = False
        message: str = ""


class ExecuteMotionPrimitiveSequence(ActionType, package="control_msgs"):
    """The action `control_msgs/action/ExecuteMotionPrimitiveSequence`."""

    class Goal(Message):
        """The goal."""

        trajectory: MotionPrimitiveSequence = MotionPrimitiveSequence()
        """A list of MotionPrimitive messages that are executed in sequence. They don't have to be of the
        same type, as long as the robot supports executing them one after another.
        """

    class Result(Message):
        """The result."""

        SUCCESSFUL: ClassVar[int32] = 0
        INVALID_GOAL: ClassVar[int32] = -1
        OLD_HEADER_TIMESTAMP: ClassVar[int32] = -3

        error_code: int32 = 0
        error_string: str = ""

    class Feedback(Message):
        """The feedback."""

        current_primitive_index: uint8 = 0
        """Index of the currently executed motion primitive in the sequence."""


class FollowJointTrajectory(ActionType, package="control_msgs"):
    """The action `control_msgs/action/FollowJointTrajectory`."""

    class Goal(Message):
        """The goal."""

        trajectory: trajectory_msgs.JointTrajectory = trajectory_msgs.JointTrajectory()
        """The trajectory for all revolute, continuous or prismatic joints"""
        multi_dof_trajectory: MultiDOFJointTrajectory = MultiDOFJointTrajectory()
        """The trajectory for all planar or floating joints (i.e. individual joints with more than one DOF)"""
        path_tolerance: Sequence[JointTolerance] = ()
        """Tolerances for the trajectory.  If the measured joint values fall
        outside the tolerances the trajectory goal is aborted.  Any
        tolerances that are not specified (by being omitted or set to 0) are
        set to the defaults for the action server (often taken from the
        parameter server).

        Tolerances applied to the joints as the trajectory is executed.  If
        violated, the goal aborts with error_code set to
        PATH_TOLERANCE_VIOLATED.
        """
        component_path_tolerance: Sequence[JointComponentTolerance] = ()
        goal_tolerance: Sequence[JointTolerance] = ()
        """To report success, the joints must be within goal_tolerance of the
        final trajectory value.  The goal must be achieved by time the
        trajectory ends plus goal_time_tolerance.  (goal_time_tolerance
        allows some leeway in time, so that the trajectory goal can still
        succeed even if the joints reach the goal some time after the
        precise end time of the trajectory).

        If the joints are not within goal_tolerance after "trajectory finish
        time" + goal_time_tolerance, the goal aborts with error_code set to
        GOAL_TOLERANCE_VIOLATED
        """
        component_goal_tolerance: Sequence[JointComponentTolerance] = ()
        goal_time_tolerance: Duration = Duration()

    class Result(Message):
        """The result."""

        SUCCESSFUL: ClassVar[int32] = 0
        INVALID_GOAL: ClassVar[int32] = -1
        INVALID_JOINTS: ClassVar[int32] = -2
        OLD_HEADER_TIMESTAMP: ClassVar[int32] = -3
        PATH_TOLERANCE_VIOLATED: ClassVar[int32] = -4
        GOAL_TOLERANCE_VIOLATED: ClassVar[int32] = -5

        error_code: int32 = 0
        error_string: str = ""
        """Human readable description of the error code. Contains complementary
        information that is especially useful when execution fails, for instance:
        - INVALID_GOAL: The reason for the invalid goal (e.g., the requested
          trajectory is in the past).
        - INVALID_JOINTS: The mismatch between the expected controller joints
          and those provided in the goal.
        - PATH_TOLERANCE_VIOLATED and GOAL_TOLERANCE_VIOLATED: Which joint
          violated which tolerance, and by how much.
        """

    class Feedback(Message):
        """The feedback."""

        header: Header = Header()
        joint_names: Sequence[str] = ()
        desired: JointTrajectoryPoint = JointTrajectoryPoint()
        actual: JointTrajectoryPoint = JointTrajectoryPoint()
        error: JointTrajectoryPoint = JointTrajectoryPoint()
        index: int32 = 0
        """the currently used point from trajectory.points array"""
        multi_dof_joint_names: Sequence[str] = ()
        multi_dof_desired: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
        multi_dof_actual: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
        multi_dof_error: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
        multi_dof_index: int32 = 0
        """the currently used point from multi_dof_trajectory.points array"""


class FollowJointWrenchTrajectory(ActionType, package="control_msgs"):
    """The action `control_msgs/action/FollowJointWrenchTrajectory`."""

    class Goal(Message):
        """The goal."""

        trajectory: JointWrenchTrajectory = JointWrenchTrajectory()
        """The joint trajectory to follow"""
        path_tolerance: Sequence[JointTolerance] = ()
        """Tolerances for the trajectory.  If the measured joint values fall
        outside the tolerances the trajectory goal is aborted.  Any
        tolerances that are not specified (by being omitted or set to 0) are
        set to the defaults for the action server (often taken from the
        parameter server).

        Tolerances applied to the joints as the trajectory is executed.  If
        violated, the goal aborts with error_code set to
        PATH_TOLERANCE_VIOLATED.
        """
        goal_tolerance: Sequence[JointTolerance] = ()
        """To report success, the joints must be within goal_tolerance of the
        final trajectory value.  The goal must be achieved by time the
        trajectory ends plus goal_time_tolerance.  (goal_time_tolerance
        allows some leeway in time, so that the trajectory goal can still
        succeed even if the joints reach the goal some time after the
        precise end time of the trajectory).

        If the joints are not within goal_tolerance after "trajectory finish
        time" + goal_time_tolerance, the goal aborts with error_code set to
        GOAL_TOLERANCE_VIOLATED
        """
        goal_time_tolerance: Duration = Duration()

    class Result(Message):
        """The result."""

        SUCCESSFUL: ClassVar[int32] = 0
        INVALID_GOAL: ClassVar[int32] = -1
        INVALID_JOINTS: ClassVar[int32] = -2
        OLD_HEADER_TIMESTAMP: ClassVar[int32] = -3
        PATH_TOLERANCE_VIOLATED: ClassVar[int32] = -4
        GOAL_TOLERANCE_VIOLATED: ClassVar[int32] = -5
        TRAJECTORY_ABORTED: ClassVar[int32] = -6

        error_code: int32 = 0
        error_string: str = ""
        """Human readable description of the error code. Contains complementary
        information that is especially useful when execution fails, for instance:
        - INVALID_GOAL: The reason for the invalid goal (e.g., the requested
          trajectory requires a command that differ significantly from the
          robot's current state).
        - INVALID_JOINTS: The mismatch between the expected controller joints
          and those provided in the goal.
        - PATH_TOLERANCE_VIOLATED and GOAL_TOLERANCE_VIOLATED: Which joint
          violated which tolerance, and by how much.
        - TRAJECTORY_ABORTED: Indicates that the trajectory was aborted during
          execution (e.g., another trajectory was sent for execution, or a
          problem occurred).
        """

    class Feedback(Message):
        """The feedback."""

        header: Header = Header()
        joint_names: Sequence[str] = ()
        desired: JointWrenchTrajectoryPoint = JointWrenchTrajectoryPoint()
        actual: JointWrenchTrajectoryPoint = JointWrenchTrajectoryPoint()
        error: JointWrenchTrajectoryPoint = JointWrenchTrajectoryPoint()
        index: int32 = 0
        """the currently used point from trajectory.points array"""


class JointTrajectory(ActionType, package="control_msgs"):
    """The action `control_msgs/action/JointTrajectory`."""

    class Goal(Message):
        """The goal."""

        trajectory: trajectory_msgs.JointTrajectory = trajectory_msgs.JointTrajectory()

    class Result(Message):
        """The result."""

    class Feedback(Message):
        """The feedback."""


class ParallelGripperCommand(ActionType, package="control_msgs"):
    """name: the name(s) of the joint this command is requesting
    position: desired position of each gripper joint (radians or meters)
    velocity: (optional, not used if empty) max velocity of the joint allowed while moving (radians or meters / second)
    effort: (optional, not used if empty) max effort of the joint allowed while moving (Newtons or Newton-meters)
    """

    class Goal(Message):
        """The goal."""

        command: JointState = JointState()
        """Parallel grippers refer to an end effector where two opposing fingers grasp an object from opposite sides."""

    class Result(Message):
        """The result."""

        state: JointState = JointState()
        """The current gripper state."""
        stalled: bool = False
        """position of each joint (radians or meters)
        optional: velocity of each joint (radians or meters / second)
        optional: effort of each joint (Newtons or Newton-meters)

        True if the gripper is exerting max effort and not moving
        """
        reached_goal: bool = False
        """True if the gripper position has reached the commanded setpoint"""

    class Feedback(Message):
        """position of each joint (radians or meters)
        optional: velocity of each joint (radians or meters / second)
        optional: effort of each joint (Newtons or Newton-meters)
        """

        state: JointState = JointState()
        """The current gripper state."""


class PointHead(ActionType, package="control_msgs"):
    """The action `control_msgs/action/PointHead`."""

    class Goal(Message):
        """The goal."""

        target: PointStamped = PointStamped()
        pointing_axis: Vector3 = Vector3()
        pointing_frame: str = ""
        min_duration: Duration = Duration()
        max_velocity: float64 = 0.0

    class Result(Message):
        """The result."""

    class Feedback(Message):
        """The feedback."""

        pointing_angle_error: float64 = 0.0


class SingleJointPosition(ActionType, package="control_msgs"):
    """The action `control_msgs/action/SingleJointPosition`."""

    class Goal(Message):
        """The goal."""

        position: float64 = 0.0
        min_duration: Duration = Duration()
        max_velocity: float64 = 0.0

    class Result(Message):
        """The result."""

    class Feedback(Message):
        """The feedback."""

        header: Header = Header()
        position: float64 = 0.0
        velocity: float64 = 0.0
        error: float64 = 0.0


class action:
    """Types whose names other types of `control_msgs` have too."""

    class GripperCommand(ActionType, package="control_msgs"):
        """The action `control_msgs/action/GripperCommand`."""

        class Goal(Message):
            """The goal."""

            command: GripperCommand = GripperCommand()

        class Result(Message):
            """The result."""

            position: float64 = 0.0
            """The current gripper gap size (in meters)"""
            effort: float64 = 0.0
            """The current effort exerted (in Newtons)"""
            stalled: bool = False
            """True iff the gripper is exerting max effort and not moving"""
            reached_goal: bool = False
            """True iff the gripper position has reached the commanded setpoint"""

        class Feedback(Message):
            """The feedback."""

            position: float64 = 0.0
            """The current gripper gap size (in meters)"""
            effort: float64 = 0.0
            """The current effort exerted (in Newtons)"""
            stalled: bool = False
            """True iff the gripper is exerting max effort and not moving"""
            reached_goal: bool = False
            """True iff the gripper position has reached the commanded setpoint"""
