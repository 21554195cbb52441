"""Logs of other people's recorders: the same samples, however they are written, are read as the same log."""

import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from hexload.cli.convert import convert
from hexload.errors import InputError
from hexload.estimation.input_check import WayIn
from hexload.estimation.replay import _Thinned, replay_log
from hexload.io import log_file
from hexload.io.column_map import read_column_map
from hexload.io.log_file import LegLog, joined, read_log
from hexload.io.log_formats import Reading, read_any_log, read_parts
from test_replay_bus_logs import frames_of, quantised

ROWS = 40
LEGS = range(1, 7)
PLATFORM = Path(__file__).parents[1] / "data" / "unknown_load.toml"
HOME_M = (0.8741,) * 6


def made(rows: int = ROWS) -> LegLog:
    """Channels that are all different, with digits that every unit below can say."""
    t_s = np.arange(rows) / 1000
    one = np.arange(6) + 10 * np.arange(rows)[:, None]
    return LegLog(t_s, one * 1e-5, one * 1e-3 - 0.05, one * 1.0 - 100)


def table(log: LegLog) -> dict[str, np.ndarray]:
    legs = {"dl": log.displacement_m, "vl": log.velocity_m_s, "f": log.force_n}
    return {"t": log.t_s} | {f"{name}{leg}": legs[name][:, leg - 1] for name in legs for leg in LEGS}


