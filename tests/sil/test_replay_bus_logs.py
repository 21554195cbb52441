"""Leg logs from CAN and LCM: from every kind of file the same samples give the same estimates, and what is wrong is named."""

import functools
import gzip
import os
import subprocess
import sys
import tracemalloc
from pathlib import Path

import lcm
import numpy as np
import pytest

from hexload import project
from hexload.errors import InputError
from hexload.estimation.replay import replay_log
from hexload.io.end_to_end import checksum, found_checksum, protected
from hexload.io.log_file import COLUMNS, LegLog, read_log
from hexload.io.log_formats import read_any_log
from hexload.io.python_can import can, cantools

SOURCE = Path(os.environ["HEXLOAD_SOURCE_DIR"])
DATA = SOURCE / "tests" / "data"
CONTRACT = cantools.database.load_file(SOURCE / "firmware" / "bus" / "hexload.dbc")
ROWS = 1000
LEGS = range(1, 7)
CHANNELS = ("displacement", "velocity", "force")
FD, CLASSIC = map(CONTRACT.get_message_by_name, ("LegSampleFd", "LegSample1"))
STEPS = {  # of displacement (m), velocity (m/s), force (N), from the contract
    "fd": [FD.get_signal_by_name(f"{name}_1").scale for name in CHANNELS],
    "classic": [CLASSIC.get_signal_by_name(name).scale for name in CHANNELS],
}
NOMINAL_SIGMA = [20e-6, 1e-3, 5.0]


@functools.cache
def first_rows(name):
    log = read_log(DATA / f"{name}.csv.gz")
    return LegLog(log.t_s[:ROWS], log.displacement_m[:ROWS], log.velocity_m_s[:ROWS], log.force_n[:ROWS])


@functools.cache
def frames_of_rows(name, profile):
    return tuple(frames_of(first_rows(name), profile))


@pytest.fixture
def recorded():
    return first_rows(RECORDED)


def quantised(log, profile):
    """What the bus carries of a log."""
    channels = (log.displacement_m, log.velocity_m_s, log.force_n)
    return LegLog(log.t_s, *(np.round(values / step) * step for values, step in zip(channels, STEPS[profile])))


def frame(name, signals, data=None):
    message = CONTRACT.get_message_by_name(name)
    return can.Message(
        arbitration_id=message.frame_id,
        is_extended_id=False,
        is_fd=message.is_fd,
        bitrate_switch=message.is_fd,
        data=protected(message.frame_id, bytes(message.encode(signals))) if data is None else data,
        channel="vcan0",
    )


def fd_frame(tick, displacement, velocity, force):
    signals = {"tick": tick, "version": 2, "crc32": 0}
    for leg in LEGS:
        signals |= {
            f"displacement_{leg}": displacement[leg - 1],
            f"velocity_{leg}": velocity[leg - 1],
            f"force_{leg}": force[leg - 1],
        }
    return frame("LegSampleFd", signals)


