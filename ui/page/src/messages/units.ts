/** Units of the fields of ROS's standard messages. */

import type { Path } from "./paths";
import type { Shape } from "./shapes";

// Key: message type and field. The last field of a path that has an entry decides: what is below it has the same unit.
const UNITS: Readonly<Record<string, string>> = {
  "sensor_msgs/Imu.linear_acceleration": "m/s²",
  "sensor_msgs/Imu.angular_velocity": "rad/s",
  "sensor_msgs/JointState.position": "rad",
  "sensor_msgs/JointState.velocity": "rad/s",
  "sensor_msgs/JointState.effort": "N·m",
  "sensor_msgs/BatteryState.voltage": "V",
  "sensor_msgs/BatteryState.cell_voltage": "V",
  "sensor_msgs/BatteryState.temperature": "°C",
  "sensor_msgs/BatteryState.cell_temperature": "°C",
  "sensor_msgs/BatteryState.current": "A",
  "sensor_msgs/BatteryState.charge": "Ah",
  "sensor_msgs/BatteryState.capacity": "Ah",
  "sensor_msgs/BatteryState.design_capacity": "Ah",
  "sensor_msgs/Range.field_of_view": "rad",
  "sensor_msgs/Range.min_range": "m",
  "sensor_msgs/Range.max_range": "m",
  "sensor_msgs/Range.range": "m",
  "sensor_msgs/LaserScan.angle_min": "rad",
  "sensor_msgs/LaserScan.angle_max": "rad",
  "sensor_msgs/LaserScan.angle_increment": "rad",
  "sensor_msgs/LaserScan.time_increment": "s",
  "sensor_msgs/LaserScan.scan_time": "s",
  "sensor_msgs/LaserScan.range_min": "m",
  "sensor_msgs/LaserScan.range_max": "m",
  "sensor_msgs/LaserScan.ranges": "m",
  "sensor_msgs/Temperature.temperature": "°C",
  "sensor_msgs/FluidPressure.fluid_pressure": "Pa",
  "sensor_msgs/Illuminance.illuminance": "lx",
  "sensor_msgs/MagneticField.magnetic_field": "T",
  "sensor_msgs/NavSatFix.latitude": "°",
  "sensor_msgs/NavSatFix.longitude": "°",
  "sensor_msgs/NavSatFix.altitude": "m",
  "geometry_msgs/Twist.linear": "m/s",
  "geometry_msgs/Twist.angular": "rad/s",
  "geometry_msgs/Accel.linear": "m/s²",
  "geometry_msgs/Accel.angular": "rad/s²",
  "geometry_msgs/Wrench.force": "N",
  "geometry_msgs/Wrench.torque": "N·m",
  "geometry_msgs/Pose.position": "m",
  "geometry_msgs/Pose2D.x": "m",
  "geometry_msgs/Pose2D.y": "m",
  "geometry_msgs/Pose2D.theta": "rad",
  "geometry_msgs/Transform.translation": "m",
  "geometry_msgs/PointStamped.point": "m",
  "trajectory_msgs/JointTrajectoryPoint.positions": "rad",
  "trajectory_msgs/JointTrajectoryPoint.velocities": "rad/s",
  "trajectory_msgs/JointTrajectoryPoint.accelerations": "rad/s²",
  "trajectory_msgs/JointTrajectoryPoint.effort": "N·m",
  "time.sec": "s",
  "time.nanosec": "ns",
  "duration.sec": "s",
  "duration.nanosec": "ns",
};

/** Returns the unit of the value at a path; undefined if it is not known. */
export function unitAt(path: Path, shape: Shape): string | undefined {
  let unit: string | undefined;
  let at: Shape | undefined = shape;
  for (const step of path) {
    if (typeof step !== "string") continue; // an item has the unit of its array
    unit = UNITS[`${at.type}.${step}`] ?? unit;
    at = at.fields?.get(step);
    if (at === undefined) return unit;
  }
  return unit;
}
