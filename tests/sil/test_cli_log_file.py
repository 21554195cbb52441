"""The log reader: what it accepts, and every refusal with its message."""

import codecs
import gzip

import numpy as np
import pytest

from hexload.errors import InputError
from hexload.io import log_file
from hexload.io.log_file import COLUMNS, read_log

HEADER = ",".join(COLUMNS)


def row(t, **changes):
    values = {name: f"{index}.5" for index, name in enumerate(COLUMNS)} | {"t": t} | changes
    return ",".join(values[name] for name in COLUMNS)


def log_of(tmp_path, *lines, name="log.csv"):
    path = tmp_path / name
    path.write_text("".join(f"{line}\n" for line in lines))
    return path


def refusal(path):
    with pytest.raises(InputError) as refused:
        read_log(path)
    return str(refused.value)


def test_a_log_is_read_into_time_displacement_velocity_and_force(tmp_path):
    # GIVEN a log of two rows whose values number the columns
    path = log_of(tmp_path, HEADER, row("0"), row("0.001"))
    # WHEN it is read
    log = read_log(path)
    # THEN each channel holds its own columns, leg 1 first
    np.testing.assert_array_equal(log.t_s, [0.0, 0.001])
    np.testing.assert_array_equal(log.displacement_m[0], [1.5, 2.5, 3.5, 4.5, 5.5, 6.5])
    np.testing.assert_array_equal(log.velocity_m_s[0], [7.5, 8.5, 9.5, 10.5, 11.5, 12.5])
    np.testing.assert_array_equal(log.force_n[1], [13.5, 14.5, 15.5, 16.5, 17.5, 18.5])


def test_a_compressed_log_reads_as_the_plain_one(tmp_path):
    # GIVEN the same log plain and compressed
    plain = log_of(tmp_path, HEADER, row("0"), row("0.001"))
    packed = tmp_path / "log.csv.gz"
    packed.write_bytes(gzip.compress(plain.read_bytes()))
    # WHEN both are read THEN they are equal
    np.testing.assert_array_equal(read_log(packed).force_n, read_log(plain).force_n)


def test_missing_ticks_windows_line_ends_and_blank_last_lines_are_accepted(tmp_path):
    # GIVEN a log with a gap of three ticks, CRLF line ends, a byte order mark and a blank line at its end
    path = tmp_path / "log.csv"
    path.write_bytes("\ufeff".encode() + f"{HEADER}\r\n{row('0.010')}\r\n{row('0.014')}\r\n\r\n".encode())
    # WHEN it is read THEN it has the two rows
    np.testing.assert_array_equal(read_log(path).t_s, [0.010, 0.014])


def test_a_log_that_does_not_exist_is_refused(tmp_path):
    assert refusal(tmp_path / "no.csv") == f"{tmp_path}/no.csv: found no such file, expected a log (.csv or .csv.gz)"


def test_a_folder_is_refused(tmp_path):
    assert refusal(tmp_path) == f"{tmp_path}: found a folder, expected a log (.csv or .csv.gz)"


def test_an_empty_log_is_refused(tmp_path):
    path = log_of(tmp_path)
    assert refusal(path) == (
        f"{path}: found an empty file, expected the header t,dl1..dl6,vl1..vl6,f1..f6 and at least 2 rows"
    )


def test_a_missing_leg_is_named(tmp_path):
    # GIVEN a log of five legs
    header = ",".join(name for name in COLUMNS if not name.endswith("4"))
    path = log_of(tmp_path, header, "0", "0")
    # WHEN it is read THEN the message names the first missing column and its leg
    # AND the option by which it may have another name
    assert refusal(path) == (
        f"{path}: line 1: found no column dl4 (leg 4), expected the header t,dl1..dl6,vl1..vl6,f1..f6; the columns are 't', "
        "'dl1', 'dl2', 'dl3', 'dl5', 'dl6', 'vl1', 'vl2', ...: say which is which, --columns 'dl4 = \"NAME [m]\"', or in a "
        "file (.toml)"
    )