def tick_frame(tick):
    return frame("SampleTick", {"crc8": 0, "counter": tick // 16 % 16, "version": 2, "tick": tick})


def leg_frame(leg, tick, displacement=0.0, velocity=0.0, force=0.0):
    signals = {"displacement": displacement, "velocity": velocity, "force": force, "tick_low": tick % 16, "crc8": 0}
    return frame(f"LegSample{leg}", signals)


def frames_of(log, profile):
    for row, t in enumerate(log.t_s):
        tick = round(t * 1000)
        values = (log.displacement_m[row], log.velocity_m_s[row], log.force_n[row])
        if profile == "fd":
            yield fd_frame(tick, *values)
            continue
        if tick % 16 == 0:
            yield tick_frame(tick)
        for leg in LEGS:
            yield leg_frame(leg, tick, *(channel[leg - 1] for channel in values))


def write_frames(path, frames):
    writer = {".log": can.CanutilsLogWriter, ".blf": can.BLFWriter, ".asc": can.ASCWriter}[path.suffix](path)
    with writer:
        for number, message in enumerate(frames):
            message.timestamp = 1.0 + number * 1e-4
            writer(message)
    return path


def write_csv(path, log):
    columns = np.column_stack((log.t_s, log.displacement_m, log.velocity_m_s, log.force_n))
    np.savetxt(path, columns, fmt="%.17g", delimiter=",", header=",".join(COLUMNS), comments="")
    return path


def write_lcm(path, samples):
    """`samples`: (sequence, tick, displacement, velocity, force)."""
    log = lcm.EventLog(str(path), "w", overwrite=True)
    leg_sample_t = project.message_type("leg_sample_t")
    for number, (sequence, tick, displacement, velocity, force) in enumerate(samples):
        message = leg_sample_t()
        message.sequence, message.tick = sequence, tick
        message.displacement_m, message.velocity_m_s, message.force_n = map(list, (displacement, velocity, force))
        log.write_event(1000 * number, "HEXLOAD_LEG_SAMPLE", message.encode())
        log.write_event(1000 * number + 1, "HEXLOAD_OTHER", b"not ours")
    log.close()
    return path


def lcm_samples(log):
    for row, t in enumerate(log.t_s):
        yield row, round(t * 1000), log.displacement_m[row], log.velocity_m_s[row], log.force_n[row]


PAPER, MOMENTUM = DATA / "paper_load.toml", DATA / "unknown_load.toml"
RECORDED, OF_UNKNOWN_LOAD = "paper_noisy", "multisine_eccentric"  # logs, the second one for the momentum filter


def replay(log, out, platform=PAPER):
    command = [sys.executable, "-m", "hexload_dev", "replay", log, "--platform", platform, "--out", out]
    return subprocess.run([*map(str, command)], capture_output=True, text=True)


def estimates(log, out, platform=PAPER):
    """Without the command line, which takes longer to start than the firmware to run."""
    replay_log(log, platform, None, None, out)
    return out.read_bytes()


@pytest.fixture(scope="module")
def of_csv(tmp_path_factory):
    """of_csv(name, profile): the estimates of a CSV log; without a profile of all digits. Made once."""
    folder = tmp_path_factory.mktemp("csv")

    @functools.cache
    def made(name, profile=None):
        log = first_rows(name) if profile is None else quantised(first_rows(name), profile)
        platform = {RECORDED: PAPER, OF_UNKNOWN_LOAD: MOMENTUM}[name]
        return estimates(write_csv(folder / "log.csv", log), folder / "estimates.csv", platform)

    return made


@pytest.mark.parametrize(
    ("name", "profile"),
    [(f"log.{suffix}", profile) for suffix in ("log", "blf", "asc") for profile in ("fd", "classic")],
)
def test_a_can_log_replays_to_the_estimates_of_what_the_bus_carried(of_csv, tmp_path, name, profile):
    # GIVEN the samples as the bus carries them, in a CSV log and in a CAN log
    bus = write_frames(tmp_path / name, frames_of_rows(RECORDED, profile))
    # WHEN both are replayed THEN every byte of the estimates is the same
    assert estimates(bus, tmp_path / "bus.csv") == of_csv(RECORDED, profile)


def test_an_lcm_log_replays_to_the_same_estimates(of_csv, recorded, tmp_path):
    # GIVEN the samples in a CSV log and in an LCM log, which carries the controller's own float32
    bus = write_lcm(tmp_path / "lcmlog-2026-11-21.00", lcm_samples(recorded))
    # WHEN both are replayed THEN every byte of the estimates is the same
    assert estimates(bus, tmp_path / "bus.csv") == of_csv(RECORDED)


@pytest.mark.parametrize(
    ("name", "profile"), [("log.log", "fd"), ("log.blf", "classic"), ("lcmlog-2026-11-21.00", None)]
)
def test_a_log_of_any_kind_replays_to_the_ten_parameters_of_what_was_carried(of_csv, tmp_path, name, profile):
    # GIVEN samples of a load of which nothing is known, in a CSV log and in a log of a bus or of LCM
    if profile is None:
        bus = write_lcm(tmp_path / name, lcm_samples(first_rows(OF_UNKNOWN_LOAD)))
    else:
        bus = write_frames(tmp_path / name, frames_of_rows(OF_UNKNOWN_LOAD, profile))
    # WHEN both are replayed THEN every byte of the estimates is the same, of all ten
    found = estimates(bus, tmp_path / "bus.csv", MOMENTUM)
    assert found == of_csv(OF_UNKNOWN_LOAD, profile)
    assert found.decode().startswith("t,m,hx,hy,hz,Ixx,Iyy,Izz,Ixy,Ixz,Iyz,s_m,")


@pytest.mark.parametrize("profile", ["fd", "classic"])
@pytest.mark.parametrize(("name", "platform", "parameters"), [(RECORDED, PAPER, 4), (OF_UNKNOWN_LOAD, MOMENTUM, 10)])
def test_quantisation_moves_the_estimates_by_a_small_part_of_sigma(
    of_csv, tmp_path, profile, name, platform, parameters
):
    # GIVEN the samples with all their digits and as the bus carries them
    exact = of_csv(name)
    carried = estimates(write_frames(tmp_path / "log.log", frames_of_rows(name, profile)), tmp_path / "b.csv", platform)
    last = [text.decode().splitlines()[-1:] for text in (exact, carried)]
    a, b = (np.genfromtxt(line, delimiter=",")[1 : 1 + 2 * parameters] for line in last)
    # WHEN the last estimates are compared THEN they differ by no more than rounding adds to the sensors' noise: an error
    # of step / sqrt(12) beside the nominal sigma, through the same filter; five times that for chance
    share = max(step / np.sqrt(12) / sigma for step, sigma in zip(STEPS[profile], NOMINAL_SIGMA))
    moved = (a[:parameters] - b[:parameters]) / a[parameters:]
    print(f"{platform.stem}, {profile}: moved by at most {np.abs(moved).max():.4f} sigma")
    assert np.all(np.abs(moved) <= 5 * share), moved


def test_a_compressed_candump_log_reads_as_the_plain_one(recorded, tmp_path):
    few = LegLog(recorded.t_s[:20], recorded.displacement_m[:20], recorded.velocity_m_s[:20], recorded.force_n[:20])
    plain = write_frames(tmp_path / "log.log", frames_of(few, "fd"))
    packed = tmp_path / "log.log.gz"
    packed.write_bytes(gzip.compress(plain.read_bytes()))
    np.testing.assert_array_equal(read_any_log(packed).force_n, read_any_log(plain).force_n)


@pytest.mark.parametrize("direction", ["", " R", " T"])
def test_candump_with_directions_and_foreign_frames_is_read(tmp_path, direction):
    # GIVEN what candump -L writes (with -x also the direction), and among our frames another node's, an extended, a remote
    # and an error frame
    path = write_frames(tmp_path / "log.log", [fd_frame(tick, *np.zeros((3, 6))) for tick in range(3)])
    ours = [line.removesuffix(" R") + direction for line in path.read_text().splitlines()]
    identifiers = ("7FF#0102", "00000080#0102", "081#R", "20000080#0000000000000000")
    foreign = [f"(1.0) vcan0 {identifier}{direction}" for identifier in identifiers]
    path.write_text("\n".join([*foreign, *ours, *foreign, ""]))
    # WHEN it is read THEN our three samples are found
    np.testing.assert_allclose(read_any_log(path).t_s, [0, 0.001, 0.002])


# What the controller leaves out, and a reader with it


def classic_ticks(*ticks, without=()):
    for tick in ticks:
        if tick % 16 == 0:
            yield tick_frame(tick)
        yield from (leg_frame(leg, tick) for leg in LEGS if (tick, leg) not in without)


def test_a_sample_without_a_leg_is_left_out_and_named(tmp_path):
    # GIVEN a classic log that lost legs 2 and 5 of tick 17, and ends within tick 19
    lost = {(17, 2), (17, 5), (19, 6)}
    path = write_frames(tmp_path / "log.log", classic_ticks(16, 17, 18, 19, without=lost))
    # WHEN it is read THEN ticks 16 and 18 are there, and the remark counts and places the others
    log = read_any_log(path)
    np.testing.assert_allclose(log.t_s, [0.016, 0.018])
    assert log.remarks == ("2 incomplete samples left out, the first at line 8: tick 17 without leg 2, 5",)


def test_a_classic_log_that_begins_between_two_whole_ticks_waits_for_the_next(tmp_path):
    path = write_frames(tmp_path / "log.log", classic_ticks(14, 15, 16, 17))
    log = read_any_log(path)
    np.testing.assert_allclose(log.t_s, [0.016, 0.017])
    assert log.remarks == ("12 leg frames before the first SampleTick left out",)


def test_a_classic_log_may_miss_whole_ticks_and_have_its_legs_in_any_order(tmp_path):
    frames = [*classic_ticks(32), *reversed(list(classic_ticks(33))), *classic_ticks(40), *classic_ticks(64)]
    log = read_any_log(write_frames(tmp_path / "log.log", frames))
    np.testing.assert_allclose(log.t_s, [0.032, 0.033, 0.040, 0.064])
    assert log.remarks == ()


def test_lost_lcm_messages_are_remarked(tmp_path):
    zero = np.zeros(6)
    path = write_lcm(tmp_path / "log.lcm", [(tick, tick, zero, zero, zero) for tick in (0, 1, 4, 5)])
    assert read_any_log(path).remarks == ("2 messages of HEXLOAD_LEG_SAMPLE were lost before the log was written",)


def test_remarks_reach_the_user(recorded, tmp_path):
    few = LegLog(recorded.t_s[:50], recorded.displacement_m[:50], recorded.velocity_m_s[:50], recorded.force_n[:50])
    frames = list(frames_of(few, "classic"))
    del frames[30]
    result = replay(write_frames(tmp_path / "log.log", frames), tmp_path / "out.csv")
    assert result.returncode == 0, result.stderr
    assert "1 incomplete samples left out, the first at line 26: tick 4 without leg 6" in result.stdout


# Refusals


def refusal(path):
    with pytest.raises(InputError) as refused:
        read_any_log(path)
    return str(refused.value)


def fd_ticks(*ticks):
    return [fd_frame(tick, *np.zeros((3, 6))) for tick in ticks]


def changed(message, offset, value):
    message.data[offset] = value
    return message


@pytest.mark.parametrize(("suffix", "place"), [(".log", "line 3"), (".blf", "frame 3"), (".asc", "line 8")])
def test_a_wrong_checksum_is_refused_with_its_place(tmp_path, suffix, place):
    # GIVEN a log whose third sample has one other byte
    frames = fd_ticks(0, 1, 2)
    data = bytes(changed(frames[2], 10, 1).data)
    path = write_frames(tmp_path / f"log{suffix}", frames)
    # WHEN it is read THEN file, place and both checksums are named
    found, expected = found_checksum(data), checksum(0x080, data)
    assert refusal(path) == f"{path}: {place}: LegSampleFd: found checksum {found:#x}, expected {expected:#x}"


@pytest.mark.parametrize("suffix", [".log", ".blf"])
def test_a_second_run_in_the_log_is_refused_with_its_place(tmp_path, suffix):
    path = write_frames(tmp_path / f"log{suffix}", fd_ticks(0, 1, 2, 0, 1))
    place = "line 4" if suffix == ".log" else "frame 4"
    assert refusal(path) == (
        f"{path}: {place}: found tick 0 after tick 2, a second run; expected one run, cut the log before this place"
    )


def test_a_second_classic_run_is_refused_with_its_place(tmp_path):
    path = write_frames(tmp_path / "log.log", [*classic_ticks(16, 17), *classic_ticks(0)])
    assert refusal(path) == (
        f"{path}: line 14: found tick 0 after tick 17, a second run; expected one run, cut the log before this place"
    )


def test_the_same_tick_twice_is_refused(tmp_path):
    path = write_frames(tmp_path / "log.log", fd_ticks(0, 1, 1))
    assert refusal(path) == f"{path}: line 3: found tick 1 twice, expected a later one"


def test_a_leg_twice_is_refused(tmp_path):
    path = write_frames(tmp_path / "log.log", [*classic_ticks(0), leg_frame(3, 0)])
    assert refusal(path) == f"{path}: line 8: found leg 3 of tick 0 twice, expected it once"


def test_a_late_leg_is_refused(tmp_path):
    path = write_frames(tmp_path / "log.log", [*classic_ticks(0, 1, 2), leg_frame(3, 1)])
    assert refusal(path) == f"{path}: line 20: found leg 3 of tick 1 after tick 2, expected it in the order of ticks"


def test_both_profiles_in_one_log_are_refused(tmp_path):
    path = write_frames(tmp_path / "log.log", [*fd_ticks(0, 1), *classic_ticks(16)])
    assert refusal(path) == (
        f"{path}: line 3: found a leg sample of the classic profile after those of the fd profile, expected one profile"
    )


def test_two_buses_in_one_log_are_refused(tmp_path):
    path = write_frames(tmp_path / "log.log", fd_ticks(0, 1, 2))
    path.write_text(path.read_text().replace("(1.000200) vcan0", "(1.000200) vcan1"))
    assert refusal(path) == (
        f"{path}: line 3: found a leg sample on bus vcan1 after those on bus vcan0, expected one bus"
    )


def test_a_wrong_length_is_refused(tmp_path):
    short = frame("LegSample1", None, bytes(7))
    path = write_frames(tmp_path / "log.log", [*classic_ticks(0), short])
    assert refusal(path) == (f"{path}: line 8: LegSample1: found 7 bytes of classic CAN, expected 8 of classic CAN")


def test_one_step_below_the_range_is_a_channel_without_sensor(tmp_path):
    # GIVEN a second tick with a displacement of -2^18 steps, one below the range, of leg 1
    none = frame("LegSample1", None, protected(0x081, (1 << 8 | 1 << (12 + 18)).to_bytes(8, "little")))
    others = [leg_frame(leg, 1) for leg in LEGS if leg != 1]
    # WHEN the log is read THEN that one number is missing, and no other
    log = read_any_log(write_frames(tmp_path / "log.log", [*classic_ticks(0), none, *others]))
    assert np.argwhere(np.isnan(log.displacement_m)).tolist() == [[1, 0]]
    assert np.isfinite(log.force_n).all()


def test_the_ends_of_the_range_are_accepted(tmp_path):
    # GIVEN the largest values that the contract has, of either sign, in every leg
    signal = CONTRACT.get_message_by_name("LegSample1").signals
    for end in ("minimum", "maximum"):
        values = {item.name: getattr(item, end) for item in signal if item.name not in ("tick_low", "crc8")}
        frames = [
            tick_frame(0),
            *(leg_frame(leg, tick, **values) for tick in (0, 1) for leg in LEGS),
        ]
        log = read_any_log(write_frames(tmp_path / "log.log", frames))
        # THEN they are read
        np.testing.assert_allclose(log.force_n, np.full((2, 6), values["force"]))


def test_a_line_that_is_no_candump_line_is_refused_with_its_number(tmp_path):
    path = write_frames(tmp_path / "log.log", fd_ticks(0, 1))
    path.write_text(path.read_text() + "(1.0) vcan0 08x#00\n")
    assert refusal(path) == (
        f"{path}: line 3: invalid literal for int() with base 16: '08x', expected a candump line, (time) bus id#data"
    )


@pytest.mark.parametrize("suffix", [".log", ".asc"])
def test_a_packed_line_without_end_is_refused_before_it_is_unpacked(tmp_path, suffix):
    # GIVEN 64 MiB in one line, which gzip makes 64 KiB of, behind two good ones
    path = write_frames(tmp_path / f"log{suffix}", fd_ticks(0, 1))
    packed = tmp_path / f"log{suffix}.gz"
    start = path.read_bytes()
    with gzip.open(packed, "wb", compresslevel=1) as stream:
        stream.write(start)
        for _ in range(64):
            stream.write(bytes(1 << 20))
    # WHEN it is read
    tracemalloc.start()
    said = refusal(packed)
    _, peak_bytes = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # THEN the line is named, and the memory that was taken is that of the program, not of the line
    line = start.count(b"\n") + 1
    assert said.startswith(f"{packed}: line {line}: found more than 4096 characters, expected a")
    assert peak_bytes < 16 << 20


def test_a_log_without_samples_is_refused(tmp_path):
    path = tmp_path / "log.log"
    path.write_text("(1.0) vcan0 123#00\n(1.0) vcan0 124#00\n")
    assert refusal(path) == f"{path}: found 0 whole leg samples in 2 frames, expected at least 2"


def test_a_blf_log_that_is_cut_off_is_refused(tmp_path):
    path = write_frames(tmp_path / "log.blf", fd_ticks(*range(100)))
    whole = path.read_bytes()
    path.write_bytes(whole[:-100])
    assert refusal(path) == (
        f"{path}: found {len(whole) - 100} bytes, expected the {len(whole)} of its header: cut off"
    )


def test_a_blf_log_with_damaged_data_is_refused(tmp_path):
    path = write_frames(tmp_path / "log.blf", fd_ticks(*range(100)))
    whole = bytearray(path.read_bytes())
    whole[-100:-50] = bytes(50)
    path.write_bytes(whole)
    assert refusal(path).startswith(f"{path}: found damaged data after frame 0, expected .blf (")


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("log.log", "a candump log (candump -L or -l)"),
        ("log.blf", "a Vector binary log"),
        ("log.asc", "a Vector text log"),
        ("log.lcm", "an LCM event log"),
    ],
)
def test_a_file_that_is_not_what_its_suffix_says_is_refused(tmp_path, name, expected):
    path = tmp_path / name
    path.write_text("hello")
    assert refusal(path) == f"{path}: found the first bytes b'hello', expected {expected}"


