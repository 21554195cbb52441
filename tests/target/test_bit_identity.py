"""The emulated controller computes the same bits as the host, over ten seconds of every recorded log.

Both round every operation to the nearest float (IEEE 754), so they agree when both do the same operations in the same
order. The core sees to it: one source, -ffp-contract=off, with fmaf() where a product and a sum are rounded together
(algebra/real.h), no -ffast-math, so that no optimisation level may reorder sums, float literals and no double anywhere, and
from the C library only sqrtf and fmaf, which every implementation rounds correctly; each is one instruction on both.
The core uses no sine and no cosine. The host is x86-64, where float arithmetic is done in SSE registers without excess
precision.
"""

from pathlib import Path

import hexload_native
import numpy as np
import pytest

from hexload_dev import target
from hexload_dev.uncertain_estimates import early_covariances, estimates
from recorded import LOGS, log_of, on_rig, platform_file

SECONDS = 10.0
TICK_S = 1e-3
VERDICTS = np.array(["converged", "converging", "not_excited", "misfit", "inconsistent"])  # as hexload_verdict_t


def host_replay(name: str, folder: Path, estimator: str, platform=None) -> dict:
    log = log_of(name)
    rows = len(target.samples_of(log, SECONDS))
    legs = [
        np.ascontiguousarray(part[:rows].astype(np.float32).astype(float))
        for part in (log.displacement_m, log.velocity_m_s, log.force_n)
    ]
    platform = platform or hexload_native.load_platform(platform_file(name, folder))
    return hexload_native.replay(platform, estimator, None, log.t_s[:rows], *legs, str(folder / "host.csv"))


def bits(values: np.ndarray) -> np.ndarray:
    single = np.ascontiguousarray(values, np.float32)
    assert (single == values).all()  # a float that has been widened loses nothing on the way back
    return single.view(np.uint32)


def assert_same_bits(answers: np.ndarray, host: dict) -> None:
    assert len(answers) == len(host["t"]) == 10001
    assert (answers["status"] == 0).all()
    for quantity in ("value", "sigma", "nis"):
        np.testing.assert_array_equal(answers[quantity].view(np.uint32), bits(host[quantity]), quantity)
    np.testing.assert_array_equal(VERDICTS[answers["verdict"]], host["verdict"])
    np.testing.assert_array_equal(answers["health"], host["health"])


@pytest.mark.parametrize("name", LOGS)
def test_controller_computes_the_bits_of_the_host(name, tmp_path):
    # GIVEN ten seconds of a recorded log, replayed by the host's build of the firmware
    samples = target.samples_of(log_of(name), SECONDS)
    host = host_replay(name, tmp_path, "paper")
    config = hexload_native.config_bytes(hexload_native.load_platform(platform_file(name, tmp_path)), TICK_S)
    for optimisation, preset in target.CORTEX_M7.items():
        # WHEN the Cortex-M7 replays it, built at -O2 and at -O3
        answers = target.replay(preset, config, samples, tmp_path).answers
        # THEN every estimate, sigma, NIS, verdict and health word of every tick is the same, to the bit
        print(f"{name}, {optimisation}: {len(answers)} ticks, last estimate {answers['value'][-1]}")
        assert_same_bits(answers, host)


@pytest.mark.parametrize("name", LOGS)
def test_controller_computes_the_bits_of_the_host_with_the_momentum_filter(name, tmp_path):
    # GIVEN ten seconds of a recorded log, replayed by the host's build of the momentum estimator
    samples = target.samples_of(log_of(name), SECONDS)
    host = host_replay(name, tmp_path, "momentum")
    config = hexload_native.config_bytes(hexload_native.load_platform(platform_file(name, tmp_path)), TICK_S)
    for optimisation, preset in target.CORTEX_M7.items():
        # WHEN the Cortex-M7 replays it THEN all ten estimates and the rest are the same, to the bit
        _, answers = target.replay_momentum(preset, config, samples, tmp_path)
        print(f"{name}, {optimisation}: {len(answers)} ticks, last estimate {answers['value'][-1]}")
        assert_same_bits(answers, host)


def test_controller_computes_the_bits_of_the_host_for_the_load_as_a_body(tmp_path):
    # GIVEN estimates as wrong as those of the first two seconds of a motion, described and brought inside by the host
    platform = hexload_native.load_platform(platform_file("multisine_eccentric", tmp_path))
    random = np.random.default_rng(2)
    truth = np.array([312.0, -28.0, 41.0, 84.0, 45.0, 46.0, 20.0, 5.6, 6.5, -9.4])
    early = early_covariances(hexload_native, platform, log_of("multisine_eccentric"), tmp_path)
    thetas = np.concatenate([estimates(random, truth, covariance, 25) for covariance in early])
    covariances = np.repeat(early, 25, axis=0)
    bodies = [hexload_native.describe_body(*asked) for asked in zip(thetas, covariances, strict=True)]
    nearest = [hexload_native.nearest_body(*asked) for asked in zip(thetas, covariances, strict=True)]
    assert 10 < sum(body["is_consistent"] for body in bodies) < 90
    for preset in target.CORTEX_M7.values():
        # WHEN the Cortex-M7 does it THEN all numbers are the same, to the bit, and so are the flags
        answers = target.run_bodies(preset, thetas, covariances, tmp_path)
        for name, expected in [*((name, bodies) for name in bodies[0]), ("distance_sigmas", nearest)]:
            found = np.array([np.asarray(each[name], float) for each in expected])
            np.testing.assert_array_equal(answers[name].astype(float), found, name)
        np.testing.assert_array_equal(answers["nearest"].astype(float), [each["theta"] for each in nearest])
        np.testing.assert_array_equal(answers["is_found"], [each["is_found"] for each in nearest])


def test_controller_computes_the_bits_of_the_host_with_bias_and_friction(tmp_path):
    # GIVEN ten seconds of a recorded log, replayed by the host's build of the estimator with the machine's effects
    name = "multisine_eccentric"
    samples = target.samples_of(log_of(name), SECONDS)
    host = host_replay(name, tmp_path, "momentum_effects")
    host |= {quantity: host[quantity][:, :10] for quantity in ("value", "sigma")}
    config = hexload_native.config_bytes(hexload_native.load_platform(platform_file(name, tmp_path)), TICK_S)
    for preset in target.CORTEX_M7.values():
        # WHEN the Cortex-M7 replays it THEN all ten estimates of the load and the rest are the same, to the bit
        _, answers = target.replay_momentum(preset, config, samples, tmp_path, "momentum_effects")
        assert_same_bits(answers, host)


def test_controller_computes_the_bits_of_the_host_on_a_commissioned_rig(tmp_path):
    # GIVEN ten seconds of a recorded log, replayed by the host's build with a rig that has all that commissioning finds
    name = "multisine_eccentric"
    samples = target.samples_of(log_of(name), SECONDS)
    platform = on_rig(hexload_native.load_platform(platform_file(name, tmp_path)), tmp_path / "rig.toml")
    host = host_replay(name, tmp_path, "momentum", platform)
    config = hexload_native.config_bytes(platform, TICK_S)
    for preset in target.CORTEX_M7.values():
        # WHEN the Cortex-M7 replays it THEN all ten estimates and the rest are the same, to the bit
        _, answers = target.replay_momentum(preset, config, samples, tmp_path)
        assert_same_bits(answers, host)
