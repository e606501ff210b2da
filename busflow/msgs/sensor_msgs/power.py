"""Batteries."""

from typing import ClassVar

from busflow.interfaces.message import Float32Array, Message, float32, uint8, zeros
from busflow.msgs.std_msgs import Header


class BatteryState(Message, package="sensor_msgs"):
    """The state of a battery. What is not measured is NaN; the constants are those of Linux's power supplies."""

    POWER_SUPPLY_STATUS_UNKNOWN: ClassVar[uint8] = 0
    POWER_SUPPLY_STATUS_CHARGING: ClassVar[uint8] = 1
    POWER_SUPPLY_STATUS_DISCHARGING: ClassVar[uint8] = 2
    POWER_SUPPLY_STATUS_NOT_CHARGING: ClassVar[uint8] = 3
    POWER_SUPPLY_STATUS_FULL: ClassVar[uint8] = 4

    POWER_SUPPLY_HEALTH_UNKNOWN: ClassVar[uint8] = 0
    POWER_SUPPLY_HEALTH_GOOD: ClassVar[uint8] = 1
    POWER_SUPPLY_HEALTH_OVERHEAT: ClassVar[uint8] = 2
    POWER_SUPPLY_HEALTH_DEAD: ClassVar[uint8] = 3
    POWER_SUPPLY_HEALTH_OVERVOLTAGE: ClassVar[uint8] = 4
    POWER_SUPPLY_HEALTH_UNSPEC_FAILURE: ClassVar[uint8] = 5
    POWER_SUPPLY_HEALTH_COLD: ClassVar[uint8] = 6
    POWER_SUPPLY_HEALTH_WATCHDOG_TIMER_EXPIRE: ClassVar[uint8] = 7
    POWER_SUPPLY_HEALTH_SAFETY_TIMER_EXPIRE: ClassVar[uint8] = 8

    POWER_SUPPLY_TECHNOLOGY_UNKNOWN: ClassVar[uint8] = 0
    POWER_SUPPLY_TECHNOLOGY_NIMH: ClassVar[uint8] = 1  # nickel and metal hydride
    POWER_SUPPLY_TECHNOLOGY_LION: ClassVar[uint8] = 2  # lithium ions
    POWER_SUPPLY_TECHNOLOGY_LIPO: ClassVar[uint8] = 3  # lithium in a polymer
    POWER_SUPPLY_TECHNOLOGY_LIFE: ClassVar[uint8] = 4  # lithium and iron phosphate
    POWER_SUPPLY_TECHNOLOGY_NICD: ClassVar[uint8] = 5  # nickel and cadmium
    POWER_SUPPLY_TECHNOLOGY_LIMN: ClassVar[uint8] = 6  # lithium and manganese dioxide
    POWER_SUPPLY_TECHNOLOGY_TERNARY: ClassVar[uint8] = 7  # lithium and three metals
    POWER_SUPPLY_TECHNOLOGY_VRLA: ClassVar[uint8] = 8  # lead and acid, sealed with a valve

    header: Header = Header()
    voltage: float32 = 0.0
    """V; always measured."""
    temperature: float32 = 0.0
    """°C."""
    current: float32 = 0.0
    """A; negative while the battery is being emptied."""
    charge: float32 = 0.0
    """What is in it, A·h."""
    capacity: float32 = 0.0
    """What was in it when it was last full, A·h."""
    design_capacity: float32 = 0.0
    """What it was made to hold, A·h."""
    percentage: float32 = 0.0
    """How full it is, 0 to 1."""
    power_supply_status: uint8 = 0
    power_supply_health: uint8 = 0
    power_supply_technology: uint8 = 0
    present: bool = False
    """Whether there is a battery at all."""
    cell_voltage: Float32Array = zeros()
    """V, each cell; as many NaN as there are cells where only their number is known."""
    cell_temperature: Float32Array = zeros()
    """°C, each cell; as many NaN as there are cells where only their number is known."""
    location: str = ""
    """The slot or plug it is in."""
    serial_number: str = ""
