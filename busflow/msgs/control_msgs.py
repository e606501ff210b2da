"""`control_msgs`: 38 messages, 3 services, 8 actions, from its definition files."""

# busflow interface generate control_msgs --to busflow/msgs
# wrote this from control_msgs 6.8.0 (BSD-3-Clause). The comments of its files are left out. The files:
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
from busflow.msgs import export_types, trajectory_msgs
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


class AdmittanceControllerState(Message, package="control_msgs"):
    """The message `control_msgs/msg/AdmittanceControllerState`."""

    mass: Float64MultiArray = Float64MultiArray()
    damping: Float64MultiArray = Float64MultiArray()
    stiffness: Float64MultiArray = Float64MultiArray()
    rot_base_control: Quaternion = Quaternion()
    ref_trans_base_ft: TransformStamped = TransformStamped()
    selected_axes: Int8MultiArray = Int8MultiArray()
    ft_sensor_frame: String = String()
    admittance_position: TransformStamped = TransformStamped()
    admittance_acceleration: TwistStamped = TwistStamped()
    admittance_velocity: TwistStamped = TwistStamped()
    wrench_base: WrenchStamped = WrenchStamped()
    joint_state: JointState = JointState()


class BatteryStateArray(Message, package="control_msgs"):
    """The message `control_msgs/msg/BatteryStateArray`."""

    battery_states: Sequence[BatteryState] = ()


class CANopenState(Message, package="control_msgs"):
    """The message `control_msgs/msg/CANopenState`."""

    NMT_INITIALISING: ClassVar[uint8] = 0
    NMT_PRE_OPERATIONAL: ClassVar[uint8] = 127
    NMT_OPERATIONAL: ClassVar[uint8] = 5
    NMT_STOPPED: ClassVar[uint8] = 4
    DSP402_NOT_READY_TO_SWITCH_ON: ClassVar[uint8] = 0
    DSP402_SWITCH_ON_DISABLED: ClassVar[uint8] = 1
    DSP402_READY_TO_SWITCH_ON: ClassVar[uint8] = 2
    DSP402_SWITCHED_ON: ClassVar[uint8] = 3
    DSP402_OPERATION_ENABLED: ClassVar[uint8] = 4
    DSP402_QUICK_STOP_ACTIVE: ClassVar[uint8] = 5
    DSP402_FAULT_REACTION_ACTIVE: ClassVar[uint8] = 6
    DSP402_FAULT: ClassVar[uint8] = 7

    node_id: uint8 = 0
    nmt_state: uint8 = 0
    dsp_402_state: uint8 = 0
    last_emcy_code: uint32 = 0


class InterfaceValue(Message, package="control_msgs"):
    """The message `control_msgs/msg/InterfaceValue`."""

    interface_names: Sequence[str] = ()
    values: Float64Array = zeros()


class DynamicInterfaceGroupValues(Message, package="control_msgs"):
    """The message `control_msgs/msg/DynamicInterfaceGroupValues`."""

    header: Header = Header()
    interface_groups: Sequence[str] = ()
    interface_values: Sequence[InterfaceValue] = ()


class DynamicInterfaceValues(Message, package="control_msgs"):
    """The message `control_msgs/msg/DynamicInterfaceValues`."""

    header: Header = Header()
    states: InterfaceValue = InterfaceValue()
    commands: InterfaceValue = InterfaceValue()


class DynamicJointState(Message, package="control_msgs"):
    """The message `control_msgs/msg/DynamicJointState`."""

    header: Header = Header()
    joint_names: Sequence[str] = ()
    interface_values: Sequence[InterfaceValue] = ()


