"""The platform as MuJoCo sees it: another engine's truth.

One free body with its origin at O_A, the load fixed to it as a second body, and six legs without mass: a spatial tendon
from each lower to each upper hinge, pulled or pushed by a motor. MuJoCo gives a free joint's linear velocity in world
axes and its angular velocity in BODY axes; this class speaks the project's language, everything in base axes.
"""

import mujoco
import numpy as np

from machines import Body, RigidMachine, State


class MujocoPlant:
    def __init__(self, machine: RigidMachine, load: Body, home_height_m: float, step_s: float = 1e-3):
        self._home = np.array([0.0, 0.0, home_height_m])
        self._home_leg_length_m = machine.home_leg_length_m
        self.model = mujoco.MjModel.from_xml_string(_mjcf(machine, load, self._home, step_s))
        self.data = mujoco.MjData(self.model)

    def set_state(self, state: State) -> None:
        """Pose, twist and leg forces, and all that MuJoCo derives from them."""
        self.data.qpos[:3] = self._home + state.p_m
        mujoco.mju_mat2Quat(self.data.qpos[3:7], state.R.flatten())
        self.data.qvel[:3] = state.V[:3]
        self.data.qvel[3:] = state.R.T @ state.V[3:]
        self.data.ctrl[:] = state.leg_force_n
        mujoco.mj_forward(self.model, self.data)

    def step(self, leg_force_n: np.ndarray) -> None:
        """One RK4 step under constant leg forces."""
        self.data.ctrl[:] = leg_force_n
        mujoco.mj_step(self.model, self.data)

    @property
    def p_m(self) -> np.ndarray:
        return self.data.qpos[:3] - self._home

    @property
    def R(self) -> np.ndarray:
        matrix = np.zeros(9)
        mujoco.mju_quat2Mat(matrix, self.data.qpos[3:7])
        return matrix.reshape(3, 3)

    @property
    def V(self) -> np.ndarray:
        return self._to_base_axes(self.data.qvel)

    def mass_matrix(self) -> np.ndarray:
        full = np.zeros((6, 6))
        mujoco.mj_fullM(self.model, self.data, full)
        return self._to_base_axes(self._to_base_axes(full).T).T

    def holding_wrench(self) -> np.ndarray:
        """What must act on the body so that its twist does not change: gravity and velocity terms."""
        return self._to_base_axes(self.data.qfrc_bias)

    def acceleration(self) -> np.ndarray:
        """d/dt [v; omega]. As omega x omega = 0, the rate of omega in body axes turns like omega itself."""
        return self._to_base_axes(self.data.qacc)

    def leg_displacement_m(self) -> np.ndarray:
        return self.data.ten_length - self._home_leg_length_m

    def leg_velocity_m_s(self) -> np.ndarray:
        return self.data.ten_velocity.copy()

    def _to_base_axes(self, rows: np.ndarray) -> np.ndarray:
        """Turns the angular rows of MuJoCo's free joint from body to base axes."""
        return np.concatenate([rows[:3], self.R @ rows[3:]])


def _mjcf(machine: RigidMachine, load: Body, home: np.ndarray, step_s: float) -> str:
    sites = lambda name, points: "".join(  # noqa: E731
        f'<site name="{name}{leg}" pos="{_numbers(point)}"/>' for leg, point in enumerate(points)
    )
    legs = range(6)
    tendons = "".join(f'<spatial name="leg{i}"><site site="b{i}"/><site site="a{i}"/></spatial>' for i in legs)
    motors = "".join(f'<motor tendon="leg{i}"/>' for i in legs)
    return f"""
<mujoco>
  <compiler angle="radian" balanceinertia="false" boundmass="0" boundinertia="0"/>
  <option timestep="{step_s:.17g}" gravity="0 0 {-machine.gravity_m_s2:.17g}" integrator="RK4"/>
  <worldbody>
    {sites("b", machine.base_hinges_m)}
    <body name="platform" pos="{_numbers(home)}">
      <freejoint/>
      {_inertial(machine.platform)}
      {sites("a", machine.platform_hinges_m)}
      <body name="load">{_inertial(load)}</body>
    </body>
  </worldbody>
  <tendon>{tendons}</tendon>
  <actuator>{motors}</actuator>
</mujoco>"""


def _inertial(body: Body) -> str:
    tensor = body.inertia_com_kg_m2
    entries = [*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]]
    return f'<inertial pos="{_numbers(body.com_m)}" mass="{body.mass_kg:.17g}" fullinertia="{_numbers(entries)}"/>'


def _numbers(values: np.ndarray | list[float]) -> str:
    return " ".join(f"{value:.17g}" for value in values)
