"""MCAP logs, for Foxglove and PlotJuggler: leg samples and estimates as JSON messages with their schemas.

Written are /hexload/legs (displacement_m, velocity_m_s, force_n, six numbers each) and /hexload/estimate (a number of each
column of an estimates file, and the verdict). Read is that topic, or any JSON topic by a column map, whose names are
topic.field[number]; the time is that of the log.
"""

import csv
import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.writer import Writer

from hexload.errors import InputError
from hexload.io.column_map import ColumnMap
from hexload.io.log_columns import LEGS, WITHOUT_VELOCITY, select
from hexload.io.log_file import LegLog

LEG_TOPIC, ESTIMATE_TOPIC = "/hexload/legs", "/hexload/estimate"
FIELDS = {"displacement_m": "dl", "velocity_m_s": "vl", "force_n": "f"}
NS = 1_000_000_000


def read_mcap(path: Path, columns: ColumnMap, home_leg_length_m: Sequence[float] | None) -> LegLog:
    """Raises InputError."""
    try:
        with path.open("rb") as stream:
            first = _first_of_each_topic(path, stream)
        topics = [LEG_TOPIC] if columns.is_empty and LEG_TOPIC in first else list(first)
        names = ["t", *(name for topic in topics for name in first[topic])]
        chosen = select(f"{path}:", names, columns, home_leg_length_m)
        with path.open("rb") as stream:
            rows = np.array(list(_rows(stream, [names[k] for k in chosen.positions])))
    except (McapError, ValueError, OSError) as error:
        raise InputError(f"{path}: found damaged or incomplete data, expected MCAP ({error})") from None
    if len(rows) < 2:
        raise InputError(f"{path}: found {len(rows)} messages with these channels, expected at least 2")
    values = chosen.to_si(rows)
    if chosen.channels == WITHOUT_VELOCITY:
        values = np.insert(values, [7] * len(LEGS), np.nan, axis=1)
    return table_log(path, values, chosen.remarks)


def table_log(path: Path, values: np.ndarray, remarks: tuple[str, ...]) -> LegLog:
    """Of (n, 19) in the order of COLUMNS. Raises InputError where time does not go on, or a number is infinite."""
    wrong = np.flatnonzero(~(np.diff(values[:, 0]) > 0.0))
    if wrong.size:
        before, t_s = values[wrong[0] : wrong[0] + 2, 0]
        raise InputError(
            f"{path}: message {wrong[0] + 2}: found time {t_s:.9g} s after {before:.9g} s, expected a later one"
        )
    if np.isinf(values).any():
        row = int(np.flatnonzero(np.isinf(values).any(axis=1))[0])
        raise InputError(f"{path}: message {row + 1}: found a value that is no finite number, expected one")
    parts = (values[:, 0], values[:, 1:7], values[:, 7:13], values[:, 13:19])
    return LegLog(*(np.ascontiguousarray(part) for part in parts), remarks)


def _first_of_each_topic(path: Path, stream) -> dict[str, dict[str, float]]:
    """Of topics whose messages are JSON, their first one."""
    first: dict[str, dict[str, float]] = {}
    others = set()
    summary = make_reader(stream).get_summary()
    channels = list(summary.channels.values()) if summary is not None else []
    for channel in channels:
        if channel.message_encoding != "json":
            others.add(f"{channel.topic} ({channel.message_encoding})")
            continue
        stream.seek(0)
        for _, _, message in make_reader(stream).iter_messages(topics=[channel.topic]):
            first[channel.topic] = _flat(channel.topic, json.loads(message.data))
            break
    if not first:
        seen = ", ".join(sorted(others)) or "none"
        raise InputError(
            f"{path}: found no topic of JSON messages, expected {LEG_TOPIC} or a column map; the topics are {seen}"
        )
    return first


def _rows(stream, names: list[str]) -> Iterator[list[float]]:
    """Of the one topic that has all names."""
    for _, channel, message in make_reader(stream).iter_messages():
        if channel.message_encoding != "json":
            continue
        values = _flat(channel.topic, json.loads(message.data))
        values["t"] = message.log_time / NS
        if all(name in values for name in names):
            yield [values[name] for name in names]


def _flat(topic: str, value: object, name: str = "") -> dict[str, float]:
    """Numbers by name; null is not a number."""
    if isinstance(value, dict):
        parts = [(f"{name}.{key}" if name else f"{topic}.{key}", part) for key, part in value.items()]
    elif isinstance(value, list):
        parts = [(f"{name}[{k}]", part) for k, part in enumerate(value)]
    else:
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        return {_own_name(name): float(value)} if is_number else {_own_name(name): math.nan} if value is None else {}
    return {key: number for part, each in parts for key, number in _flat(topic, each, part).items()}


def _own_name(name: str) -> str:
    """dl1 for displacement_m[0] of the topic that hexload writes."""
    field, bracket, number = name.removeprefix(f"{LEG_TOPIC}.").partition("[")
    is_own = name.startswith(f"{LEG_TOPIC}.") and field in FIELDS and bracket
    return f"{FIELDS[field]}{int(number.rstrip(']')) + 1}" if is_own else name


def write_mcap(path: Path, parts: Iterator[LegLog], estimates: Path | None) -> int:
    """Returns the rows written. `estimates`: a file of hexload replay that goes beside them."""
    rows = 0
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(library="hexload")
        legs = _channel(writer, LEG_TOPIC, {name: _numbers(6) for name in FIELDS})
        for part in parts:
            for message in _messages(part):
                _add(writer, legs, *message)
            rows += len(part.t_s)
        if estimates is not None:
            _write_estimates(writer, estimates)
        writer.finish()
    return rows


def _messages(part: LegLog) -> Iterator[tuple[float, dict]]:
    channels = [part.displacement_m, part.velocity_m_s, part.force_n]
    lists = [np.where(np.isnan(values), None, values.astype(object)).tolist() for values in channels]
    for t_s, *values in zip(part.t_s.tolist(), *lists):
        yield t_s, dict(zip(FIELDS, values))


def _write_estimates(writer: Writer, estimates: Path) -> None:
    with estimates.open(newline="", encoding="utf-8") as stream:
        rows = csv.DictReader(stream)
        names = [name for name in rows.fieldnames or () if name not in ("t", "verdict")]
        if not names or "t" not in rows.fieldnames:
            raise InputError(f"{estimates}: line 1: found no columns t and others, expected a file of hexload replay")
        channel = _channel(
            writer, ESTIMATE_TOPIC, {name: {"type": "number"} for name in names} | {"verdict": {"type": "string"}}
        )
        for row in rows:
            numbers = {name: float(row[name]) for name in names}
            finite = {name: value if math.isfinite(value) else None for name, value in numbers.items()}
            _add(writer, channel, float(row["t"]), finite | {"verdict": row.get("verdict", "")})


def _channel(writer: Writer, topic: str, properties: dict) -> int:
    schema = json.dumps({"type": "object", "properties": properties}).encode()
    schema_id = writer.register_schema(topic.removeprefix("/").replace("/", "."), "jsonschema", schema)
    return writer.register_channel(topic, "json", schema_id)


def _numbers(count: int) -> dict:
    return {"type": "array", "items": {"type": "number"}, "minItems": count, "maxItems": count}


def _add(writer: Writer, channel: int, t_s: float, content: dict) -> None:
    at_ns = round(t_s * NS)
    if at_ns < 0:
        raise InputError(f"t: found {t_s:g} s, expected no time before 0 in MCAP")
    writer.add_message(channel, at_ns, json.dumps(content).encode(), at_ns)