class EtherCATState(Message, package="control_msgs"):
    """The message `control_msgs/msg/EtherCATState`."""

    AL_STATE_INIT: ClassVar[uint8] = 1
    AL_STATE_PREOP: ClassVar[uint8] = 2
    AL_STATE_BOOTSTRAP: ClassVar[uint8] = 3
    AL_STATE_SAFEOP: ClassVar[uint8] = 4
    AL_STATE_OP: ClassVar[uint8] = 8

    slave_position: uint16 = 0
    vendor_id: str = ""
    product_code: str = ""
    al_state: uint8 = 0
    has_error: bool = False
    al_status_code: uint16 = 0


class Float64Values(Message, package="control_msgs"):
    """The message `control_msgs/msg/Float64Values`."""

    header: Header = Header()
    values: Float64Array = zeros()


class GenericHardwareState(Message, package="control_msgs"):
    """The message `control_msgs/msg/GenericHardwareState`."""

    HEALTH_UNKNOWN: ClassVar[uint8] = 0
    HEALTH_OK: ClassVar[uint8] = 1
    HEALTH_DEGRADED: ClassVar[uint8] = 2
    HEALTH_WARNING: ClassVar[uint8] = 3
    HEALTH_ERROR: ClassVar[uint8] = 4
    HEALTH_FATAL: ClassVar[uint8] = 5
    ERROR_NONE: ClassVar[uint8] = 0
    ERROR_UNKNOWN: ClassVar[uint8] = 1
    ERROR_HW: ClassVar[uint8] = 2
    ERROR_SW: ClassVar[uint8] = 3
    ERROR_OVER_TRAVEL: ClassVar[uint8] = 4
    EMERGENCY_STOP_HW: ClassVar[uint8] = 5
    EMERGENCY_STOP_SW: ClassVar[uint8] = 6
    PROTECTIVE_STOP_HW: ClassVar[uint8] = 7
    PROTECTIVE_STOP_SW: ClassVar[uint8] = 8
    SAFETY_STOP: ClassVar[uint8] = 9
    CALIBRATION_REQUIRED: ClassVar[uint8] = 10
    MODE_UNKNOWN: ClassVar[uint8] = 0
    MODE_MANUAL: ClassVar[uint8] = 1
    MODE_AUTO: ClassVar[uint8] = 2
    MODE_SAFE: ClassVar[uint8] = 3
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
    POWER_OFF: ClassVar[uint8] = 1
    POWER_STANDBY: ClassVar[uint8] = 2
    POWER_ON: ClassVar[uint8] = 3
    POWER_SLEEP: ClassVar[uint8] = 4
    POWER_ERROR: ClassVar[uint8] = 5
    POWER_LEVEL_LOW: ClassVar[uint8] = 6
    POWER_LEVEL_CRITICAL: ClassVar[uint8] = 7
    POWER_CHARGING: ClassVar[uint8] = 8
    POWER_CHARGING_ERROR: ClassVar[uint8] = 9
    CONNECT_UNKNOWN: ClassVar[uint8] = 0
    CONNECT_UP: ClassVar[uint8] = 1
    CONNECT_DOWN: ClassVar[uint8] = 2
    CONNECT_FAILURE: ClassVar[uint8] = 3
    CONNECTION_SLOW: ClassVar[uint8] = 4

    health_status: uint8 = 0
    error_domain: UInt8Array = zeros()
    operational_mode: uint8 = 0
    power_state: uint8 = 0
    connectivity_status: uint8 = 0
    manufacturer: str = ""
    model: str = ""
    firmware_version: str = ""
    state_details: Sequence[KeyValue] = ()


class GripperCommand(Message, package="control_msgs"):
    """The message `control_msgs/msg/GripperCommand`."""

    position: float64 = 0.0
    max_effort: float64 = 0.0


class HardwareDeviceDiagnostics(Message, package="control_msgs"):
    """The message `control_msgs/msg/HardwareDeviceDiagnostics`."""

    header: Header = Header()
    device_id: str = ""
    entries: Sequence[KeyValue] = ()