def write(
    path: Path, columns: dict[str, np.ndarray], separator: str = ",", before: str = "", comma: bool = False
) -> Path:
    lines = [separator.join(columns)]
    for row in zip(*columns.values()):
        cells = [cell if isinstance(cell, str) else f"{cell:.10g}" for cell in row]
        lines.append(separator.join(cell.replace(".", ",") if comma else cell for cell in cells))
    path.write_text(before + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def assert_same(found: LegLog, expected: LegLog) -> None:
    for name in ("t_s", "displacement_m", "velocity_m_s", "force_n"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-9, atol=1e-12)


def test_units_in_the_headings_are_understood(tmp_path):
    # GIVEN time in ms, displacements in mm, velocities in mm/s, forces in kN, in brackets WHEN the log is read
    units = {"t": (" [ms]", 1e3), "d": (" [mm]", 1e3), "v": (" (mm/s)", 1e3), "f": (" [kN]", 1e-3)}
    columns = {name + units[name[0]][0]: values * units[name[0]][1] for name, values in table(made()).items()}
    log = read_log(write(tmp_path / "log.csv", columns))
    # THEN it is in SI, which is said
    assert_same(log, made())
    assert log.remarks == ("made SI by the units of the columns: dl, f, t, vl",)


def test_a_line_of_units_below_the_header_and_lines_before_it_are_understood(tmp_path):
    columns = table(made())
    path = write(tmp_path / "log.txt", columns, "\t", before="Recorder 7\nStation\tA\n\n")
    lines = path.read_text().splitlines()
    lines.insert(
        4,
        "\t".join(
            "s" if name == "t" else "m" if name[0] == "d" else "m/s" if name[0] == "v" else "N" for name in columns
        ),
    )
    path.write_text("\n".join(lines) + "\n")
    assert_same(read_log(path), made())


def test_a_header_without_a_channel_is_to_blame_not_the_lines_before_it(tmp_path):
    columns = {name: values for name, values in table(made()).items() if name != "f4"}
    path = write(tmp_path / "log.csv", columns, before="Recorder 7\n\n")
    with pytest.raises(InputError, match=r"line 3: found no column f4 \(leg 4\)"):
        read_log(path)


def test_semicolons_with_decimal_commas_are_understood(tmp_path):
    assert_same(read_log(write(tmp_path / "log.csv", table(made()), ";", comma=True)), made())


@pytest.mark.parametrize("date", ["", "2026-11-22 ", "2026-11-22T"])
def test_time_of_a_clock_is_understood_also_over_midnight(date, tmp_path):
    # GIVEN a log from 23:59:59.980 on, with the date or without WHEN it is read
    times = [
        date + f"23:59:59.{980 + k}" if k < 20 else date.replace("22", "23") + f"00:00:00.{k - 20:03d}"
        for k in range(ROWS)
    ]
    log = read_log(write(tmp_path / "log.csv", table(made()) | {"t": times}))
    # THEN time counts from its first row, which is said
    np.testing.assert_allclose(log.t_s, made().t_s, atol=1e-9)
    assert log.remarks == (f"t counts from the log's first row, {times[0]}",)


def test_time_since_1970_counts_from_the_first_row(tmp_path):
    columns = table(made())
    lines = [f"{1795363200 + t:.3f}" for t in columns["t"]]
    log = read_log(write(tmp_path / "log.csv", columns | {"t": lines}))
    np.testing.assert_allclose(log.t_s, made().t_s, atol=1e-6)


def test_a_column_map_says_names_units_and_signs(tmp_path):
    # GIVEN columns of a recorder's own names, absolute lengths in mm, pulling forces positive, no velocities to speak of
    log = made()
    columns = {"Zeit": log.t_s * 1e3, "Temp": np.full(ROWS, 20.0)}
    for leg in LEGS:
        columns |= {
            f"Cyl {leg} [mm]": 1e3 * (log.displacement_m[:, leg - 1] + HOME_M[0]),
            f"Cell {leg}": -log.force_n[:, leg - 1],
        }
    path = write(tmp_path / "log.csv", columns)
    (tmp_path / "map.toml").write_text('t = { column = "Zeit", unit = "ms" }\nl = "Cyl {leg}"\nf = "Cell {leg}"\n')
    # WHEN it is read with a map, a file and a line THEN it is the same log, without velocities
    given = read_column_map([str(tmp_path / "map.toml"), "f = { sign = -1 }"])
    found = read_log(path, given, HOME_M)
    np.testing.assert_allclose(found.displacement_m, log.displacement_m, atol=1e-9)
    np.testing.assert_allclose(found.force_n, log.force_n)
    assert not found.has_velocity
    assert "1 column of no channel left out: Temp" in found.remarks


def test_chamber_pressures_of_a_cylinder_are_a_force(tmp_path):
    # GIVEN a log of cylinders whose chambers' pressures are measured, in bar and in the same row, the ring's at 40 to 60 bar
    log, cap_m2, ring_m2 = made(), 3.117e-3, 2.137e-3
    ring_pa = np.linspace(40e5, 60e5, 6 * ROWS).reshape(ROWS, 6)
    cap_pa = (log.force_n + ring_m2 * ring_pa) / cap_m2
    columns = {name: values for name, values in table(log).items() if name[0] != "f"}
    columns |= {f"pA{leg} [bar]": cap_pa[:, leg - 1] / 1e5 for leg in LEGS}
    columns |= {f"pB{leg} [bar]": ring_pa[:, leg - 1] / 1e5 for leg in LEGS}
    path = write(tmp_path / "log.csv", columns)
    # WHEN the map says the areas THEN the forces are there, less an offset that is said too
    areas = f"area_m2 = {cap_m2}, rod_column = 'pB{{leg}}', rod_area_m2 = {ring_m2}"
    found = read_log(path, read_column_map([f"f = {{ column = 'pA{{leg}}', {areas} }}", "f2 = { offset = -7.0 }"]))
    offset_n = np.array([0.0, -7.0, 0.0, 0.0, 0.0, 0.0])
    tenth_digit_pa = 0.5e-8 * 1e5  # of pressures of 10 to 100 bar
    np.testing.assert_allclose(found.force_n, log.force_n + offset_n, atol=(cap_m2 + ring_m2) * tenth_digit_pa)
    np.testing.assert_allclose(found.displacement_m, log.displacement_m)
    assert "force of legs 1, 2, 3, 4, 5, 6 from the pressures of both chambers" in found.remarks
    # AND without areas, what is missing
    with pytest.raises(InputError, match=r"found the unit 'bar', expected N, .* area_m2, rod_column and rod_area_m2"):
        read_log(path, read_column_map(["f = 'pA{leg}'"]))


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("dl = [", "found no valid TOML"),
        ("f = { area_m2 = 0 }", "area_m2: found 0, expected an area in m2"),
        (
            "f = { area_m2 = 1e-3, rod_column = 'p{leg}' }",
            "found part of two chambers, expected area_m2, rod_column and",
        ),
        ("f = { area_m2 = 1e-3, rod_column = 'p', rod_area_m2 = 1e-3 }", "found 'p' for six legs, expected {leg}"),
        ("dl = { area_m2 = 1e-3 }", "found an area, expected it of a force alone"),
        ("f = { area_m2 = 1e-3, unit = 'kN' }", "found the unit 'kN', expected Pa, kPa, MPa, bar"),
        ("g1 = 'x'", "g1: found no such channel"),
        ("dl = 'x'", "found 'x' for six legs, expected {leg} in it"),
        ("f = { unit = 'bar' }", "found the unit 'bar', expected N, kN"),
        ("f = { sign = 2 }", "sign: found 2, expected 1 or -1"),
        ("f = { scale = 2 }", "expected a column's name, or column, unit, sign, offset"),
        ("t = 'Time'", "found no column 'Time' for t, expected one of 't', 'dl1'"),
    ],
)
def test_a_wrong_map_is_refused(line, says, tmp_path):
    path = write(tmp_path / "log.csv", table(made()))
    with pytest.raises(InputError) as refused:
        read_log(path, read_column_map([line]))
    assert says in str(refused.value)


