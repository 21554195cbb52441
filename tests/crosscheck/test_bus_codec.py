"""The firmware's CAN codec against cantools: two readers of one DBC, and checksums bit by bit.

C encodes and cantools decodes, then the other way round; random bytes go into every decoder.
"""

import math
import struct

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hexload.io import end_to_end
from hexload.io.python_can import cantools
from hexload.project import native_module
from hexload_dev.bus_document import DBC, profile

bus = native_module().bus
contract = cantools.database.load_file(DBC)

FLOAT32_EPSILON = 2.0**-23
PROFILES = ("fd", "classic")
LOAD = ("m", "hx", "hy", "hz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
PARAMETERS = (("dz", "Ixx", "Iyy", "Izz"), tuple(f"load_{name}" for name in LOAD))  # by the filter's code
FD_ANSWER = (("EstimateFd", "SigmaFd", "HealthFd"), ("LoadFd", "LoadSigmaFd", "HealthFd"))
PAGES = (tuple(range(13)), (0, *range(13, 33), 9, 10, 11, 12, 33))  # codes, in sending order
KINDS = {"displacement_m": "displacement", "velocity_m_s": "velocity", "force_n": "force"}

uint = {bits: st.integers(0, 2**bits - 1) for bits in (8, 16, 32)}
float32 = st.floats(width=32, allow_nan=False, allow_infinity=False)
tuned = settings(max_examples=300, deadline=None)


def crc_bitwise(data, polynomial, start, final, bits):
    """Most significant bit first, as the standards print it."""
    crc = start
    for byte in data:
        crc ^= byte << (bits - 8)
        for _ in range(8):
            crc = (crc << 1) ^ polynomial if crc >> (bits - 1) else crc << 1
            crc &= 2**bits - 1
    return crc ^ final


def reflected(number, bits):
    return int(f"{number:0{bits}b}"[::-1], 2)


def crc32p4(data):
    """Of bytes and result reflected, as the standard prints it."""
    crc = crc_bitwise(bytes(reflected(byte, 8) for byte in data), 0xF4ACFB13, 0xFFFFFFFF, 0xFFFFFFFF, 32)
    return reflected(crc, 32)


def crc8h2f(data):
    return crc_bitwise(data, 0x2F, 0xFF, 0xFF, 8)


def sealed(identifier, data):
    """With the checksum of contract and standard: Profile 22 in byte 0, or Profile 4's in the last four."""
    if len(data) > 8:
        data_id = (0x484C0000 + identifier).to_bytes(4, "little")
        return data[:-4] + crc32p4(data[:-4] + data_id).to_bytes(4, "little")
    return bytes([crc8h2f(data[1:] + bytes([(identifier ^ identifier >> 4) & 0xFF]))]) + data[1:]


def test_checksums_have_the_check_values_of_the_standard():
    # AUTOSAR, Specification of CRC Routines: CRC8H2F and CRC32P4 of the nine digits
    assert (crc8h2f(b"123456789"), crc32p4(b"123456789")) == (0xDF, 0x1697D06A)


def test_the_readers_of_logs_have_the_same_checksums():
    for length in (2, 6, 8, 32, 64):
        data = bytes(range(length))
        for identifier in (0x010, 0x081, 0x103, 0x120):
            assert end_to_end.protected(identifier, data) == sealed(identifier, data)


def decode(frame):
    """By cantools, as numbers; identifier, format, length and checksum are the contract's."""
    identifier, is_fd, data = frame
    message = contract.get_message_by_frame_id(identifier)
    assert (is_fd, len(data)) == (message.is_fd, message.length)
    signals = message.decode(data, decode_choices=False)
    assert data == sealed(identifier, data)
    for checksum in ("crc8", "crc32"):
        signals.pop(checksum, None)
    return message.name, signals


def encode(name, signals):
    """By cantools, with the checksum."""
    message = contract.get_message_by_name(name)
    data = bytes(message.encode({"crc32" if message.is_fd else "crc8": 0, **signals}, strict=True))
    return message.frame_id, message.is_fd, sealed(message.frame_id, data)


def channel_signal(name, kind, leg):
    """The DBC's signal of a channel; leg counts from 1."""
    if name == "fd":
        return contract.get_message_by_name("LegSampleFd").get_signal_by_name(f"{kind}_{leg}")
    return contract.get_message_by_name(f"LegSample{leg}").get_signal_by_name(kind)


def largest(name, kind):
    return float(channel_signal(name, kind, 1).maximum)


@st.composite
def samples(draw, name, beyond=1.0):
    """Tick and channels, up to `beyond` times the range."""
    sample = {"tick": draw(uint[32])}
    for field, kind in KINDS.items():
        end = beyond * largest(name, kind)
        sample[field] = [draw(st.floats(-end, end)) for _ in range(6)]
    return sample


def whole_tick(tick):
    return {"counter": tick // 16 % 16, "version": 2, "tick": tick}


def sample_signals(name, sample, frames):
    """What cantools finds in the frames of a sample: {kind: six values}."""
    decoded = [decode(frame) for frame in frames]
    if name == "fd":
        [(_, signals)] = decoded
        assert (signals["tick"], signals["version"]) == (sample["tick"], 2)
        return {kind: [signals[f"{kind}_{leg}"] for leg in range(1, 7)] for kind in KINDS.values()}
    if sample["tick"] % 16 == 0:
        assert decoded.pop(0) == ("SampleTick", whole_tick(sample["tick"]))
    assert [message for message, _ in decoded] == [f"LegSample{leg}" for leg in range(1, 7)]
    assert all(signals["tick_low"] == sample["tick"] % 16 for _, signals in decoded)
    return {kind: [signals[kind] for _, signals in decoded] for kind in KINDS.values()}


@pytest.mark.parametrize("name", PROFILES)
def test_cantools_finds_what_the_firmware_sent_within_half_a_step(name):
    @tuned
    @given(samples(name))
    def check(sample):
        frames, saturated = bus.encode_sample(name, **sample)
        found = sample_signals(name, sample, frames)
        assert saturated == 0
        for field, kind in KINDS.items():
            step = float(channel_signal(name, kind, 1).scale)
            for sent, got in zip(sample[field], found[kind]):
                # the firmware's number is float32, its step too; dividing rounds once more
                assert abs(got - sent) <= 0.5 * step + 2 * FLOAT32_EPSILON * abs(sent)

    check()


@pytest.mark.parametrize("name", PROFILES)
def test_channels_beyond_the_range_are_sent_as_its_end_and_counted(name):
    @tuned
    @given(samples(name, beyond=4.0))
    def check(sample):
        frames, saturated = bus.encode_sample(name, **sample)
        found = sample_signals(name, sample, frames)
        beyond = 0
        for field, kind in KINDS.items():
            end, step = largest(name, kind), float(channel_signal(name, kind, 1).scale)
            for sent, got in zip(sample[field], found[kind]):
                if abs(sent) > end + step:
                    beyond += 1
                    assert got == pytest.approx(math.copysign(end, sent), rel=1e-12)
                if abs(sent) < end:
                    assert abs(got - sent) <= 0.5 * step + 2 * FLOAT32_EPSILON * abs(sent)
        assert beyond <= saturated <= 18

    check()


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize("wrong", [math.inf, -math.inf])
def test_a_channel_that_is_infinite_is_not_sent(name, wrong):
    for channel in range(18):
        sample = {field: [0.0] * 6 for field in KINDS}
        field = list(KINDS)[channel // 6]
        sample[field][channel % 6] = wrong
        with pytest.raises(ValueError, match="value not usable"):
            bus.encode_sample(name, 1, **sample)


def sample_frames(name, sample):
    """By cantools, on the steps; a classic sample begins with its whole tick."""
    if name == "fd":
        signals = {f"{kind}_{leg + 1}": sample[field][leg] for field, kind in KINDS.items() for leg in range(6)}
        return [encode("LegSampleFd", {"tick": sample["tick"], "version": 2, **signals})]
    legs = [
        encode(
            f"LegSample{leg + 1}",
            {"tick_low": sample["tick"] % 16, **{kind: sample[field][leg] for field, kind in KINDS.items()}},
        )
        for leg in range(6)
    ]
    return [encode("SampleTick", whole_tick(sample["tick"])), *legs]


@pytest.mark.parametrize("name", PROFILES)
def test_the_firmware_finds_what_cantools_sent(name):
    @tuned
    @given(samples(name))
    def check(sample):
        # GIVEN channels that cantools encodes (it rounds to the nearest step) and whose steps it knows exactly
        sample["tick"] -= sample["tick"] % 16
        frames = sample_frames(name, sample)
        exact = sample_signals(name, sample, frames)
        # WHEN the firmware puts the frames together
        assembly = bus.SampleAssembly(name)
        results = [assembly.add(frame) for frame in frames]
        # THEN it has the sample, in float32: step and product round once each
        assert [status for status, _ in results[:-1]] == ["more frames needed"] * (len(frames) - 1)
        status, found = results[-1]
        assert status == "ok" and found["tick"] == sample["tick"]
        for field, kind in KINDS.items():
            assert found[field] == pytest.approx(exact[kind], rel=FLOAT32_EPSILON, abs=1e-30)

    check()


@st.composite
def answers(draw):
    filter_code = draw(st.integers(0, 1))
    count = len(PARAMETERS[filter_code])
    return {
        "tick": draw(uint[32]),
        "status": draw(st.integers(-5, 0)),
        "state": draw(st.integers(0, 4)),
        "fault": draw(st.integers(0, 7)),
        "missing_legs": draw(st.integers(0, 63)),
        "filter": filter_code,
        "health": draw(st.integers(0, 65535)),
        "input_cause": draw(st.integers(0, 16)),
        "input_leg": draw(st.integers(0, 6)),
        "refused": draw(uint[32]),
        "value": draw(st.lists(float32, min_size=count, max_size=count)),
        "sigma": draw(st.lists(float32, min_size=count, max_size=count)),
        "parameter_verdict": draw(st.lists(st.integers(0, 3), min_size=count, max_size=count)),
        "verdict": draw(st.integers(0, 3)),
        "nis": draw(float32),
        "nis_mean": draw(float32),
    }


INPUT_FAULT = ("input_cause", "input_leg")


def without_input_fault(answer):
    """As classic answers are: ControllerStatus has it there."""
    return {**answer, **dict.fromkeys(INPUT_FAULT, 0)}


def answer_of(signals):
    """The fields of an answer, from the signals of all its frames."""
    parameters = PARAMETERS[signals["filter"]]
    return {
        **{name: signals[name] for name in ("status", "state", "fault", "missing_legs", "filter", "health", "refused")},
        **{name: signals[name] for name in ("verdict", "nis", "nis_mean")},
        **{name: signals.get(name, 0) for name in INPUT_FAULT},
        "value": [signals[name] for name in parameters],
        "sigma": [signals[f"sigma_{name}"] for name in parameters],
        "parameter_verdict": [signals[f"verdict_{name}"] for name in parameters],
    }


def without_tick(answer):
    return {name: value for name, value in answer.items() if name != "tick"}


@tuned
@given(answers())
def test_cantools_finds_the_answer_that_the_firmware_sent_in_fd(answer):
    decoded = [decode(frame) for frame in bus.encode_answer("fd", answer, 0)]
    assert tuple(name for name, _ in decoded) == FD_ANSWER[answer["filter"]]
    assert all(signals["tick"] == answer["tick"] for _, signals in decoded)
    merged = {name: value for _, signals in decoded for name, value in signals.items()}
    assert answer_of(merged) == without_tick(answer)


@tuned
@given(answers())
def test_cantools_finds_the_answer_that_the_firmware_sent_in_classic_pages(answer):
    merged = {}
    for place, page in enumerate(PAGES[answer["filter"]]):
        [(name, signals)] = map(decode, bus.encode_answer("classic", answer, place))
        assert (name, signals["page"], signals["tick_low"]) == ("AnswerPage", page, answer["tick"] % 2**14)
        assert signals["counter"] == answer["tick"] // 2 % 16
        merged |= signals
    assert answer_of(merged) == without_tick(without_input_fault(answer))


def floored(answer):
    """Within the DBC's ranges, which cantools insists on: the paper's inertias, sigmas and NIS are not negative."""
    signed = 1 if answer["filter"] == 0 else 10
    return {
        **answer,
        "value": [*answer["value"][:signed], *map(abs, answer["value"][signed:])],
        "sigma": [*map(abs, answer["sigma"])],
        "nis": abs(answer["nis"]),
        "nis_mean": abs(answer["nis_mean"]),
    }


def signals_of(answer):
    """With zeros where the other filter has signals in a page of both."""
    parameters = PARAMETERS[answer["filter"]]
    return {
        **{f"verdict_{name}": 0 for name in PARAMETERS[0]},
        **answer,
        **dict(zip(parameters, answer["value"])),
        **{f"sigma_{name}": value for name, value in zip(parameters, answer["sigma"])},
        **{f"verdict_{name}": value for name, value in zip(parameters, answer["parameter_verdict"])},
    }


def chosen(message, signals, page):
    """The signals that a frame has when its multiplexer is `page`."""
    wanted = (signal.name for signal in message.signals if (signal.multiplexer_ids or [page]) == [page])
    return {name: signals[name] for name in wanted if name in signals}


@tuned
@given(answers())
def test_the_firmware_finds_the_answer_that_cantools_sent_in_fd(answer):
    answer = floored(answer)
    assembly = bus.AnswerAssembly("fd")
    for name in FD_ANSWER[answer["filter"]]:
        message = contract.get_message_by_name(name)
        status, found = assembly.add(encode(name, chosen(message, signals_of(answer), answer["filter"])), 0)
    assert status == "ok"
    assert found == answer


ZERO_FIELDS = (
    *INPUT_FAULT,
    "tick",
    "status",
    "state",
    "fault",
    "missing_legs",
    "filter",
    "health",
    "refused",
    "verdict",
)


@tuned
@given(answers())
@example(
    {
        **dict.fromkeys(ZERO_FIELDS, 0),
        "value": [0.0] * 4,
        "sigma": [0.0] * 4,
        "parameter_verdict": [0] * 4,
        "nis": 0.0,
        "nis_mean": 0.0,
    }
)
def test_the_firmware_finds_the_answer_that_cantools_sent_in_classic_pages(answer):
    answer = floored(answer)
    assembly = bus.AnswerAssembly("classic")
    message = contract.get_message_by_name("AnswerPage")
    pages = PAGES[answer["filter"]]
    for place, page in enumerate(pages):
        tick = (answer["tick"] + 2 * place) % 2**32
        signals = {**signals_of(answer), "page": page, "tick_low": tick % 2**14, "counter": tick // 2 % 16}
        status, found = assembly.add(encode("AnswerPage", chosen(message, signals, page)), tick)
        assert status == ("ok" if page == pages[-1] else "more frames needed")
    assert found == without_input_fault(answer)


@tuned
@given(uint[32], uint[16])
def test_load_changes_are_the_same_in_both_directions(tick, load_changes):
    frame = bus.encode_load_change(tick, load_changes)
    name, signals = decode(frame)
    assert (name, signals["tick"], signals["load_changes"]) == ("LoadChange", tick, load_changes)
    again = encode("LoadChange", {"counter": load_changes % 16, "tick": tick, "load_changes": load_changes})
    assert again == frame
    assert bus.decode_load_change(again) == ("ok", {"tick": tick, "load_changes": load_changes})


def command_signals(kind, argument, configuration):
    """Those of the command's page."""
    pages = {
        1: {"pacing": int(argument), "configuration": configuration},
        4: {"estimator": int(argument)},
        5: {"known_mass": argument},
    }
    return pages.get(kind, {})


mass = st.floats(-(2.0**19), 2.0**19, width=32)
commands = st.one_of(
    st.tuples(st.just(1), st.integers(0, 1).map(float), st.integers(0, 2**24 - 1)),
    st.tuples(st.sampled_from((2, 3)), st.just(0.0), st.just(0)),
    st.tuples(st.just(4), st.integers(0, 2).map(float), st.just(0)),
    st.tuples(st.just(5), mass, st.just(0)),
)
numbers = {bits: st.integers(0, 2**bits - 1) for bits in (4, 12)}


@tuned
@given(commands, numbers[4], numbers[4], numbers[12])
def test_commands_are_the_same_in_both_directions(command, counter, source, session):
    kind, argument, configuration = command
    frame = bus.encode_command(kind, counter, argument, source, session, configuration)
    name, signals = decode(frame)
    head = {"counter": counter, "command": kind, "source": source, "session": session}
    assert (name, signals) == ("Command", {**head, **command_signals(kind, argument, configuration)})
    again = encode("Command", signals)
    assert again == frame
    fields = {"kind": kind, "source": source, "session": session, "sequence": counter}
    assert bus.decode_command(again) == ("ok", {**fields, "argument": argument, "configuration": configuration})


@st.composite
def acknowledges(draw):
    names = {"kind": (1, 6), "result": (0, 6), "state": (0, 4), "fault": (0, 7), "profile": (0, 1)}
    numbered = {"source": 15, "session": 4095, "sequence": 15, "counter": 15, "known_mass_crc": 255}
    return {
        **{name: draw(st.integers(*ends)) for name, ends in names.items()},
        **{name: draw(st.integers(0, largest)) for name, largest in numbered.items()},
    }


@tuned
@given(acknowledges())
def test_acknowledges_are_the_same_in_both_directions(fields):
    frame = bus.encode_acknowledge(fields)
    name, signals = decode(frame)
    expected = dict(fields)
    expected["command"] = expected.pop("kind")
    assert (name, signals) == ("Acknowledge", expected)
    again = encode("Acknowledge", expected)
    assert again == frame
    assert bus.decode_acknowledge(again) == ("ok", fields)


STATUS_PAGES = [  # page -> {signal: field}
    {"version_major": None, "version_minor": None, "version_patch": None, "profile": "profile"},
    {"tick": "tick"},
    {"overruns": "overruns"},
    {"stack_margin": "stack_margin_bytes"},
    {"time_margin": "time_margin_us"},
    {"samples_missing": "samples_missing"},
    {"frames_refused": "frames_refused"},
    {"samples_refused": "samples_refused"},
    {"load_changes": "load_changes", "input_cause": "input_cause", "input_leg": "input_leg"},
    {"known_mass": "known_mass_kg"},
    {"configuration": "configuration"},
    {"excess_force": "excess_force_n"},
]


@st.composite
def statuses(draw):
    counters = ("tick", "overruns", "stack_margin_bytes", "samples_missing", "frames_refused", "samples_refused")
    return {
        "version": [draw(uint[8]) for _ in range(3)],
        "counter": draw(numbers[4]),
        "profile": draw(st.integers(0, 1)),
        "state": draw(st.integers(0, 4)),
        "fault": draw(st.integers(0, 7)),
        "time_margin_us": draw(st.integers(-(2**31), 2**31 - 1)),
        **{name: draw(uint[32]) for name in counters},
        "load_changes": draw(uint[16]),
        "input_cause": draw(st.integers(0, 16)),
        "input_leg": draw(st.integers(0, 6)),
        "known_mass_kg": draw(st.floats(0.0, 1e6, width=32)),
        "configuration": draw(uint[32]),
        "excess_force_n": draw(st.floats(-1e6, 1e6, width=32)),
    }


@tuned
@given(statuses())
def test_status_pages_are_the_same_in_both_directions(status):
    versions = dict(zip(("version_major", "version_minor", "version_patch"), status["version"]))
    for page, fields in enumerate(STATUS_PAGES):
        expected = {signal: versions[signal] if field is None else status[field] for signal, field in fields.items()}
        head = {"counter": status["counter"], "page": page, "state": status["state"], "fault": status["fault"]}
        frame = bus.encode_status(status, page)
        name, signals = decode(frame)
        assert (name, signals) == ("ControllerStatus", {**head, **expected})
        again = encode("ControllerStatus", {**head, **expected})
        assert again == frame
        result, found = bus.decode_status(again)
        assert result == "ok"
        assert all(found[field] == status[field] for field in fields.values() if field)
        assert page > 0 or found["version"] == status["version"]


def decoders():
    """One function of a frame for every way in."""
    return [
        bus.decode_command,
        bus.decode_acknowledge,
        bus.decode_status,
        bus.decode_load_change,
        *(bus.SampleAssembly(name).add for name in PROFILES),
        *map(answer_decoder, PROFILES),
    ]


def answer_decoder(profile_name):
    assembly = bus.AnswerAssembly(profile_name)
    return lambda frame: assembly.add(frame, 1000)


identifiers = st.one_of(st.integers(0, 2**11 - 1), st.sampled_from([m.frame_id for m in contract.messages]))


@settings(max_examples=3000, deadline=None)
@given(identifiers, st.booleans(), st.binary(max_size=64), st.booleans())
def test_random_bytes_are_refused_or_are_what_cantools_reads(identifier, is_fd, data, is_sealed):
    message = next((m for m in contract.messages if m.frame_id == identifier), None)
    if is_sealed and len(data) > 1:
        data = sealed(identifier, data)
    frame = (identifier, is_fd, data)
    statuses_found = [decoder(frame)[0] for decoder in decoders()]
    if message is None or identifier in end_to_end.UNCHECKED:  # the latter by tests/unit/test_authentication.c
        assert set(statuses_found) == {"frame of another kind"}
    elif (is_fd, len(data)) != (message.is_fd, message.length):
        assert set(statuses_found) == {"frame of another kind", "wrong length or format"}
    elif data != sealed(identifier, data):
        assert set(statuses_found) == {"frame of another kind", "wrong checksum"}
    elif message.name == "Command" and data[1] >> 4 not in range(1, 7):
        assert "ok" in statuses_found  # to be acknowledged as unknown
    elif "ok" in statuses_found:
        decode(frame)
    elif profile(message) != "both":
        assert "frame of the other profile" in statuses_found


def test_the_number_that_a_range_leaves_unused_is_a_channel_without_sensor():
    # GIVEN the most negative 24-bit and 19-bit numbers, sealed, as displacement of leg 1
    fd = (0x080, True, sealed(0x080, bytes(4) + bytes([0, 0, 0x80]) + bytes(51) + bytes([2, 0]) + bytes(4)))
    classic = (0x081, False, sealed(0x081, struct.pack("<Q", 1 << (12 + 18))))
    # WHEN they come THEN that channel is no number, and all others are there; of the classic frame five legs are missing
    status, sample = bus.SampleAssembly("fd").add(fd)
    assert status == "ok"
    assert [leg for leg in range(6) if math.isnan(sample["displacement_m"][leg])] == [0]
    assert not any(math.isnan(value) for field in ("velocity_m_s", "force_n") for value in sample[field])
    assert bus.SampleAssembly("classic").add(classic)[0] != "value not usable"