class VDA5050State(Message, package="control_msgs"):
    """The message `control_msgs/msg/VDA5050State`."""

    ACTION_WAITING: ClassVar[string] = "WAITING"
    ACTION_INITIALIZING: ClassVar[string] = "INITIALIZING"
    ACTION_RUNNING: ClassVar[string] = "RUNNING"
    ACTION_PAUSED: ClassVar[string] = "PAUSED"
    ACTION_FINISHED: ClassVar[string] = "FINISHED"
    ACTION_FAILED: ClassVar[string] = "FAILED"
    MODE_AUTOMATIC: ClassVar[string] = "AUTOMATIC"
    MODE_SEMI_AUTOMATIC: ClassVar[string] = "SEMIAUTOMATIC"
    MODE_MANUAL: ClassVar[string] = "MANUAL"
    MODE_SERVICE: ClassVar[string] = "SERVICE"
    MODE_EMERGENCY: ClassVar[string] = "EMERGENCY"
    MODE_TEACHIN: ClassVar[string] = "TEACHIN"

    order_id: str = ""
    action_status: str = ""
    last_node_id: uint32 = 0
    driving: bool = False
    battery_charge: float64 = 0.0
    operating_mode: str = ""
    error_type: str = ""
    error_description: str = ""


class HardwareDeviceStatus(Message, package="control_msgs"):
    """The message `control_msgs/msg/HardwareDeviceStatus`."""

    header: Header = Header()
    device_id: str = ""
    hardware_status: Sequence[GenericHardwareState] = ()
    canopen_states: Sequence[CANopenState] = ()
    ethercat_states: Sequence[EtherCATState] = ()
    vda5050_states: Sequence[VDA5050State] = ()


class HardwareDiagnostics(Message, package="control_msgs"):
    """The message `control_msgs/msg/HardwareDiagnostics`."""

    header: Header = Header()
    hardware_id: str = ""
    hardware_device_diagnostics: Sequence[HardwareDeviceDiagnostics] = ()


class HardwareStatus(Message, package="control_msgs"):
    """The message `control_msgs/msg/HardwareStatus`."""

    header: Header = Header()
    hardware_id: str = ""
    hardware_device_states: Sequence[HardwareDeviceStatus] = ()


class JointComponentTolerance(Message, package="control_msgs"):
    """The message `control_msgs/msg/JointComponentTolerance`."""

    X_AXIS: ClassVar[uint16] = 1
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
    """The message `control_msgs/msg/JointControllerState`."""

    header: Header = Header()
    set_point: float64 = 0.0
    process_value: float64 = 0.0
    process_value_dot: float64 = 0.0
    error: float64 = 0.0
    time_step: float64 = 0.0
    command: float64 = 0.0
    p: float64 = 0.0
    i: float64 = 0.0
    d: float64 = 0.0
    i_clamp: float64 = 0.0
    antiwindup: bool = False


class JointJog(Message, package="control_msgs"):
    """The message `control_msgs/msg/JointJog`."""

    header: Header = Header()
    joint_names: Sequence[str] = ()
    displacements: Float64Array = zeros()
    velocities: Float64Array = zeros()
    duration: float64 = 0.0


class JointTolerance(Message, package="control_msgs"):
    """The message `control_msgs/msg/JointTolerance`."""

    name: str = ""
    position: float64 = 0.0
    velocity: float64 = 0.0
    acceleration: float64 = 0.0


class JointTrajectoryControllerState(Message, package="control_msgs"):
    """The message `control_msgs/msg/JointTrajectoryControllerState`."""

    header: Header = Header()
    joint_names: Sequence[str] = ()
    reference: JointTrajectoryPoint = JointTrajectoryPoint()
    feedback: JointTrajectoryPoint = JointTrajectoryPoint()
    error: JointTrajectoryPoint = JointTrajectoryPoint()
    output: JointTrajectoryPoint = JointTrajectoryPoint()
    multi_dof_joint_names: Sequence[str] = ()
    multi_dof_reference: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
    multi_dof_feedback: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
    multi_dof_error: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
    multi_dof_output: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
    speed_scaling_factor: float64 = 0.0


