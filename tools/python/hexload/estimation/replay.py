"""`hexload replay`: runs the firmware's own C over a recorded log."""

from pathlib import Path
from types import ModuleType

import numpy as np

from hexload.diagnosis.diagnose import Diagnosis, diagnose
from hexload.diagnosis.machine import in_time, machine_of, with_rig
from hexload.diagnosis.record import LONGEST_S
from hexload.errors import InputError
from hexload.estimation import load_summary, stray
from hexload.estimation.commanded import follow
from hexload.estimation.firmware_run import FirmwareReplay, load_platform, native_firmware
from hexload.estimation.input_check import REFUSED, InputCheck, WayIn, gaps_in_words, input_in_words
from hexload.estimation.rig_file import MACHINE_KEYS, platform_with_rig
from hexload.estimation.tare import MachineTare, tare_for
from hexload.io.atomic_file import replaced_or_none, replaced_when_done
from hexload.io.log_file import LegLog, joined
from hexload.io.log_formats import read_parts
from hexload.io.progress import progress_of
from hexload.io.toml_document import guessed_in_words, read_toml
from hexload.theory import workspace
from hexload.theory.machine_findings import findings_of

MOST_ROWS = 200_000  # that are kept of a log
DIAGNOSED_S = LONGEST_S + 1.0  # of its end
NO_SENSORS = "velocities left out: the platform file has no sensors.velocity_sigma_m_s, or says velocity = false"
ROWS_BEFORE = 8  # of a part, which taking the legs' mass off its first rows looks at: 5 are needed


def replay_log(
    log: Path,
    platform_file: Path,
    estimator: str | None,
    prior: str | None,
    out: Path,
    tare: Path | None = None,
    bodies: Path | None = None,
    report: Path | None = None,
    trace: Path | None = None,
    rig: Path | None = None,
    way_in: WayIn | None = None,
    commanded: Path | None = None,
) -> dict:
    """Writes the estimates CSV to `out`, one row per log row, and returns what hexload_native.replay returns, with
    `has_rig`, `guessed` of the platform in words, `diagnosis`, `input_words`, what is wrong with the log's channels, `rows` of the log and the reader's remarks. Of a log of
    more than MOST_ROWS rows only every second, fourth, ... row is in the result's arrays, and on the page.

    `estimator` and `prior` override the platform file's [estimator] table. `tare`: file of `hexload tare`, made with
    the same platform; `rig`: of `hexload commission`, likewise. `bodies`: a CSV for the load as a body, one row per log row.
    `report`: a page. `trace`: a CSV of each tick's measurement update. `way_in`: how the log is read and checked.
    `commanded`: the motion that was commanded; the result then has `followed`, which leg is which.
    """
    _refuse_same_files({"--out": out, "--bodies": bodies, "--report": report, "--trace": trace})
    way_in = way_in or WayIn()
    render_replay = _page_writer(report)
    native = native_firmware()
    if rig is not None and tare is not None:
        raise InputError("--rig: found it with --tare, expected one of the two: a rig file says what a tare file says")
    platform = load_platform(native, platform_file)
    if rig is not None:
        platform = platform_with_rig(rig, native, platform)
    found = None if tare is None else tare_for(tare, native, platform, platform_file)
    files = f"{log} with {platform_file}" + "".join(f" and {file}" for file in (tare, rig) if file is not None)
    with (
        replaced_when_done(out) as temporary,
        replaced_or_none(bodies) as body_file,
        replaced_or_none(trace) as trace_file,
        replaced_or_none(report) as page,
    ):
        run = _Run(native, platform, log, way_in, found)
        try:
            result = run.whole((temporary, estimator, prior), body_file, trace_file)
        except ValueError as error:
            raise InputError(f"{files}: {error}{_mend(str(error))}") from None
        _judge(result, run, platform, platform_file, rig)
        if commanded is not None:
            followed = result["followed"] = follow(result["log"], platform, commanded)
            result["input_words"] = followed.contradiction or result["input_words"]
        if page is not None:
            beside = "".join(
                f" and the {what} {file.name}" for what, file in (("tare", tare), ("rig", rig)) if file is not None
            )
            description = f"Replayed with {platform_file.name}{beside}."
            page.write_text(render_replay(result, platform, log.name, description), encoding="utf-8")
    return result


def _judge(result: dict, run: "_Run", platform, platform_file: Path, rig: Path | None) -> None:
    """Adds to the estimates what is wrong with the log, the machine or its file."""
    result["has_rig"] = rig is not None
    result["diagnosis"] = _diagnosis(result, joined(run.recent), platform, rig)
    result["input_words"] = result["input_words"] or result["diagnosis"].input_words
    if result["verdict"][-1] in ("misfit", "inconsistent"):
        strays = run.strays_in_words if result["diagnosis"].cause is None else ""
        result["input_words"] = result["input_words"] or strays or _geometry_in_words(platform_file)
    result["guessed"] = guessed_in_words(platform_file, MACHINE_KEYS["platform"]) if rig is None else ""


