"""The diagnosis of a log in memory."""

from numpy.typing import ArrayLike

from hexload.diagnosis.diagnose import Diagnosis
from hexload.diagnosis.diagnose import diagnose as diagnose_log
from hexload.diagnosis.machine import in_time, machine_of
from hexload.estimation.arrays import leg_log
from hexload.estimation.estimator import PlatformLike
from hexload.platform import Platform


def diagnose(t: ArrayLike, dl: ArrayLike, vl: ArrayLike | None, f: ArrayLike, platform: PlatformLike) -> Diagnosis:
    """What in a log contradicts itself, or a rigid load on the platform: causes with sizes, the most likely first.

    t           (n,) s, strictly increasing; of more than a minute the last counts
    dl, vl, f   (n, 6) as of replay(): m, m/s, N; vl None: no velocity sensors
    platform    a platform file, its tables as a dict, or a Platform

    findings is empty where nothing is wrong that the log can tell. No estimator takes part, and no change of the load
    counts as reported. Raises InputError. 16 s at 1 kHz take half a second of a clean log and two to five of another.
    Source: the first lines of hexload.diagnosis and of its modules.
    """
    native = Platform.of(platform).native()
    return diagnose_log(in_time(native, leg_log(t, dl, vl, f)), machine_of(native))