class WrenchFramed(Message, package="control_msgs"):
    """The message `control_msgs/msg/WrenchFramed`."""

    frame_id: str = ""
    wrench: Wrench = Wrench()


class JointWrenchTrajectoryPoint(Message, package="control_msgs"):
    """The message `control_msgs/msg/JointWrenchTrajectoryPoint`."""

    point: JointTrajectoryPoint = JointTrajectoryPoint()
    wrench: WrenchFramed = WrenchFramed()


class JointWrenchTrajectory(Message, package="control_msgs"):
    """The message `control_msgs/msg/JointWrenchTrajectory`."""

    header: Header = Header()
    joint_names: Sequence[str] = ()
    points: Sequence[JointWrenchTrajectoryPoint] = ()


class Keys(Message, package="control_msgs"):
    """The message `control_msgs/msg/Keys`."""

    header: Header = Header()
    keys: Sequence[str] = ()


class MecanumDriveControllerState(Message, package="control_msgs"):
    """The message `control_msgs/msg/MecanumDriveControllerState`."""

    header: Header = Header()
    front_left_wheel_velocity: float64 = 0.0
    back_left_wheel_velocity: float64 = 0.0
    back_right_wheel_velocity: float64 = 0.0
    front_right_wheel_velocity: float64 = 0.0
    reference_velocity: Twist = Twist()


class MotionArgument(Message, package="control_msgs"):
    """The message `control_msgs/msg/MotionArgument`."""

    name: str = ""
    value: float64 = 0.0


class MotionPrimitive(Message, package="control_msgs"):
    """The message `control_msgs/msg/MotionPrimitive`."""

    UNKNOWN: ClassVar[int8] = -1
    LINEAR_JOINT: ClassVar[int8] = 0
    LINEAR_CARTESIAN: ClassVar[int8] = 50
    CIRCULAR_CARTESIAN: ClassVar[int8] = 51

    type: int8 = -1
    blend_radius: float64 = 0.0
    additional_arguments: Sequence[MotionArgument] = ()
    poses: Sequence[PoseStamped] = ()
    joint_positions: Float64Array = zeros()


class MotionPrimitiveSequence(Message, package="control_msgs"):
    """The message `control_msgs/msg/MotionPrimitiveSequence`."""

    motions: Sequence[MotionPrimitive] = ()


class MultiDOFCommand(Message, package="control_msgs"):
    """The message `control_msgs/msg/MultiDOFCommand`."""

    dof_names: Sequence[str] = ()
    values: Float64Array = zeros()
    values_dot: Float64Array = zeros()


class SingleDOFState(Message, package="control_msgs"):
    """The message `control_msgs/msg/SingleDOFState`."""

    name: str = ""
    reference: float64 = 0.0
    feedback: float64 = 0.0
    feedback_dot: float64 = 0.0
    error: float64 = 0.0
    error_dot: float64 = 0.0
    time_step: float64 = 0.0
    output: float64 = 0.0


class MultiDOFStateStamped(Message, package="control_msgs"):
    """The message `control_msgs/msg/MultiDOFStateStamped`."""

    header: Header = Header()
    dof_states: Sequence[SingleDOFState] = ()


class PidState(Message, package="control_msgs"):
    """The message `control_msgs/msg/PidState`."""

    header: Header = Header()
    timestep: Duration = Duration()
    error: float64 = 0.0
    error_dot: float64 = 0.0
    i_term: float64 = 0.0
    p_gain: float64 = 0.0
    i_gain: float64 = 0.0
    d_gain: float64 = 0.0
    output: float64 = 0.0


class SingleDOFStateStamped(Message, package="control_msgs"):
    """The message `control_msgs/msg/SingleDOFStateStamped`."""

    header: Header = Header()
    dof_state: SingleDOFState = SingleDOFState()


