"""`hexload replay`: runs the firmware's own C over a recorded log."""

from pathlib import Path

from hexload.diagnosis.diagnose import Diagnosis, diagnose
from hexload.diagnosis.machine import machine_of, with_rig
from hexload.errors import InputError
from hexload.estimation import load_summary
from hexload.estimation.firmware_run import load_platform, native_firmware, run_firmware
from hexload.estimation.input_check import input_in_words, refusal_in_words
from hexload.estimation.rig_file import platform_with_rig
from hexload.estimation.tare import tare_for
from hexload.io.atomic_file import replaced_or_none, replaced_when_done
from hexload.io.log_file import LegLog
from hexload.io.log_formats import read_any_log


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
) -> dict:
    """Writes the estimates CSV to `out`, one row per log row, and returns what hexload_native.replay returns, with
    `has_rig`, `diagnosis`, `input_words`, what is wrong with the log's channels, and the log reader's remarks.

    `estimator` and `prior` override the platform file's [estimator] table. `tare`: file of `hexload tare`, made with
    the same platform; `rig`: of `hexload commission`, likewise. `bodies`: a CSV for the load as a body, one row per log row. `report`: a page, of all ten
    parameters. `trace`: a CSV of each tick's measurement update.
    """
    _refuse_same_files({"--out": out, "--bodies": bodies, "--report": report, "--trace": trace})
    samples = read_any_log(log)
    native = native_firmware()
    if rig is not None and tare is not None:
        raise InputError("--rig: found it with --tare, expected one of the two: a rig file says what a tare file says")
    platform = load_platform(native, platform_file)
    if rig is not None:
        platform = platform_with_rig(rig, native, platform)
    found = None if tare is None else tare_for(tare, native, platform, platform_file)
    legs, offset = (samples, None) if found is None else (found.taken_off(samples), found.offset)
    files = f"{log} with {platform_file}" + "".join(f" and {file}" for file in (tare, rig) if file is not None)
    with (
        replaced_when_done(out) as temporary,
        replaced_or_none(bodies) as body_file,
        replaced_or_none(trace) as trace_file,
        replaced_or_none(report) as page,
    ):
        try:
            result = run_firmware(native, platform, legs, temporary, estimator, prior, offset, body_file, trace_file)
            result["has_rig"] = rig is not None
            result["diagnosis"] = _diagnosis(result, legs, platform, rig)
            result["input_words"] = input_in_words(result, samples) or result["diagnosis"].input_words
        except ValueError as error:
            mend = f"; {refusal_in_words(samples)}" if "refused every sample" in str(error) else ""
            raise InputError(f"{files}: {error}{mend}") from None
        if page is not None:
            tared = "" if tare is None else f" and the tare {tare.name}"
            tared += "" if rig is None else f" and the rig {rig.name}"
            description = f"Replayed with {platform_file.name}{tared}."
            _write_page(page, result, samples, log.name, description, platform.known_mass_kg)
    return result | {"remarks": samples.remarks}


def _diagnosis(result: dict, legs: LegLog, platform, rig: Path | None) -> Diagnosis:
    machine = machine_of(platform)
    if rig is not None:
        machine, legs = with_rig(rig, machine, legs)
    return diagnose(legs, machine, load_summary.load_changes_s(result))


def _refuse_same_files(files: dict[str, Path | None]) -> None:
    named: dict[Path, str] = {}
    for option, path in files.items():
        if path is not None and (other := named.setdefault(path.absolute(), option)) != option:
            raise InputError(f"{path}: found the same file for {other} and {option}, expected two")


def _write_page(
    page: Path, result: dict, samples: LegLog, title: str, description: str, known_mass_kg: float | None
) -> None:
    if "body" not in result:
        raise InputError("--report: found the estimator paper, expected momentum or momentum_effects")
    from hexload.report.page import render_replay  # draws; a replay without a page needs none of it

    page.write_text(render_replay(result, samples, title, description, known_mass_kg), encoding="utf-8")
