"""The humanoid's body: MuJoCo computes how it moves, and this module says what its joints, feet and IMU feel.

Nothing here knows of nodes or topics; `humanoid_simulator` does.
"""

import re
from collections.abc import Sequence
from importlib import import_module
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

SENSORS = (
    "acceleration",
    "rotation",
    "orientation",
    "left_force",
    "left_torque",
    "right_force",
    "right_torque",
)
"""The sensors that a model file must have."""


def mujoco() -> Any:
    """The physics engine, imported when the first body is made: that takes a third of a second. It has no types."""
    try:
        return import_module("mujoco")
    except ModuleNotFoundError as error:
        if error.name != "mujoco":
            raise
        raise ValueError("MuJoCo is not installed; in a clone of busflow: pip install '.[sim]'") from None


def read_model(file: Path) -> Any:
    """Read a model file and return MuJoCo's model of it.

    Raises:
        ValueError: It is missing or broken; the text has the file and, if MuJoCo knows it, the line.
    """
    engine = mujoco()
    if not file.is_file():
        raise ValueError(f"there is no model file {file}")
    try:
        model = engine.MjModel.from_xml_path(str(file))
    except ValueError as error:
        reason = " ".join(str(error).split())
        line = re.search(r"\bline(?: number=| )(\d+)", reason, re.IGNORECASE)
        raise ValueError(f"{file}{f':{line[1]}' if line else ''}: {reason}") from None
    sensors = {model.sensor(each).name for each in range(model.nsensor)}
    if missing := [each for each in SENSORS if each not in sensors]:
        raise ValueError(f"{file}: the model has no sensor {', '.join(missing)}")
    if "floor" not in {model.geom(each).name for each in range(model.ngeom)}:
        raise ValueError(f"{file}: the model has no geom floor")
    if model.njnt == 0 or model.joint(0).type[0] != engine.mjtJoint.mjJNT_FREE:
        raise ValueError(f"{file}: the first joint of the model must be free: a pelvis that nothing holds")
    return model


class Body:
    """A pelvis that nothing holds, and all that hangs from it by joints with motors that turn to a given angle."""

    def __init__(self, file: Path) -> None:
        self.engine, self.model = mujoco(), read_model(file)
        self.engine.set_mju_user_warning(unwritten)
        self.data = self.engine.MjData(self.model)
        self.longest_step_s: float = self.model.opt.timestep
        self.pelvis = int(self.model.jnt_bodyid[0])
        self.masses, self.inertias = self.model.body_mass.copy(), self.model.body_inertia.copy()
        motors = self.model.actuator_trnid[:, 0]
        self.joints = tuple(self.model.joint(joint).name for joint in motors)
        """The names of the joints that have a motor, in the order of all arrays."""
        self.places, self.speeds = self.model.jnt_qposadr[motors], self.model.jnt_dofadr[motors]
        self.sensors = {each: self.data.sensor(each).data for each in SENSORS}  # views, which each step fills anew
        self.reset()

    def reset(self) -> None:
        """Stand as the model file has it, at rest."""
        self.engine.mj_resetData(self.model, self.data)
        self.engine.mj_forward(self.model, self.data)
        self.target = self.data.ctrl.copy()
        self.target_in_s = self.push_left_s = 0.0

    @property
    def has_fallen(self) -> bool:
        """Whether the pelvis is at less than two thirds of the height at which the body stands."""
        return bool(self.data.qpos[2] < self.model.qpos0[2] * 2 / 3)

    @property
    def seconds(self) -> float:
        """How long it has been since it stood."""
        return round(self.data.time, 9)

    def adjust(self, mass: float, friction: float) -> None:
        """Set the mass of the whole body, kg, and the friction of the floor."""
        share = mass / self.masses.sum()
        self.model.body_mass[:] = share * self.masses
        self.model.body_inertia[:] = share * self.inertias
        self.engine.mj_setConst(self.model, self.engine.MjData(self.model))  # computes what follows from masses
        self.model.geom("floor").friction[0] = friction

    def push(self, force: float, seconds: float) -> None:
        """Push the pelvis forwards, or backwards where the force in N is negative, from the next step on."""
        self.data.xfrc_applied[self.pelvis, 0] = force
        self.push_left_s = seconds

    def turn(self, names: Sequence[str], angles: list[float], within_s: float) -> None:
        """Let joints turn to angles, in rad, in so many seconds; the others go on as before.

        Raises:
            ValueError: The body has no such joint.
        """
        if unknown := [name for name in names if name not in self.joints]:
            raise ValueError(f"the model has no joint {', '.join(unknown)}; it has {', '.join(self.joints)}")
        for name, angle in zip(names, angles, strict=True):
            self.target[self.joints.index(name)] = angle
        self.target_in_s = within_s

    def hold(self) -> None:
        """Let all joints stay where they are."""
        self.target = self.data.qpos[self.places]
        self.target_in_s = 0.0

    def step(self, seconds: float) -> None:
        """Compute what happens in so many seconds, in steps that are no longer than the model file says.

        Raises:
            FloatingPointError: MuJoCo's numbers became infinite, huge or undefined.
        """
        share = 1.0 if self.target_in_s <= seconds else seconds / self.target_in_s
        self.data.ctrl += share * (self.target - self.data.ctrl)
        self.target_in_s = max(0.0, self.target_in_s - seconds)
        if self.push_left_s <= 0.0:
            self.data.xfrc_applied[self.pelvis, 0] = 0.0
        self.push_left_s = round(self.push_left_s - seconds, 9)
        steps = ceil(seconds / self.longest_step_s - 1e-9)
        self.model.opt.timestep = seconds / steps
        self.engine.mj_step(self.model, self.data, steps)
        if self.data.warning.number.any():
            kinds = [each.name.removeprefix("mjWARN_") for each in self.engine.mjtWarning.__members__.values()]
            counted = zip(kinds, self.data.warning.number.tolist(), strict=False)
            raise FloatingPointError(f"MuJoCo warns of {', '.join(kind for kind, number in counted if number)}")

    @property
    def positions(self) -> NDArray[np.float64]:
        """The angles of the joints, rad; each time an array of its own."""
        return self.data.qpos[self.places]

    @property
    def velocities(self) -> NDArray[np.float64]:
        """The speeds of the joints, rad/s."""
        return self.data.qvel[self.speeds]

    @property
    def efforts(self) -> NDArray[np.float64]:
        """What the motors do at the joints, N·m."""
        return self.data.qfrc_actuator[self.speeds]

    @property
    def place(self) -> list[float]:
        """Where the pelvis is: x, y, z in m; w, x, y, z of its orientation."""
        return self.data.qpos[:7].tolist()

    def felt(self, sensor: str) -> list[float]:
        """The reading of one of `SENSORS`, in the sensor's own frame."""
        return self.sensors[sensor].tolist()


def unwritten(_warning: str) -> None:
    """Leave out MuJoCo's own warnings, which it writes into a file: `Body.step` raises where one was counted."""