class SpeedScalingFactor(Message, package="control_msgs"):
    """The message `control_msgs/msg/SpeedScalingFactor`."""

    factor: float64 = 0.0


class SteeringControllerCommand(Message, package="control_msgs"):
    """The message `control_msgs/msg/SteeringControllerCommand`."""

    header: Header = Header()
    steering_angle: float64 = 0.0
    linear_velocity: float64 = 0.0


class SteeringControllerStatus(Message, package="control_msgs"):
    """The message `control_msgs/msg/SteeringControllerStatus`."""

    header: Header = Header()
    traction_wheels_position: Float64Array = zeros()
    traction_wheels_velocity: Float64Array = zeros()
    steer_positions: Float64Array = zeros()
    traction_command: Float64Array = zeros()
    steering_angle_command: Float64Array = zeros()


class VDA5050SafetyState(Message, package="control_msgs"):
    """The message `control_msgs/msg/VDA5050SafetyState`."""

    AUTO_ACK: ClassVar[string] = "autoAck"
    MANUAL: ClassVar[string] = "manual"
    REMOTE: ClassVar[string] = "remote"
    NONE: ClassVar[string] = "none"

    e_stop: str = ""
    field_violation: bool = False


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
        message: str = ""
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


class FollowJointTrajectory(ActionType, package="control_msgs"):
    """The action `control_msgs/action/FollowJointTrajectory`."""

    class Goal(Message):
        """The goal."""

        trajectory: trajectory_msgs.JointTrajectory = trajectory_msgs.JointTrajectory()
        multi_dof_trajectory: MultiDOFJointTrajectory = MultiDOFJointTrajectory()
        path_tolerance: Sequence[JointTolerance] = ()
        component_path_tolerance: Sequence[JointComponentTolerance] = ()
        goal_tolerance: Sequence[JointTolerance] = ()
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

    class Feedback(Message):
        """The feedback."""

        header: Header = Header()
        joint_names: Sequence[str] = ()
        desired: JointTrajectoryPoint = JointTrajectoryPoint()
        actual: JointTrajectoryPoint = JointTrajectoryPoint()
        error: JointTrajectoryPoint = JointTrajectoryPoint()
        index: int32 = 0
        multi_dof_joint_names: Sequence[str] = ()
        multi_dof_desired: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
        multi_dof_actual: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
        multi_dof_error: MultiDOFJointTrajectoryPoint = MultiDOFJointTrajectoryPoint()
        multi_dof_index: int32 = 0


class FollowJointWrenchTrajectory(ActionType, package="control_msgs"):
    """The action `control_msgs/action/FollowJointWrenchTrajectory`."""

    class Goal(Message):
        """The goal."""

        trajectory: JointWrenchTrajectory = JointWrenchTrajectory()
        path_tolerance: Sequence[JointTolerance] = ()
        goal_tolerance: Sequence[JointTolerance] = ()
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

    class Feedback(Message):
        """The feedback."""

        header: Header = Header()
        joint_names: Sequence[str] = ()
        desired: JointWrenchTrajectoryPoint = JointWrenchTrajectoryPoint()
        actual: JointWrenchTrajectoryPoint = JointWrenchTrajectoryPoint()
        error: JointWrenchTrajectoryPoint = JointWrenchTrajectoryPoint()
        index: int32 = 0


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
    """The action `control_msgs/action/ParallelGripperCommand`."""

    class Goal(Message):
        """The goal."""

        command: JointState = JointState()

    class Result(Message):
        """The result."""

        state: JointState = JointState()
        stalled: bool = False
        reached_goal: bool = False

    class Feedback(Message):
        """The feedback."""

        state: JointState = JointState()


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
            effort: float64 = 0.0
            stalled: bool = False
            reached_goal: bool = False

        class Feedback(Message):
            """The feedback."""

            position: float64 = 0.0
            effort: float64 = 0.0
            stalled: bool = False
            reached_goal: bool = False


export_types(globals())