def test_a_missing_time_column_is_named(tmp_path):
    path = log_of(tmp_path, ",".join(COLUMNS[1:]), "0", "0")
    assert refusal(path).startswith(
        f"{path}: line 1: found no column t, expected the header t,dl1..dl6,vl1..vl6,f1..f6;"
    )


def test_columns_of_no_channel_are_left_out_and_named_once(tmp_path):
    # GIVEN a log with two columns more, one of them words WHEN it is read
    extra = [f"{row(t)},warm,3" for t in ("0", "0.001")]
    log = read_log(log_of(tmp_path, HEADER + ",weather,note", *extra))
    # THEN they are left out, and that is said
    assert log.force_n[1, 5] == 18.5
    assert log.remarks == ("2 columns of no channel left out: weather, note",)


def test_columns_come_in_any_order(tmp_path):
    # GIVEN a log with its columns the other way round WHEN it is read THEN each is where it belongs
    lines = [",".join(reversed(line.split(","))) for line in (HEADER, row("0"), row("0.001"))]
    backwards, plain = read_log(log_of(tmp_path, *lines)), read_log(log_of(tmp_path, HEADER, row("0"), row("0.001")))
    np.testing.assert_array_equal(backwards.t_s, plain.t_s)
    np.testing.assert_array_equal(backwards.displacement_m, plain.displacement_m)
    np.testing.assert_array_equal(backwards.force_n, plain.force_n)


def test_a_column_that_comes_twice_is_refused(tmp_path):
    path = log_of(tmp_path, HEADER + ",f6", row("0"), row("0.001"))
    assert refusal(path) == f"{path}: line 1: found 2 columns f6, expected it once"


@pytest.mark.parametrize("rows", [[], [row("0")]])
def test_a_log_of_fewer_than_two_rows_is_refused(tmp_path, rows):
    path = log_of(tmp_path, HEADER, *rows)
    assert refusal(path) == f"{path}: found {len(rows)} rows after the header, expected at least 2"


@pytest.mark.parametrize("value", ["inf", "-inf", "twelve", "1_000", "1e999"])
def test_a_value_that_is_no_finite_number_is_refused_with_line_and_column(tmp_path, value):
    # GIVEN a log with a bad force of leg 2 in its third line
    path = log_of(tmp_path, HEADER, row("0"), row("0.001", f2=value))
    # WHEN it is read THEN the message names the place
    assert refusal(path) == f"{path}: line 3: column f2: found '{value}', expected a finite number"


@pytest.mark.parametrize("value", ["nan", "NaN", "", " "])
def test_a_value_that_is_missing_is_nan(tmp_path, value):
    # GIVEN a log without the force of leg 2, the velocity of leg 3 and the displacement of leg 5 in its third line
    # WHEN it is read
    log = read_log(log_of(tmp_path, HEADER, row("0"), row("0.001", f2=value, vl3=value, dl5=value)))
    # THEN these three are nan, and nothing else is
    assert np.argwhere(np.isnan(log.force_n)).tolist() == [[1, 1]]
    assert np.argwhere(np.isnan(log.velocity_m_s)).tolist() == [[1, 2]]
    assert np.argwhere(np.isnan(log.displacement_m)).tolist() == [[1, 4]]
    # AND the machine has velocity sensors
    assert log.has_velocity
    # AND who needs all of them is told of the first
    with pytest.raises(InputError, match="log.csv: row 2 at 0.001 s: found no dl5, expected a log without missing"):
        log.whole("log.csv")


@pytest.mark.parametrize("value", ["nan", ""])
def test_a_time_that_is_missing_is_refused_with_line_and_column(tmp_path, value):
    path = log_of(tmp_path, HEADER, row("0"), row(value))
    assert refusal(path) == f"{path}: line 3: column t: found '{value}', expected a finite number"


@pytest.mark.parametrize(("line", "found"), [("0.001,1,2", 3), (row("0.001") + ",7", 20), ("", 1)])
def test_a_ragged_row_is_refused_with_its_line(tmp_path, line, found):
    path = log_of(tmp_path, HEADER, row("0"), line, row("0.002"))
    assert refusal(path) == f"{path}: line 3: found {found} values, expected 19"