def test_contradicting_units_are_refused(tmp_path):
    path = write(
        tmp_path / "log.csv", {name.replace("dl1", "dl1 [m]"): values for name, values in table(made()).items()}
    )
    with pytest.raises(InputError, match="found the unit m, and mm in the column map"):
        read_log(path, read_column_map(['dl1 = "dl1 [mm]"']))


def test_a_log_is_the_same_in_any_number_of_parts(tmp_path, monkeypatch):
    # GIVEN blocks of 700 bytes, some four rows WHEN a log is read THEN nothing is lost between them
    path = write(tmp_path / "log.csv", table(made()))
    monkeypatch.setattr(log_file, "BLOCK_BYTES", 700)
    parts = list(read_parts(path, Reading()))
    assert len(parts) > 5
    assert_same(joined(parts), made())
    # AND the line of what is wrong is that of the file
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:30], lines[30].replace(",", ",x", 1), *lines[31:]]))
    with pytest.raises(InputError, match="line 31: column dl1: found 'x"):
        list(read_parts(path, Reading()))


def test_resampling_meets_a_line_and_leaves_gaps(tmp_path):
    # GIVEN rows of a line at irregular times with a gap of 8 ms WHEN they are resampled to 1 ms, in parts
    late = np.random.default_rng(3).uniform(0.0, 4e-4, ROWS)
    rows = np.array([k for k in range(ROWS) if not 20 <= k < 27])
    t_s = (np.arange(ROWS) * 1e-3 + late - late[0])[rows]
    line = np.outer(t_s, np.arange(1.0, 7.0))
    path = write(tmp_path / "log.csv", table(LegLog(t_s, 1e-3 * line, 1e-2 * line, 10 * line)))
    found = read_any_log(path, Reading(resample_s=1e-3))
    # THEN what lies between rows is on the line, and what lies in the gap is not there
    np.testing.assert_allclose(found.force_n, 10 * np.outer(found.t_s, np.arange(1.0, 7.0)), atol=1e-6)
    ticks = np.round(found.t_s / 1e-3).astype(int)
    assert not set(range(21, 27)) & set(ticks.tolist()) and len(ticks) > 30
    np.testing.assert_allclose(found.t_s, ticks * 1e-3, atol=1e-12)
    assert found.remarks[0].startswith("resampled to 1 ms")


def test_what_is_kept_of_a_long_log_is_every_second_row():
    kept = _Thinned()
    whole = made(450_000)
    for start in range(0, 450_000, 41_000):
        kept.add(whole.rows(slice(start, start + 41_000)))
    assert kept.rows == 450_000
    np.testing.assert_array_equal(kept.log.t_s, whole.t_s[::4])
    # AND nothing that it keeps holds on to the parts that it came in
    assert not any(np.shares_memory(part.t_s, whole.t_s) for part in kept._kept[1:])


def test_mcap_carries_log_and_estimates(tmp_path):
    # GIVEN a log, with a force missing, and its estimates WHEN they are converted to MCAP
    log = made()
    log.force_n[3, 2] = np.nan
    path = write(tmp_path / "log.csv", table(log))
    (tmp_path / "e.csv").write_text("t,m,s_m,nis,verdict\n0,300.5,2,nan,converging\n0.001,300.6,1.5,5.9,converged\n")
    rows, _ = convert(path, tmp_path / "log.mcap", (), None, None, tmp_path / "e.csv")
    assert rows == ROWS
    # THEN it is read as the same log
    assert_same(read_any_log(tmp_path / "log.mcap"), log)
    # AND other people's reader finds both topics, with schemas, in time
    from mcap.reader import make_reader

    with (tmp_path / "log.mcap").open("rb") as stream:
        seen = [(c.topic, s.encoding, m.log_time, m.data) for s, c, m in make_reader(stream).iter_messages()]
    assert sum(topic == "/hexload/legs" for topic, *_ in seen) == ROWS
    assert [m for m in seen if m[0] == "/hexload/estimate"][1][2:] == (
        1_000_000,
        b'{"m": 300.6, "s_m": 1.5, "nis": 5.9, "verdict": "converged"}',
    )
    assert {encoding for _, encoding, *_ in seen} == {"jsonschema"}
    # AND another topic's fields are columns
    given = read_column_map(["dl = '/hexload/legs.x{leg}'"])
    with pytest.raises(InputError, match="found no column '/hexload/legs.x1' for dl1"):
        read_any_log(tmp_path / "log.mcap", Reading(given))


