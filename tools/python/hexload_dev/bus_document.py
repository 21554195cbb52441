"""Writes the document of the CAN contract, firmware/bus/README.md, from hexload.dbc.

Frames, signals, bus load, quantisation. `tools/hexload bus-document` writes it anew after a change of the DBC; a test fails
while it is out of date.
"""

import math
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cantools.database.can import Database, Message, Signal

from hexload.io.atomic_file import replaced_when_done
from hexload.io.python_can import cantools
from hexload.project import ROOT, SCENARIOS

DBC = ROOT / "firmware" / "bus" / "hexload.dbc"
DOCUMENT = DBC.with_name("README.md")
PLATFORM = SCENARIOS / "platforms" / "paper.toml"

MOST_LOAD = 0.9  # part of the time that the bus is busy, in the worst case
MOST_QUANTISATION = 0.1  # rms error over nominal noise

NOMINAL_BIT_S = 1e-6
DATA_MBIT_S = 5  # of FD, the rate that the contract is laid out for
OTHER_DATA_MBIT_S = (2, 4, 8)


def load_contract() -> Database:
    return cantools.database.load_file(DBC)


# Frames


def profile(message: Message) -> str:
    """fd, classic or both."""
    attribute = message.dbc.attributes.get("HexloadProfile")
    return ("fd", "classic", "both")[attribute.value] if attribute else "both"


def filter_of(message: Message) -> str:
    """paper, momentum or both: the filter that answers with it."""
    attribute = message.dbc.attributes.get("HexloadFilter")
    return ("paper", "momentum", "both")[attribute.value] if attribute else "both"


def messages_of(contract: Database, name: str, filter_name: str) -> list[Message]:
    """Of a profile, with answers of a filter."""
    return [
        message
        for message in contract.messages
        if profile(message) in (name, "both") and filter_of(message) in (filter_name, "both")
    ]


def classic_bits(length: int) -> int:
    """Longest classic data frame with an 11-bit identifier, interframe space included."""
    return 8 * length + 44 + (34 + 8 * length - 1) // 4 + 3


@dataclass(frozen=True)
class FdBits:
    """Longest FD data frame with an 11-bit identifier and bit-rate switch, interframe space included.

    A bit in which the rate changes (BRS, CRC delimiter) is counted at the nominal rate, which is the longer.
    """

    nominal: int
    data: int


def fd_bits(length: int) -> FdBits:
    head, tail = 17, 13  # SOF .. BRS; CRC delimiter, ACK, its delimiter, EOF, interframe space
    crc, fixed_stuff = (17, 6) if length <= 16 else (21, 7)
    stuff = (head + 5 + 8 * length - 1) // 4  # in SOF .. data field
    head_stuff = (head - 1) // 4  # at most so many of them at the nominal rate
    return FdBits(head + head_stuff + tail, 5 + 8 * length + stuff - head_stuff + 4 + crc + fixed_stuff)


def frame_time_s(message: Message, data_mbit_s: float) -> float:
    if not message.is_fd:
        return classic_bits(message.length) * NOMINAL_BIT_S
    bits = fd_bits(message.length)
    return bits.nominal * NOMINAL_BIT_S + bits.data * 1e-6 / data_mbit_s


def load(message: Message, data_mbit_s: float) -> float:
    """Part of the time that the frame keeps the bus busy; 0 for one that is sent on demand."""
    return frame_time_s(message, data_mbit_s) / (message.cycle_time * 1e-3) if message.cycle_time else 0.0


def bus_load(contract: Database, name: str, filter_name: str, data_mbit_s: float = DATA_MBIT_S) -> float:
    """Of all cyclic frames of a profile with answers of a filter, at a nominal rate of 1 Mbit/s."""
    return sum(load(message, data_mbit_s) for message in messages_of(contract, name, filter_name))


