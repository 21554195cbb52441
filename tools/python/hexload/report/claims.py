"""Numbers of a run behind what the report says of the paper's claims: tilt, gravity moment, start error.

Angular velocity, moments and the load's arm are in base axes; inertia tensors in platform axes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.io.run_directory import Run
from hexload.theory.bound import rotation_from_rpy

PAPER_FREQUENCY_RAD_S = np.pi  # of all three signals of (23)
PAPER_PRINTED_IXX_VARIANCE = 10.0  # fifth entry of the P0 that the paper prints, (kg m^2)^2


def rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


@dataclass(frozen=True)
class Excitation:
    """While a run carries its last load, from the truth. Pairs are (about x, about y), base axes."""

    tilt_rms_rad: tuple[float, float]
    yaw_rms_rad: float
    reference_tilt_max_rad: float
    angular_acceleration_rms_rad_s2: tuple[float, float]
    yaw_acceleration_rms_rad_s2: float
    load_inertia_moment_rms_n_m: tuple[float, float]  # Ixx wx', Iyy wy': all that speaks of Ixx and Iyy
    inertial_moment_rms_n_m: tuple[float, float]  # (I_platform + I_load about O_A) w'
    gravity_moment_rms_n_m: tuple[float, float]  # l x m_l g
    gravity_ratio_at_paper_frequency: float  # of a harmonic tilt at the frequency of (23)

    @property
    def gravity_ratio(self) -> tuple[float, float]:
        """Gravity moment over inertial moment; nan where nothing accelerates."""
        gravity, inertial = self.gravity_moment_rms_n_m, self.inertial_moment_rms_n_m
        return tuple(g / i if i > 0 else float("nan") for g, i in zip(gravity, inertial))


def excitation(run: Run) -> Excitation:
    load = run.final_load
    since = run.truth["t"] >= load["at_s"]
    truth = {name: values[since] for name, values in run.truth.items()}
    angular_velocity = np.column_stack([truth["wx"], truth["wy"], truth["wz"]])
    acceleration = np.gradient(angular_velocity, truth["t"], axis=0)
    rotation = rotation_from_rpy(np.column_stack([truth["roll"], truth["pitch"], truth["yaw"]]))
    load_inertia = inertia_about_platform_centre(load)
    inertia = load_inertia + _tensor(run.platform["platform"]["inertia_kg_m2"])
    inertial = np.einsum("nij,jk,nlk,nl->ni", rotation, inertia, rotation, acceleration, optimize=True)
    weight_n = load["mass_kg"] * run.platform["environment"]["gravity_m_s2"]
    arm = rotation @ np.array(load["com_m"])
    own = _tensor(load["inertia_com_kg_m2"])
    return Excitation(
        tilt_rms_rad=(rms(truth["roll"]), rms(truth["pitch"])),
        yaw_rms_rad=rms(truth["yaw"]),
        reference_tilt_max_rad=float(max(np.abs(truth["ref_roll"]).max(), np.abs(truth["ref_pitch"]).max())),
        angular_acceleration_rms_rad_s2=(rms(acceleration[:, 0]), rms(acceleration[:, 1])),
        yaw_acceleration_rms_rad_s2=rms(acceleration[:, 2]),
        load_inertia_moment_rms_n_m=(own[0, 0] * rms(acceleration[:, 0]), own[1, 1] * rms(acceleration[:, 1])),
        inertial_moment_rms_n_m=(rms(inertial[:, 0]), rms(inertial[:, 1])),
        gravity_moment_rms_n_m=(weight_n * rms(arm[:, 1]), weight_n * rms(arm[:, 0])),
        gravity_ratio_at_paper_frequency=weight_n * load["com_m"][2] / (inertia[0, 0] * PAPER_FREQUENCY_RAD_S**2),
    )


@dataclass(frozen=True)
class StartError:
    """The filter's start value of Ixx is wrong by this many of its own standard deviations."""

    this_run_sigmas: float
    printed_prior_sigmas: float  # had it started from zero with the P0 that the paper prints


def start_error(run: Run) -> StartError:
    ixx = run.load_parameters(run.estimates["t"][:1])["Ixx"][0]
    return StartError(
        this_run_sigmas=abs(ixx - run.estimates["Ixx"][0]) / run.estimates["s_Ixx"][0],
        printed_prior_sigmas=ixx / np.sqrt(PAPER_PRINTED_IXX_VARIANCE),
    )


def inertia_about_platform_centre(load: dict) -> NDArray[np.float64]:
    """Parallel-axis theorem: I_O = I_C + m (c.c E - c c^T)."""
    c = np.array(load["com_m"])
    return _tensor(load["inertia_com_kg_m2"]) + load["mass_kg"] * (c @ c * np.eye(3) - np.outer(c, c))


def _tensor(entries: list[float]) -> NDArray[np.float64]:
    xx, yy, zz, xy, xz, yz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