def test_mf4_is_read_by_its_channels_names_and_units(tmp_path):
    from asammdf import MDF, Signal

    # GIVEN channels in mm and kN, and one of another group at other times WHEN the file is read
    log = made()
    signals = []
    for leg in LEGS:
        signals.append(Signal(log.displacement_m[:, leg - 1] * 1e3, log.t_s, unit="mm", name=f"Cyl{leg}"))
        signals.append(Signal(log.force_n[:, leg - 1] * 1e-3, log.t_s, unit="kN", name=f"f{leg}"))
    slow = Signal(log.force_n[::2, 5] * 1e-3, log.t_s[::2], unit="kN", name="f6")
    with MDF() as mdf:
        mdf.append(signals[:-1])
        mdf.append([slow])
        mdf.save(tmp_path / "log.mf4", overwrite=True)
    found = read_any_log(tmp_path / "log.mf4", Reading(read_column_map(["dl = 'Cyl{leg}'"])))
    # THEN it is the log in SI, and what was done is said
    np.testing.assert_allclose(found.displacement_m, log.displacement_m, atol=1e-12)
    np.testing.assert_allclose(found.force_n[:-1], log.force_n[:-1])  # a line, which is met between its rows
    assert found.remarks[-1] == "channels of other times are put on those of dl1, by straight lines"


def test_who_listens_on_a_bus_does_not_wait_for_what_reads_mf4():
    # GIVEN a fresh process WHEN it has imported what listens on a bus THEN what python-can imports for MF4, ten times as
    # long as the rest, is not there AND an MF4 can be read all the same
    script = """
        import sys, hexload.view.bus_listener
        assert not {"asammdf", "pandas"} & set(sys.modules)
        import hexload.io.mf4_log
        assert "asammdf" in sys.modules
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(script)], check=True)


def test_trc_is_read_by_the_bus_contract(tmp_path):
    import can

    log = quantised(made(), "classic")
    path = tmp_path / "log.trc"
    with can.TRCWriter(path) as writer:
        for number, message in enumerate(frames_of(log, "classic")):
            message.timestamp, message.channel = 1.0 + number * 1e-4, 1
            writer(message)
    assert_same(read_any_log(path), log)


def test_damaged_files_of_each_kind_are_refused(tmp_path):
    write(tmp_path / "log.csv", table(made()))
    convert(tmp_path / "log.csv", tmp_path / "whole.mcap", (), None, None, None)
    for name, start in (
        ("cut.mcap", (tmp_path / "whole.mcap").read_bytes()[:900]),
        ("cut.mf4", b"MDF     4.10    " * 9),
    ):
        (tmp_path / name).write_bytes(start)
        with pytest.raises(InputError, match="damaged or incomplete data"):
            read_any_log(tmp_path / name)
    with pytest.raises(InputError, match="expected a name that ends in .csv, .csv.gz, .mcap"):
        convert(tmp_path / "log.csv", tmp_path / "log.xlsx", (), None, None, None)
    assert not list(tmp_path.glob(".*.part"))


def test_a_recorders_clock_may_drift(tmp_path):
    # GIVEN rows 40 ppm farther apart than the ticks, whose period is the median's rounded WHEN 20 s are replayed
    data = read_log(PLATFORM.with_name("work_motion.csv.gz"))
    path = write(
        tmp_path / "log.csv", table(LegLog(data.t_s * 1.00004, data.displacement_m, data.velocity_m_s, data.force_n))
    )
    result = replay_log(path, PLATFORM, None, None, tmp_path / "e.csv", way_in=WayIn())
    # THEN no row is refused and no tick is missing
    assert result["refused"] == 0 and result["missing"][0] == 0 and result["ticks"] == len(data.t_s)


def test_ticks_without_rows_are_said(tmp_path):
    data = read_log(PLATFORM.with_name("work_motion.csv.gz")).rows(slice(3000))
    kept = data.rows(np.delete(np.arange(3000), [500, 700, 701]))
    path = write(tmp_path / "log.csv", table(kept))
    result = replay_log(path, PLATFORM, None, None, tmp_path / "e.csv", way_in=WayIn())
    assert result["remarks"] == (
        "3 ticks of 1 ms have no row (0.1 %), the longest gap, of 2, ends at 0.702 s: they are lost samples to the estimator",
    )


def test_peak_memory_does_not_grow_with_the_log(tmp_path):
    """By the parts that are alive: each is let go before the next but one is read."""
    path = write(tmp_path / "log.csv", table(made(3000)))
    size = path.stat().st_size
    log_file_block = log_file.BLOCK_BYTES
    try:
        log_file.BLOCK_BYTES = size // 50
        sizes = [len(part.t_s) for part in read_parts(path, Reading())]
    finally:
        log_file.BLOCK_BYTES = log_file_block
    assert max(sizes) < 3000 // 20 and sum(sizes) == 3000