FLOOD_FRAMES_S = 50 + 50 + 100  # acknowledges of refusals, challenges for guesses and for questions
CODE_PERIOD_S = 16e-3
PAGE_CODE_PERIOD_S = 64e-3  # of answers in the classic profile
CODE_INSTRUCTIONS = {"command": 5_281, "fd": 3_110, "classic": 2_695}  # -R budget, on 2026-11-23
ANSWER_CODE_INSTRUCTIONS = {"fd": 7_474, "classic": 441}  # of the momentum filter, the same; 4,602 of the paper's in fd
SAMPLE_INSTRUCTIONS = {"fd": 32_331, "classic": 32_606}  # the longest of the paper's motion, the same
UNPROTECTED_TICK_BYTES = 4  # of SampleTick in version 1 of the contract, which had no checksum there and in the legs


def protection_load(contract: Database) -> float:
    """By which the end-to-end protection makes the classic bus busier."""
    message = contract.get_message_by_name("SampleTick")
    more_bits = classic_bits(message.length) - classic_bits(UNPROTECTED_TICK_BYTES)
    return more_bits * NOMINAL_BIT_S / (message.cycle_time * 1e-3)


# Quantisation


def nominal_noise() -> dict[str, float]:
    """Standard deviation of the paper platform's sensors, by the first word of the signal's name."""
    with PLATFORM.open("rb") as file:
        sensors = tomllib.load(file)["sensors"]
    return {
        "displacement": sensors["displacement_sigma_m"],
        "velocity": sensors["velocity_sigma_m_s"],
        "force": sensors["force_sigma_n"],
    }


@dataclass(frozen=True)
class Quantisation:
    message: str
    signal: str
    unit: str
    step: float
    noise: float

    @property
    def rms_error(self) -> float:
        """Of rounding to the nearest step: step / sqrt(12)."""
        return self.step / math.sqrt(12)

    @property
    def ratio(self) -> float:
        return self.rms_error / self.noise


def quantisations(contract: Database) -> Iterator[Quantisation]:
    """Of every signal that carries a sensor's channel."""
    noise = nominal_noise()
    for message in contract.messages:
        for signal in message.signals:
            kind = signal.name.split("_")[0]
            if kind in noise:
                yield Quantisation(message.name, signal.name, signal.unit, float(signal.scale), noise[kind])


# The document

FILTER_TITLES = {"paper": "the paper's filter", "momentum": "the momentum filter"}
ANSWER_PAGES = {"paper": 13, "momentum": 26}  # of one answer


def answer_age_ticks(contract: Database, pages: int) -> int:
    """From the tick that an answer describes to that of its last page."""
    return (pages - 1) * contract.get_message_by_name("AnswerPage").cycle_time


def number(value: float) -> str:
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else f"{value:.10g}"