def test_an_lcm_log_without_leg_samples_is_refused_with_what_it_has(tmp_path):
    path = tmp_path / "log.lcm"
    log = lcm.EventLog(str(path), "w")
    log.write_event(1, "POSE", b"x")
    log.close()
    assert refusal(path) == f"{path}: found 0 messages on HEXLOAD_LEG_SAMPLE, expected at least 2; the log has POSE"


def test_an_lcm_message_of_another_type_is_refused(tmp_path):
    path = tmp_path / "log.lcm"
    log = lcm.EventLog(str(path), "w")
    log.write_event(1, "HEXLOAD_LEG_SAMPLE", b"12345678abc")
    log.close()
    assert refusal(path) == f"{path}: event 0: found a message of another type or version, expected leg_sample_t"


def test_a_second_lcm_run_is_refused(tmp_path):
    zero = np.zeros(6)
    path = write_lcm(tmp_path / "log.lcm", [(tick, tick, zero, zero, zero) for tick in (0, 1, 0)])
    assert refusal(path) == (
        f"{path}: event 4: found tick 0 after tick 1, a second run; expected one run, cut the log before this place"
    )


def test_an_lcm_value_that_is_infinite_is_refused(tmp_path):
    zero, bad = np.zeros(6), np.array([0, 0, np.inf, 0, 0, 0])
    path = write_lcm(tmp_path / "log.lcm", [(0, 0, zero, zero, zero), (1, 1, zero, bad, zero)])
    assert refusal(path) == f"{path}: event 2: found an infinite value in tick 1, expected a number"


def test_an_lcm_value_that_is_no_number_is_missing(tmp_path):
    zero, lost = np.zeros(6), np.array([0, 0, np.nan, 0, 0, 0])
    path = write_lcm(tmp_path / "log.lcm", [(0, 0, zero, zero, zero), (1, 1, zero, lost, zero)])
    assert np.argwhere(np.isnan(read_any_log(path).velocity_m_s)).tolist() == [[1, 2]]


def test_a_refused_log_leaves_the_estimates_as_they_were(tmp_path):
    path = write_frames(tmp_path / "log.log", fd_ticks(0, 1, 0))
    out = tmp_path / "out.csv"
    out.write_text("before")
    result = replay(path, out)
    assert result.returncode == 2
    assert result.stderr.startswith(f"hexload: {path}: line 3: found tick 0 after tick 1")
    assert out.read_text() == "before"