class _Run:
    """The firmware over a log, part by part."""

    def __init__(self, native: ModuleType, platform, log: Path, way_in: WayIn, tare: MachineTare | None):
        self._native, self._platform, self._log, self._way_in, self._tare = native, platform, log, way_in, tare
        self.shown = _Thinned()
        self.recent: list[LegLog] = []  # parts, without the tare, of the last DIAGNOSED_S at least
        self._strays: list[stray.Stray] = []  # the first
        self._stray_count = 0

    @property
    def strays_in_words(self) -> str:
        return stray.in_words(self._strays, self._stray_count)

    def whole(self, firmware: tuple[Path, str | None, str | None], bodies: Path | None, trace: Path | None) -> dict:
        """`firmware`: estimates' file, estimator, prior. Raises ValueError as the firmware does, and InputError."""
        out, estimator, prior = firmware
        with progress_of(self._log) as progress:
            parts = read_parts(self._log, self._way_in.reading(self._platform), progress)
            first = next(parts)
            sampling_s = self._native.sampling_period_s(first.t_s)
            check = None
            if not self._way_in.is_unchecked:
                is_known = (estimator or self._platform.estimator_kind) == "paper"
                load_kg = self._platform.known_mass_kg if is_known else None
                check = InputCheck(self._log, self._platform, sampling_s, load_kg)
                check.add(first)
            offset = None if self._tare is None else self._tare.offset
            files = (out, estimator, prior, offset, bodies, trace)
            run = FirmwareReplay(self._native, self._platform, first, *files, MOST_ROWS)
            self._take(run, first)
            for part in parts:
                if check is not None:
                    check.add(part)
                self._take(run, part)
            result = run.finish()
        result |= {"rows": self.shown.rows, "log": self.shown.log}
        result["input_words"] = input_in_words(result, self.shown.rows)
        unused = (NO_SENSORS,) if self.shown.last_rows.has_velocity and not self._platform.has_velocity else ()
        strays = (self.strays_in_words,) if self._strays else ()
        remarks = (*self.shown.remarks, *unused, *strays, *gaps_in_words(result, sampling_s, self.shown.rows))
        return result | {"remarks": remarks}

    def _take(self, run: FirmwareReplay, part: LegLog) -> None:
        before = self.shown.last_rows
        self.shown.add(part)
        strays = stray.strays_of(part, stray.noise_of(self._platform))
        self._strays, self._stray_count = self._strays or strays[:1], self._stray_count + len(strays)
        if self._tare is not None:
            with_before = part if before is None else joined([before, part])
            part = self._tare.taken_off(with_before).rows(slice(len(with_before.t_s) - len(part.t_s), None))
        run.step(part)
        self.recent.append(part)
        while len(self.recent) > 1 and part.t_s[-1] - self.recent[1].t_s[0] > DIAGNOSED_S:
            del self.recent[0]


class _Thinned:
    """What is kept of a log for its page: every second, fourth, ... row of a long one."""

    def __init__(self):
        self.rows, self.remarks, self.last_rows = 0, (), None
        self._every = 1
        self._kept: list[LegLog] = []

    def add(self, part: LegLog) -> None:
        rows = np.arange(-self.rows % self._every, len(part.t_s), self._every)  # copied, as slices keep the whole part
        self._kept.append(part.rows(rows))
        self.rows += len(part.t_s)
        self.remarks = tuple(dict.fromkeys((*self.remarks, *part.remarks)))
        self.last_rows = part.rows(slice(-ROWS_BEFORE, None))
        while sum(len(each.t_s) for each in self._kept) > MOST_ROWS:
            self._every *= 2
            self._kept = [self.log.rows(slice(None, None, 2))]

    @property
    def log(self) -> LegLog:
        return joined(self._kept)


def _mend(error: str) -> str:
    if "refused every sample" in error:
        return f"; {REFUSED}"
    if "multiple of the sampling period" in error:
        return "; --resample 0.001 puts the rows on regular ticks"
    return ""


def _diagnosis(result: dict, shown: LegLog, platform, rig: Path | None) -> Diagnosis:
    machine = machine_of(platform)
    legs = stray.without(
        shown, stray.strays_of(shown, stray.noise_of(platform))
    )  # least squares would fit nothing else
    machine, legs = (machine, in_time(platform, legs)) if rig is None else with_rig(rig, machine, legs)
    found = diagnose(legs, machine, load_summary.load_changes_s(result), shown)
    if result["names"][0] == "m":
        is_fit = result["verdict"][-1] not in ("misfit", "inconsistent")
        return found.beside(result["sigma"][-1], is_fit, has_rig=rig is not None)
    return found


def _geometry_in_words(platform_file: Path) -> str:
    """What `hexload platform check` would say of legs and hinges; nothing where they are plausible."""
    tables = read_toml(platform_file)
    found = findings_of(tables, workspace.machine_of(tables))
    words = [str(each) for each in found if each.key.startswith("geometry")]
    return f"{platform_file}: {words[0]}" if words else ""


def _refuse_same_files(files: dict[str, Path | None]) -> None:
    named: dict[Path, str] = {}
    for option, path in files.items():
        if path is not None and (other := named.setdefault(path.absolute(), option)) != option:
            raise InputError(f"{path}: found the same file for {other} and {option}, expected two")


def _page_writer(report: Path | None):
    """What draws the page; imported before the run, as a package that is missing is told then. A replay without a page
    needs none of it."""
    if report is None:
        return None
    from hexload.report.page import render_replay

    return render_replay