def table(header: list[str], rows: list[list[str]]) -> list[str]:
    lines = [header, ["---"] * len(header), *rows]
    return ["| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines] + [""]


def rate(message: Message) -> str:
    return f"{message.cycle_time} ms" if message.cycle_time else "on demand"


def frames_table(contract: Database) -> list[str]:
    return table(
        ["id", "name", "profile", "format", "bytes", "sender", "every", "what"],
        [
            [
                f"`0x{message.frame_id:03X}`",
                message.name,
                profile(message),
                "FD" if message.is_fd else "classic",
                str(message.length),
                ", ".join(message.senders),
                rate(message),
                message.comment,
            ]
            for message in contract.messages
        ],
    )


def signal_type(signal: Signal) -> str:
    if signal.is_float:
        return f"float{signal.length}"
    return f"{'i' if signal.is_signed else 'u'}{signal.length}"


FLOAT32_MAX = float.fromhex("0x1.fffffep127")


def signal_range(signal: Signal) -> str:
    if signal.is_float and signal.maximum == FLOAT32_MAX:
        return "0 or more" if signal.minimum == 0 else "any finite"
    return f"{number(float(signal.minimum))} .. {number(float(signal.maximum))}"


def meaning(signal: Signal) -> str:
    if not signal.choices:
        return signal.comment
    return signal.comment + " " + ", ".join(f"{code} {name}" for code, name in sorted(signal.choices.items())) + "."


def signals_table(message: Message) -> list[str]:
    return table(
        ["signal", "page", "bits", "type", "factor", "range", "unit", "what"],
        [
            [
                signal.name,
                ", ".join(map(str, signal.multiplexer_ids or [])),
                f"{signal.start} .. {signal.start + signal.length - 1}",
                signal_type(signal),
                number(float(signal.scale)),
                signal_range(signal),
                signal.unit or "code",
                meaning(signal),
            ]
            for signal in sorted(message.signals, key=lambda signal: (signal.multiplexer_ids or [-1], signal.start))
        ],
    )


def load_table(contract: Database, name: str, filter_name: str) -> list[str]:
    rows = [
        [
            message.name,
            rate(message),
            f"{frame_time_s(message, DATA_MBIT_S) * 1e6:.1f}",
            f"{100 * load(message, DATA_MBIT_S):.2f}",
        ]
        for message in messages_of(contract, name, filter_name)
        if message.cycle_time
    ]
    total = ["**all**", "", "", f"**{100 * bus_load(contract, name, filter_name):.2f}**"]
    return table(["frame", "every", "longest, us", "load, %"], [*rows, total])


def other_rates(contract: Database, filter_name: str) -> str:
    loads = [
        f"{100 * bus_load(contract, 'fd', filter_name, mbit_s):.1f} % at {mbit_s} Mbit/s"
        for mbit_s in OTHER_DATA_MBIT_S
    ]
    return f"With other data rates: {', '.join(loads)}. Above 100 % the profile does not fit at 1 kHz.\n"


def quantisation_table(contract: Database) -> list[str]:
    return table(
        ["frame", "signal", "step", "rms error", "nominal noise", "unit", "error / noise"],
        [
            [q.message, q.signal, number(q.step), f"{q.rms_error:.3g}", number(q.noise), q.unit, f"{q.ratio:.3f}"]
            for q in quantisations(contract)
            if q.message in ("LegSampleFd", "LegSample1") and q.signal[-1] not in "23456"
        ],
    )


FRAMES_TEXT = """\
# The CAN contract

Written by `tools/hexload bus-document` from [hexload.dbc](hexload.dbc) and
[paper.toml](../../host_sim/scenarios/platforms/paper.toml): change those, not this page.

Two profiles carry the same quantities, with 11-bit identifiers and little-endian signals. The **fd** profile sends a leg
sample in one frame and answers it with three. The **classic** profile, for controllers and adapters without FD, sends a leg
sample in six frames of 8 bytes and one page of the answer at every second tick. Frames marked *both* are the same in either.

The command *select filter* says which estimator runs from the next start on. The paper's filter answers with four parameters:
EstimateFd, SigmaFd and HealthFd, or 13 pages. The momentum filter, with actuator effects or without, answers with all ten:
LoadFd, LoadSigmaFd and HealthFd, or 26 pages. A round of pages describes one tick, so that a classic answer is
{paper_age} ticks (paper) or {momentum_age} ticks (momentum) old when its last page comes. A load change is reported at once: by LoadChange, before the answer to the sample at which it was
detected; by the health bit in that answer, or in the next page 0; and by a count that stays in ControllerStatus.

Each frame is protected end to end, and commands by a key, see below. Channels beyond a signal's range arrive as its end, and are counted; the most negative number of a channel is not used. Numbers that are not finite are not sent, and are
refused when they come. C code: [bus.h](bus.h) for single frames, [sample_assembly.h](sample_assembly.h) and
[answer_assembly.h](answer_assembly.h) for whole samples and answers.

## Frames
"""

PROTECTION_TEXT = """\
## End-to-end protection

In the manner of AUTOSAR's "E2E Protocol Specification", since version 2 of this contract. A Data ID that is not sent is counted
into each checksum, so that a frame under another one's identifier has a wrong one.

| frames | profile | checksum | counter | Data ID |
| --- | --- | --- | --- | --- |
| classic, up to 8 bytes | 22 | CRC-8H2F in byte 0, over the bytes after it and the Data ID | low half of byte 1 | (id xor id / 16) modulo 256, the same for each counter, which leaves the CRC its Hamming distance of 4 |
| FD | as 4, without its header | CRC-32P4 in the last four bytes, over the bytes before it and the Data ID, least significant byte first | the tick, 32 bits, in the first four | 0x484C0000 + id |

What the reader does:

- A wrong length, format, checksum, or a counter that contradicts the frame's own tick or count: the frame is refused and counted; ten
  in a second set the health bit *frames refused*.
- A leg sample, or one of its frames, that comes twice: refused, not answered. With other content: two sources, the fault *second source*. Late
  ones are refused; 60 of them in a second, or 100 samples in a row, are that fault too.
- A sample more than 1000 ticks ahead is refused and not answered, whatever number of them comes: the line of ticks that is followed stays so while its
  source sends. When that has been silent for half its time-out (50 ms, 5 s in lockstep) and 20 have followed one another where they
  are, the controller goes on there; not when samples have codes.
- In the classic profile the legs' four bits count the tick. SampleTick sets the rest when a run begins or the tick was lost; from then on
  it confirms what the legs count. Another one is refused until the next one follows it, with 16 ticks of legs between them when they are
  ahead: then it is believed, and when it goes back, legs of another source have driven the count ahead, the fault *second source*.
- A command with the counter of its session's last one: refused, and not acknowledged; with other content the fault *second source*.
  START is refused (*other configuration*) when the source works with another configuration than the controller.
- An answer's frame that comes twice or late: counted, not used. One that says something else than the last of its kind and tick, or more
  than half of all frames stale: two controllers, and the simulator ends.
- A controller's frame, or a sample of the other profile: a fault when three whole ones come within a second.
- An acknowledge is its reader's own when source and session are.

Protection keeps accidents out: lost, doubled, late, damaged and misdirected frames, a second simulator, a wrong file. It has no
key: who forges frames on purpose and knows this page is not kept out by it.

## Authentication of commands

In the manner of AUTOSAR's "Specification of Secure Onboard Communication": a controller with a key of 128 bits accepts
commands only from holders of the same key. Challenge and response:

1. The command *challenge*, which needs no key, is answered by Challenge with a number that is used once.
2. A command is two frames: Command, and CommandMac with 64 bits of its AES-CMAC (RFC 4493, NIST SP 800-38B) over 20 bytes: the
   Data ID 0x484C0011, least significant byte first, the number, the eight bytes of Command.
3. The controller compares, takes another number whatever came of it, tells that by Challenge, and acknowledges.

So a recorded command is worth nothing, and one with other bytes neither. What the controller does:

- A Command whose code does not come within 50 ms, or before another Command, is refused: counted among the refused frames, and
  acknowledged as *not authenticated*, 50 times a second at most.
- After a code that does not match, none is looked at for 20 ms. So 50 in a second can be guessed at, each of them right once in
  2^64 times.
- The number is the first 64 bits of a CMAC too, over the Data ID 0x484C0111, a seed that the port gives once per start and never
  twice, and a count. So no start repeats another's numbers, and nobody foretells one to have it answered beforehand.
- Without a key a controller carries out anybody's commands, and says *unknown command* to *challenge*.

What it costs: a command {command_instructions} instructions more on a Cortex-M7 with AES in software ([budget.toml](../../tests/budget/budget.toml)).

## Authentication of samples

As an option, to a controller with a key and in either profile: a START whose pacing says *with codes* promises a SampleMac behind each 16
ticks. Its CMAC goes over the Data ID 0x484C0087, the number that START's own code counted in, the first of the 16 ticks, and all bytes
of the leg frames. So neither a run recorded before nor other frames with right checksums are taken for the source's. A code that does not match
although all 16 ticks have come ends the run in the fault *samples not authenticated*, and so do more than four times 16 ticks without a
code that matches: forged samples are believed for 80 ticks at most. A lost frame costs its sixteen their code and no more, which leaves
one way: who keeps all frames of the source off the bus, speaks in its place for at most four times 16 ticks, leaves a tick or the code
out, and then lets it go on. Those samples are in the estimate, as far as its gate and the monitors of load and channels let them. It is told: the
health bit *frames refused* is set from the first of the next sixteen on, for a second at least, the count of refused frames in
ControllerStatus goes up by one for each sixteen without their code, and stays; simulator and `watch` make an event of it. The verdict does not
tell, by construction: samples are used when they come and proven after, and a frame that is lost leaves sixteen good samples
without their code just so. HEXLOAD_NODE_UNPROVEN ([node.h](../app/node.h)) is the limit of four: with 1, for a bus that loses nothing, the first
sixteen without a code end the run. SampleTick is not counted in; it cannot make another tick of the frames, which would not match.

What it costs: 135 us in 16 ms, {code_load:.2f} % of the bus, {classic_load:.2f} % in all in the classic profile; a sample {fd_instructions} instructions more (fd) or {classic_instructions} (classic), {fd_share:.0f} and {classic_share:.0f} %
of the momentum filter's at -O3, by AES in software.

## Authentication of answers

As an option, likewise: a START whose pacing says *with answer codes* asks for an AnswerMac behind the answers to each 16 ticks (fd) or 64
(classic), and before the acknowledge of a STOP for those that are left. Its CMAC goes over the Data ID 0x484C0107, the number that START's
own code counted in, the first of the ticks, and all bytes of the answer frames that were sent since the last AnswerMac. Who has the key too
(the simulator with `--answer-codes`, `watch --key`) computes it as they come:

- A code that does not match although whole answers to all the ticks have come: some of them are another's, forged or of a run before.
  The simulator ends (status 5), `watch` tells it as an event.
- A code that does not match where frames were lost tells nothing. More than four times 16 (64) ticks of estimates without a code that
  matches are another's too: no accident does that. So forged answers are believed for 16 ticks (classic: 64) when they are complete, and for
  80 (320) at most.
- A listener that has not heard the START knows no number to count in, and checks nothing of that run.

What it costs: 135 us in 16 ms, {code_load:.2f} % of the bus, in the fd profile; 135 us in 64 ms, {page_code_load:.2f} %, in the classic one, {classic_both_load:.2f} % in
all with the codes of samples: with a code for 16 ticks that would be {classic_too_much:.2f} %, above the {most_load:.0f} % of this contract. A sample {answer_instructions}
instructions more on average, by AES in software: {answer_shares} of the momentum filter's at -O3. The checksums of FD frames stay, for readers without the key.

The frames of authentication have no checksum: a damaged one makes a code that does not match. LoadChange, status and acknowledges have no
code: who forges them can end a run, or lie about its events; estimates with codes are not theirs to change. Who keeps the bus busy can keep
commands and samples out. On LCM nothing is authenticated. C code: [authentication.h](authentication.h), [sample_code.h](sample_code.h),
[answer_code.h](answer_code.h), [cmac.h](cmac.h); the key is the port's, and AES: its hardware's, or mbedTLS.
"""

LOAD_TEXT = """\
## Bus load

Longest frames, with worst-case bit stuffing and the interframe space of 3 bits; n is the number of data bytes.

- Classic, 11-bit identifier: 8n + 44 + floor((34 + 8n - 1) / 4) + 3 bits.
- FD (ISO 11898-1:2015), 11-bit identifier, bit-rate switch. At the nominal rate: 17 bits from SOF to BRS, up to 4 stuff bits
  among them, and 13 from the CRC delimiter to the end of the interframe space. At the data rate: 5 bits (ESI, DLC), 8n, the rest
  of the floor((22 + 8n - 1) / 4) stuff bits up to the end of the data, 4 of the stuff count, a CRC of 17 bits with 6 fixed stuff
  bits (n <= 16) or of 21 bits with 7. BRS and CRC delimiter, in which the rate changes, are counted at the nominal rate.

Protection adds {added:.2f} % to the classic load: the two bytes by which SampleTick has grown; the legs gave up room for theirs, see
Quantisation. It adds nothing to FD frames.

Commands, acknowledges and LoadChange come on demand, {command_us:.0f} us each at 1 Mbit/s, and are not in the sums. A command to a
controller with a key is four frames in place of two, {authenticated_us:.0f} us, six with its *challenge*. Who floods the bus with commands is told
so by 50 acknowledges, 50 challenges for guesses and 100 for questions a second at most: {flood:.1f} % of the bus.
"""

QUANTISATION_TEXT = """\
## Quantisation

Rounding to the nearest step makes an error of step / sqrt(12) rms. Nominal noise is that of the paper's platform. Legs 2 to 6 are
like leg 1.
"""


def authentication_numbers(contract: Database) -> dict[str, float | str]:
    """What codes cost: load of the bus in %, instructions."""
    code_s = classic_bits(8) * NOMINAL_BIT_S
    load_of_codes, load_of_page_codes = code_s / CODE_PERIOD_S, code_s / PAGE_CODE_PERIOD_S
    classic_load = bus_load(contract, "classic", "momentum") + load_of_codes
    shares = [f"{100 * ANSWER_CODE_INSTRUCTIONS[name] / SAMPLE_INSTRUCTIONS[name]:.0f}" for name in SAMPLE_INSTRUCTIONS]
    return {
        "code_load": 100 * load_of_codes,
        "classic_load": 100 * classic_load,
        "page_code_load": 100 * load_of_page_codes,
        "classic_both_load": 100 * (classic_load + load_of_page_codes),
        "classic_too_much": 100 * (classic_load + load_of_codes),
        "most_load": 100 * MOST_LOAD,
        "answer_instructions": " (fd) or ".join(f"{count:,}" for count in ANSWER_CODE_INSTRUCTIONS.values())
        + " (classic)",
        "answer_shares": f"{shares[0]} and {shares[1]} %",
        **{f"{name}_instructions": f"{count:,}" for name, count in CODE_INSTRUCTIONS.items()},
        **{f"{name}_share": 100 * CODE_INSTRUCTIONS[name] / SAMPLE_INSTRUCTIONS[name] for name in SAMPLE_INSTRUCTIONS},
    }


def document() -> str:
    contract = load_contract()
    ages = {f"{name}_age": answer_age_ticks(contract, pages) for name, pages in ANSWER_PAGES.items()}
    lines = [FRAMES_TEXT.format(**ages), *frames_table(contract), "## Signals", ""]
    for message in contract.messages:
        lines += [f"### `0x{message.frame_id:03X}` {message.name}", "", message.comment, "", *signals_table(message)]
    command_us = classic_bits(8) * NOMINAL_BIT_S * 1e6
    numbers = {
        "command_us": command_us,
        "authenticated_us": 4 * command_us,
        "flood": FLOOD_FRAMES_S * command_us * 1e-4,
    }
    lines += [
        PROTECTION_TEXT.format(**authentication_numbers(contract)),
        LOAD_TEXT.format(**numbers, added=100 * protection_load(contract)),
    ]
    lines += ["### Classic at 1 Mbit/s, either filter", "", *load_table(contract, "classic", "momentum")]
    for filter_name, title in FILTER_TITLES.items():
        lines += [f"### FD at 1 Mbit/s, data at {DATA_MBIT_S} Mbit/s, {title}", ""]
        lines += [*load_table(contract, "fd", filter_name), other_rates(contract, filter_name)]
    lines += [QUANTISATION_TEXT, *quantisation_table(contract)]
    return "\n".join(lines).rstrip("\n") + "\n"


def write_document() -> Path:
    with replaced_when_done(DOCUMENT) as part:
        part.write_text(document())
    return DOCUMENT
