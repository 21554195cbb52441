"""The emulated controller's 1 ms clock, by a timer of its board and in the application; all in the machine's time."""

import numpy as np
import pytest

from hexload_dev import mps2, target
from slcan_peer import CONTRACT, Peer

ENTRY = np.dtype([(name, "<u4") for name in ("counts", "us", "periods", "returns")])  # as in programs/ticks.c
TICKS = 1000
COUNTS_PER_MS = 25_000
COUNTS_PER_US = 25
# From the interrupt to the timer's reading: an instruction takes 64 ns, and there are fewer than 80 of them, which
# include a reading of the clock. Between the readings of timer and clock there are fewer than 20.
LATENCY_COUNTS = 80 * 64 / 40
READING_US = 20 * 0.064
BY_INSTRUCTIONS = ("-icount", "shift=0")  # the machine's time stands still while the host does something else
PAGES = len(CONTRACT.get_message_by_name("ControllerStatus").get_signal_by_name("page").choices)
ROUNDS = 5


@pytest.mark.parametrize("preset", target.CORTEX_M7.values())
def test_the_tick_is_a_millisecond_of_the_board(preset, tmp_path):
    # GIVEN a program that waits for the next millisecond, a thousand times
    target.run(preset, "ticks", ["out"], tmp_path)
    entries = np.fromfile(tmp_path / "out", ENTRY)
    assert len(entries) == TICKS + 2
    ticks = {name: entries[name][:TICKS].astype(np.int64) for name in ENTRY.names}
    # WHEN it looks at the board's timer each time THEN each millisecond is one, and nothing adds up
    assert (ticks["periods"] == 1).all()
    elapsed = ticks["counts"] - ticks["counts"][0]
    drift = elapsed - COUNTS_PER_MS * np.arange(TICKS)
    print(f"{preset}: {TICKS} ticks, off by {drift.min()} to {drift.max()} counts of 40 ns")
    assert np.abs(drift).max() <= LATENCY_COUNTS
    # AND the clock's microseconds are the timer's
    late = ticks["us"] - ticks["us"][0] - elapsed / COUNTS_PER_US
    assert np.abs(late).max() <= 1 + READING_US
    assert (entries["returns"] == 0).all()
    # AND after a computation of three and a half milliseconds three have begun, and then one
    assert entries["periods"][TICKS:].tolist() == [3, 1]


def test_an_idle_controller_misses_no_period(tmp_path):
    # GIVEN the application WHEN its status, a page every 50 periods, goes round a few times
    with mps2.running_mps2(tmp_path, options=BY_INSTRUCTIONS) as controller:
        with Peer(controller.python_can_channel) as peer:
            pages = [peer.status() for _ in range(ROUNDS * PAGES + 1)]
    # THEN the pages follow each other, none lost
    order = [page["page"] for page in pages]
    assert order == [(order[0] + n) % PAGES for n in range(len(order))]
    # AND no period was missed, no frame refused, and there is stack that was never used
    told = {name: value for page in pages for name, value in page.items()}
    assert (told["overruns"], told["frames_refused"], told["fault"]) == (0, 0, 0)
    assert 1024 <= told["stack_margin"] < 8192
    print(f"stack never used: {told['stack_margin']:.0f} of 8192 bytes")