def test_time_that_runs_backwards_is_refused_with_its_line(tmp_path):
    path = log_of(tmp_path, HEADER, row("0"), row("0.002"), row("0.001"))
    assert refusal(path) == (
        f"{path}: line 4: column t: found 0.001 after 0.002, time running backwards; expected a later time"
    )


def test_a_repeated_time_is_refused_with_its_line(tmp_path):
    path = log_of(tmp_path, HEADER, row("0"), row("0.002"), row("0.002"))
    assert refusal(path) == (
        f"{path}: line 4: column t: found 0.002 after 0.002, the same time again; expected a later time"
    )


def test_damaged_compression_is_refused(tmp_path):
    # GIVEN a compressed log that lost its second half
    path = tmp_path / "log.csv.gz"
    whole = gzip.compress("\n".join([HEADER, row("0"), row("0.001")]).encode())
    path.write_bytes(whole[: len(whole) // 2])
    # WHEN it is read THEN it is refused
    assert refusal(path) == f"{path}: found damaged or incomplete gzip data, expected a .csv.gz log"


def test_a_plain_file_with_the_compressed_suffix_is_refused(tmp_path):
    path = log_of(tmp_path, HEADER, name="log.csv.gz")
    assert refusal(path) == f"{path}: found damaged or incomplete gzip data, expected a .csv.gz log"


@pytest.mark.parametrize("name", ["log.csv", "log.csv.gz"])
@pytest.mark.parametrize("encoding", ["latin-1", "utf-8", "utf-8-sig", "utf-16", "utf-16-be with its mark"])
def test_a_log_is_read_in_every_encoding_that_recorders_write(tmp_path, encoding, name):
    # GIVEN a log with a comment and a unit that are not ASCII, in some encoding
    header = HEADER.replace("dl1", "dl1 [µm]")
    text = f"# Prüfstand, 20 °C\n{header}\n{row('0')}\n{row('0.001')}\n"
    raw = codecs.BOM_UTF16_BE + text.encode("utf-16-be") if "mark" in encoding else text.encode(encoding)
    path = tmp_path / name
    path.write_bytes(gzip.compress(raw) if name.endswith(".gz") else raw)
    # WHEN it is read THEN its numbers and units are, and of Latin-1, which no mark tells, that it was taken for it
    log = read_log(path)
    np.testing.assert_allclose(log.displacement_m[0], [1.5e-6, 2.5, 3.5, 4.5, 5.5, 6.5])
    assert ("read as Latin-1: line 1 has byte 0xfc, which is no UTF-8" in log.remarks) == (encoding == "latin-1")


def test_a_log_in_utf_16_longer_than_what_is_read_at_once_is_read_whole(tmp_path, monkeypatch):
    # GIVEN a log of many blocks WHEN it is read THEN it has each of its rows
    monkeypatch.setattr(log_file, "BLOCK_BYTES", 4093)
    rows = [row(f"0.{k:06d}") for k in range(1000)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([HEADER, *rows]), encoding="utf-16")
    np.testing.assert_allclose(read_log(path).t_s, 1e-6 * np.arange(1000), atol=1e-12)


def test_bytes_that_are_no_text_are_refused(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(f"{HEADER}\n".encode() + b"0,\x01\xfe")
    assert refusal(path) == f"{path}: line 2: found byte 0x01 at offset {len(HEADER) + 3}, expected CSV as text"


def test_utf_16_without_its_mark_is_refused_with_what_to_do(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(HEADER.encode("utf-16-le"))
    assert refusal(path) == (
        f"{path}: line 1: found byte 0x00 at offset 1, expected CSV as text; of UTF-16 without its mark: "
        "iconv -f utf-16le -t utf-8 log.csv > utf8.csv"
    )


def test_a_line_that_is_none_of_a_log_is_not_read_to_its_end(tmp_path):
    # GIVEN 64 KB of gzip that hold a line of 64 MB WHEN it is read THEN it is refused after a bounded part of it
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(f"{HEADER}\n".encode() + b"0" * (1 << 26), 9))
    assert refusal(path) == f"{path}: line 2: found more than 65536 bytes, expected a row of a log"
