"""hexload faults as a user meets it: a table of outcomes, words, files, going on where it stopped."""

import csv
import dataclasses
import json
import re
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from forked_command import hexload
from hexload import project
from hexload.campaign import cases
from hexload.errors import InputError
from hexload.estimation import commission
from hexload.faults import fault_report, load_faults, verb
from hexload.faults.kinds import ESTIMATORS, GROUPS, KINDS
from hexload.faults.one_fault import MOTIONS, FaultCase, clean_recording, is_possible, run_fault, score_of, truth_of
from hexload.faults.recording import write_files
from hexload.faults.score import OUTCOMES
from hexload.faults.tally import tally
from hexload.io.log_file import read_log
from hexload.io.toml_document import read_toml

SEED = 5
FEW = "renumbered,force_dead,displacement_unit"


def command(*arguments):
    return [sys.executable, "-m", "hexload_dev", "faults", *map(str, arguments)]


def run(*arguments):
    return subprocess.run(command(*arguments), capture_output=True, text=True)


def settings(kinds=FEW, runs=1):
    return verb.settings_of(kinds, "multisine", "momentum", runs, SEED, quick=True)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Folder and output of a campaign of four kinds, from the command line."""
    out = tmp_path_factory.mktemp("faults") / "few"
    options = ("--quick", "--kind", FEW, "--motion", "multisine", "--seed-base", SEED, "--out", out)
    result = run(*options)
    assert result.returncode == 0, result.stderr
    return out, result.stdout


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Clean runs, which tests share as the cases of a campaign do."""
    return tmp_path_factory.mktemp("logs")


def outcomes(out):
    with (out / "cases.csv").open(newline="") as file:
        return {row["fault"]: row for row in csv.DictReader(file)}


def test_a_campaign_tells_what_came_of_each_fault(finished):
    # GIVEN legs counted two further, which a symmetric machine cannot show, a dead force sensor, millimetres for metres
    out, told = finished
    assert told.splitlines()[-1] == str(out / "report.html")
    rows = outcomes(out)
    assert set(rows) == {"none", *FEW.split(",")}
    # THEN the clean run is right and the log in millimetres is refused; a dead sensor does not go without a word
    assert rows["none"]["outcome"] == "right"
    assert rows["displacement_unit"]["outcome"] == "refused"
    assert rows["force_dead"]["outcome"] != "silent" and rows["force_dead"]["words_last_3_s"]
    # AND the row says what was done and what should have been read
    assert rows["renumbered"]["size"] == "2" and rows["renumbered"]["to_be_read"] == "legs renumbered"
    # AND terminal, Markdown, JSON and page tell the same counts
    (entry,) = json.loads((out / "summary.json").read_text())
    assert entry["whole"]["runs"] == 3  # the clean run is no fault
    for outcome in OUTCOMES:
        expected = sum(row["outcome"] == outcome for name, row in rows.items() if name != "none")
        assert entry["whole"]["outcomes"][outcome] == expected
    table = (out / "table.md").read_text()
    for name, row in rows.items():
        assert f"| {name} | 1 |" in table
        assert row["outcome"] in OUTCOMES
    page = (out / "report.html").read_text()
    assert "Faults: 4 runs of 4 kinds" in page and "legs renumbered" in page
    assert "http://" not in page.split("</style>")[0]
    # AND the page plays the worst run that was answered of each group of faults, with the true load and the estimated one
    worst = re.findall(r"<details><summary>(.*?): .*?application/json\">(.*?)</script>", page, flags=re.DOTALL)
    assert [group for group, _ in worst] == ["stuck, dead, negated", "wiring"]  # millimetres are refused
    assert all(json.loads(text)["true"]["v"] and json.loads(text)["estimated"]["v"] for _, text in worst)


def test_the_same_command_goes_on_and_does_nothing_twice(finished, capsys):
    # GIVEN a finished campaign one of whose results is gone, another cut off
    out, _ = finished
    before = {path.name: path.read_bytes() for path in (out / "cases").iterdir()}
    gone, cut = sorted((out / "cases").iterdir())[:2]
    gone.unlink()
    cut.write_bytes(before[cut.name][:100])
    kept = {path.name: path.stat().st_mtime_ns for path in (out / "cases").iterdir() if path != cut}
    logs = {path.name: path.stat().st_mtime_ns for path in (out / "logs").iterdir()}
    # WHEN it runs again THEN these two are done again, with the same numbers, and the clean run is not simulated again
    verb.run_faults(settings(), out, restart=False)
    said = capsys.readouterr().err
    assert f"{cut}: done again, as it is not whole" in said and "2 of 4 cases are done already, 2 to go" in said
    assert {path.name: path.read_bytes() for path in (out / "cases").iterdir()} == before
    now = {path.name: path.stat().st_mtime_ns for path in (out / "cases").iterdir()}
    assert {name: now[name] for name in kept} == kept
    assert {path.name: path.stat().st_mtime_ns for path in (out / "logs").iterdir()} == logs and len(logs) == 1


@pytest.fixture
def campaign(tmp_path, monkeypatch):
    """A folder with the files of a campaign of another version: cases, one cut off, logs, a rig, a writing that was killed.
    Cases take no time."""
    folder = tmp_path / "out"
    for name in ("cases", "logs"):
        (folder / name).mkdir(parents=True)
    cases = settings().cases()
    (folder / "campaign.json").write_text(json.dumps({"code": "0123", **dataclasses.asdict(settings())}))
    (folder / "cases" / "old-1.json").write_text('{"code": "0123", "case": {}}')
    (folder / "cases" / f"{cases[0].name}.json").write_text('{"code": "01')
    for name in ("multisine-5-any_load-16-0123456789abcdef.npz", ".empty-5-0123456789abcdef.npz.77.part"):
        (folder / "logs" / name).write_text("")
    (folder / "logs" / "lag-0.1-5-0123456789abcdef.rig.toml").write_text("")
    monkeypatch.setattr(verb, "complete", lambda cases, *_: dict.fromkeys(cases))
    monkeypatch.setattr(verb, "_conclude", lambda settings, code, done, out: out)
    return folder


def files(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if not path.is_dir())


def test_a_restart_deletes_what_the_campaign_has_written(campaign):
    # GIVEN a campaign of another version, and what somebody has put beside its folders
    (campaign / "notes.md").write_text("mine")
    # WHEN it starts anew THEN its own files are gone, and nothing else is
    verb.run_faults(settings(), campaign, restart=True)
    assert files(campaign) == ["campaign.json", "notes.md"]


@pytest.mark.parametrize(
    "name", ["logs/rig.npz", "logs/notes-0123456789abcdef.txt", "logs/more/of-0123456789abcdef.npz", "cases/mine.json"]
)
def test_a_restart_is_refused_where_other_files_are_among_them(campaign, name):
    # GIVEN what somebody has put into a folder of the campaign
    stranger = campaign / name
    stranger.parent.mkdir(exist_ok=True)
    stranger.write_text("{}")
    before = files(campaign)
    # WHEN it is to start anew THEN that is refused with its place, and all is as it was
    with pytest.raises(InputError, match="found what this campaign has not written.*nothing is deleted") as refused:
        verb.run_faults(settings(), campaign, restart=True)
    assert str(campaign / "/".join(Path(name).parts[:2])) in str(refused.value)
    assert files(campaign) == before


@pytest.mark.parametrize("name", ["logs", "cases", "logs/a-0123456789abcdef.npz"])
def test_a_restart_follows_no_link(campaign, tmp_path, name):
    # GIVEN a folder elsewhere with a file like the campaign's, and a link to it in the campaign's place
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    kept = elsewhere / "multisine-5-any_load-16-0123456789abcdef.npz"
    kept.write_text("mine")
    link = campaign / name
    if link.is_dir():
        link.rename(tmp_path / "moved")
    link.symlink_to(kept if link.suffix else elsewhere)
    # WHEN it is to start anew THEN that is refused, and the file stays
    with pytest.raises(InputError, match="nothing"):
        verb.run_faults(settings(), campaign, restart=True)
    assert kept.read_text() == "mine"


def test_cases_are_all_kinds_sizes_motions_and_estimators():
    # GIVEN the whole campaign WHEN its cases are counted THEN each estimator has 2,000 runs
    whole = verb.settings_of(None, None, None, None, SEED, quick=False)
    cases = whole.cases()
    assert len(set(cases)) == len({case.name for case in cases}) == len(cases)
    for estimator in ESTIMATORS:
        assert sum(case.estimator == estimator for case in cases) >= 2000
    assert {case.kind for case in cases} == set(KINDS)
    assert {(case.motion, case.estimator) for case in cases} == {
        (motion, estimator) for motion in MOTIONS for estimator in ESTIMATORS
    } - {("pick_up", "paper")}
    # AND the given mass is a matter of the paper's filter alone
    assert {case.estimator for case in cases if case.kind == "known_mass"} == {"paper"}
    # AND the quick one has one size of each
    quick = verb.settings_of(None, "work", None, None, SEED, quick=True).cases()
    assert len(quick) == len(KINDS) - 1


def test_scales_are_those_of_the_true_platform_not_of_the_told_one(logs):
    # GIVEN a platform whose inertia is told half as large again as it is
    base = clean_recording("multisine", SEED, verb.DURATION_S, "momentum", str(logs))
    told = KINDS["platform_inertia"].apply(base, 0.5, np.random.default_rng(1))
    assert told.platform["platform"] != base.platform["platform"]
    # THEN errors are compared with the same scales as before
    assert np.array_equal(truth_of(told, "momentum").scale, truth_of(base, "momentum").scale)


def test_what_is_true_of_a_load_is_no_false_report(tmp_path):
    # GIVEN a run of the paper's filter WHEN a half of the load falls off, or another mass was stated THEN that the legs do
    # not carry the stated mass is true from then on, AND of the load as it was stated never
    base = clean_recording("work", SEED, verb.DURATION_S, "paper", str(tmp_path))
    assert truth_of(base, "paper").changes_s == ()
    assert truth_of(KINDS["known_mass"].apply(base, 0.05, np.random.default_rng(1)), "paper").changes_s == (
        (0.0, base.t_s[-1]),
    )
    fallen = KINDS["falling"].apply(base, 0.5, np.random.default_rng(1))
    assert truth_of(fallen, "paper").changes_s[-1] == (fallen.loads[-1].at_s, base.t_s[-1])
    # AND a clock that goes 2 % wrong tells another time of the change, at which it is seen
    wrong = KINDS["clock"].apply(fallen, 0.02, np.random.default_rng(1))
    told_s = np.interp(fallen.loads[-1].at_s, base.t_s, wrong.log.t_s)
    assert wrong.changes_s[0][0] == pytest.approx(told_s) and abs(told_s - fallen.loads[-1].at_s) > 0.05


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_every_estimator_is_right_about_a_clean_run(estimator, logs):
    # GIVEN a multisine with a load that the estimator's model has WHEN nothing is wrong THEN no parameter is
    result = run_fault(FaultCase("none", 0.0, "multisine", estimator, SEED, verb.DURATION_S), logs)
    assert result["wrong"] == [] and result["outcome"] in ("right", "false_alarm")
    assert is_possible(FaultCase("none", 0.0, "multisine", estimator, SEED, verb.DURATION_S))


@pytest.mark.parametrize("seed", range(2080000000, 2080000003))
def test_a_burst_of_noise_is_no_turning_of_the_platform(seed, logs):
    # GIVEN the paper's motion, which turns the platform by little, and 50 ms of five times the stated noise in the velocities, at
    # random times WHEN the ten parameters are estimated
    case = FaultCase("velocity_bursts", 5.0, "paper", "momentum", seed, verb.DURATION_S)
    # THEN all are right within their sigmas: held against the noise of a second, bursts left Iyy 6 to 20 sigmas off
    scored = run_fault(case, logs)
    assert scored["outcome"] == "right" and scored["largest_sigmas"] < 5.0


@pytest.mark.parametrize("size_m", KINDS["displacement_periodic"].sizes)
def test_an_encoder_that_errs_with_each_turn_of_a_screw_is_no_turning_of_the_platform(size_m, logs):
    # GIVEN the paper's motion, which turns the platform by little, and encoders that are off by a sine of the way WHEN the ten
    # parameters are estimated
    case = FaultCase("displacement_periodic", size_m, "paper", "momentum", 2080000000, verb.DURATION_S)
    # THEN all are right within their sigmas: those of the filter alone left Iyy 6 of them off, and with 0.1 mm 11
    scored = run_fault(case, logs)
    assert scored["outcome"] == "right" and scored["largest_sigmas"] < 5.0


def test_a_hinge_that_is_off_is_in_the_sigmas_beside_free_biases(logs):
    # GIVEN the paper's motion, and one hinge off by 1 mm WHEN biases and friction of the legs are free, and hide it
    case = FaultCase("one_hinge", 0.001, "paper", "momentum_effects", 2310000002, verb.DURATION_S)
    # THEN all ten are right within their sigmas: without A9 h_y was 9 of them off, and no residual told
    scored = run_fault(case, logs)
    assert scored["outcome"] == "right" and scored["largest_sigmas"] < 5.0


def test_a_commissioned_machine_knows_the_fault_that_it_had_when_empty(logs):
    # GIVEN force sensors of one leg 100 N off, which are reported WHEN the empty machine has been commissioned
    # with them
    case = FaultCase("force_bias", 100.0, "multisine", "momentum", SEED, verb.DURATION_S)
    before = run_fault(case, logs)
    after = run_fault(replace(case, is_commissioned=True), logs)
    # THEN the numbers are right, and without a word; before there was one
    assert "misfit" in before["words"]
    assert after["outcome"] == "right" and after["largest_sigmas"] < 5.0
    # AND the rig file is kept for the other motions; the fault is the same one on each of them
    (rig,) = logs.glob("force_bias-100-*.rig.toml")
    made = rig.stat().st_mtime_ns
    assert run_fault(replace(case, motion="work", is_commissioned=True), logs)["largest_sigmas"] < 5.0
    assert rig.stat().st_mtime_ns == made
    # AND lost rows, or a load that falls off, are no faults of the empty machine: its rig file is that of the clean one
    for kind, size in (("lost", 0.01), ("falling", 0.1)):
        passing = FaultCase(kind, size, "multisine", "momentum", SEED, verb.DURATION_S, is_commissioned=True)
        assert run_fault(passing, logs)["outcome"] == "right"
    assert sorted(path.name.split("-")[0] for path in logs.glob("*.rig.toml")) == ["force_bias", "none"]


@pytest.mark.parametrize("kind", ["pendulum", "sloshing"])
def test_what_swings_on_a_commissioned_machine_is_none_of_its_constants(kind, logs):
    # GIVEN a commissioned machine, whose constants are open within sigma WHEN a tenth of its load swings on slow motion
    # THEN that is a misfit, though it lies in no leg's noise; and of the rigid load nothing is
    case = FaultCase(kind, 0.1, "work", "momentum", SEED, verb.DURATION_S, is_commissioned=True)
    swinging, rigid = run_fault(case, logs), run_fault(replace(case, kind="none", size=0.0), logs)
    assert "misfit" in swinging["words"] and swinging["outcome"] in ("right", "said")
    assert rigid["outcome"] == "right" and "misfit" not in rigid["words"]


def test_hoses_that_the_empty_platform_has_too_are_in_the_sigmas_of_free_effects(logs):
    # GIVEN hoses of 50 N/m on a machine that was commissioned with them: biases go 25 N beyond what that has left them
    for seed in range(SEED, SEED + 3):
        case = FaultCase("hoses", 50.0, "paper", "momentum_effects", seed, verb.DURATION_S, is_commissioned=True)
        # WHEN biases are found with the load THEN all ten parameters are within three of their sigmas
        assert run_fault(case, logs)["largest_sigmas"] < 3.0


def test_friction_that_the_empty_platform_hardly_has_is_found_before_a_load_makes_it_grow(logs):
    # GIVEN dry friction of 0.003 of each leg's force, half a newton of an empty platform WHEN that has been commissioned
    case = FaultCase("friction_growing", 0.003, "paper", "momentum", SEED, verb.DURATION_S, is_commissioned=True)
    assert run_fault(case, logs)["outcome"] == "right"
    # THEN its growth is found in each leg, within four sigmas, which are a third of it at most
    (rig,) = logs.glob("friction_growing-0.003-*.rig.toml")
    found = tomllib.loads(rig.read_text())
    for growth, sigma in zip(found["rig"]["growth_n_n"], found["sigma"]["growth_n_n"], strict=True):
        assert abs(growth - 0.003) < 4.0 * sigma and sigma < 0.001


def test_a_seed_may_have_a_machine_of_its_own(logs):
    # GIVEN a machine drawn for each seed WHEN it runs several motions THEN it is one machine, AND that of no other seed
    def machine(motion, seed, is_own=True):
        stated = clean_recording(motion, seed, verb.DURATION_S, "momentum", str(logs), is_own).platform
        return stated["geometry"], stated["platform"]

    assert machine("multisine", SEED) == machine("paper", SEED)
    for part in range(2):
        apart = [
            machine("multisine", SEED)[part],
            machine("multisine", SEED + 1)[part],
            machine("multisine", SEED, False)[part],
        ]
        assert all(apart[k] != apart[k - 1] for k in range(3))
    # AND legs that are all longer at home, or friction, are put into it as into the paper's, commissioned or not
    for kind, size in (("none", 0.0), ("home_length", 1e-3), ("friction_growing", 0.003)):
        case = FaultCase(kind, size, "multisine", "momentum", SEED, verb.DURATION_S, has_own_machine=True)
        assert run_fault(case, logs)["outcome"] == "right"
        assert run_fault(replace(case, is_commissioned=True), logs)["outcome"] == "right"
    assert len(list(logs.glob("*-own-*.rig.toml"))) == 3
    assert verb.settings_of(FEW, None, None, None, SEED, True, has_own_machine=True).cases()[0].has_own_machine


def test_a_machine_may_have_no_velocity_sensors(logs, tmp_path):
    # GIVEN a machine without velocity sensors WHEN cases are chosen THEN none has a fault of them
    chosen = verb.settings_of(None, "multisine", "momentum", 1, SEED, quick=True, has_velocity=False).cases()
    kinds = [case.kind for case in chosen]
    assert "displacement_bent" in kinds and not [kind for kind in kinds if kind.startswith("velocity")]
    # AND a clean run, and one with a fault of the machine, are right, commissioned or not; what is commissioned has no
    # velocities either, as otherwise its rig file would be shared
    for kind, size in (("none", 0.0), ("force_bias", 30.0)):
        case = FaultCase(kind, size, "multisine", "momentum", SEED, verb.DURATION_S, has_velocity=False)
        for is_commissioned in (False, True):
            without = run_fault(replace(case, is_commissioned=is_commissioned), logs)
            with_them = run_fault(replace(case, is_commissioned=is_commissioned, has_velocity=True), logs)
            assert without["outcome"] == "right" and without["largest_sigmas"] != with_them["largest_sigmas"]
    assert len(list(logs.glob("*-no-velocity-*.rig.toml"))) == 2
    # AND its log as a file has no columns of them
    shown = case.as_sensed(clean_recording("multisine", SEED, verb.DURATION_S, "momentum", str(logs)))
    log, _ = write_files(shown, tmp_path)
    assert not read_log(log).has_velocity


def test_a_machine_that_cannot_be_commissioned_is_refused(logs, monkeypatch):
    # GIVEN velocities and displacements in other units WHEN the empty machine is commissioned THEN the reason is told
    case = FaultCase("displacement_unit", 1e3, "multisine", "momentum", SEED, verb.DURATION_S, is_commissioned=True)
    result = run_fault(case, logs)
    assert result["outcome"] == "refused" and result["words"][0].startswith("commissioning: empty.csv")
    assert str(logs) not in result["words"][0]
    # AND another motion of the machine is refused with the same words, without commissioning it again
    monkeypatch.setattr(commission, "commission", None)
    assert run_fault(replace(case, motion="work"), logs)["words"] == result["words"]


def test_kinds_are_chosen_by_name_or_group():
    assert settings("tilt, leg_mass").kinds == ("none", "tilt", "leg_mass")
    friction = tuple(name for name, kind in KINDS.items() if kind.group == "friction")
    assert settings("friction").kinds == ("none", *friction)
    # AND a group whose name has commas, alone or before a semicolon
    stuck = ("none", *(name for name, kind in KINDS.items() if kind.group == "stuck, dead, negated"))
    assert settings("stuck, dead, negated").kinds == stuck
    assert settings("stuck, dead, negated; tilt").kinds == (*stuck, "tilt")


@pytest.mark.parametrize(
    "options, said",
    [
        (("--kind", "gremlins"), "--kind: found 'gremlins', expected some of those that hexload faults --list prints"),
        (("--motion", "waltz"), "--motion: found 'waltz', expected some of: multisine, paper, work, pick_up"),
        (("--estimator", "kalman"), "--estimator: found 'kalman', expected some of: momentum, momentum_effects, paper"),
    ],
)
def test_what_is_not_known_is_refused(options, said, tmp_path):
    result = hexload("faults", *options, "--seed-base", SEED, "--out", tmp_path / "out")
    assert (result.returncode, result.stderr) == (2, f"hexload: {said}\n")
    assert not (tmp_path / "out").exists()
    with pytest.raises(InputError):
        verb.settings_of("gremlins", None, None, None, SEED, quick=False)


def test_the_list_names_every_fault_with_sizes_and_words():
    result = hexload("faults", "--list")
    assert result.returncode == 0
    for name, kind in KINDS.items():
        assert not kind.is_fault or f"  {name} " in result.stdout
    for text in ("0.0002 m; 0.002 m", "to the end", "legs renumbered", *GROUPS[1:]):
        assert text in result.stdout


def result_of(outcome, words=(), wrong=(), changes=()):
    entries = [{"name": name, "sigmas": 9.0, "percent": percent, "verdict": "converged"} for name, percent in wrong]
    return {"outcome": outcome, "words": list(words), "wrong": entries, "false_changes_s": list(changes)} | {
        "words_before": [],
        "largest_sigmas": 9.0,
    }


def test_outcomes_are_counted_by_kind_size_and_group():
    # GIVEN five runs of two kinds of one group, and a clean one
    def case(kind, size, seed):
        return FaultCase(kind, size, "work", "momentum", seed, 16.0)

    results = {
        case("none", 0.0, 1): result_of("right"),
        case("tilt", 0.002, 1): result_of("silent", wrong=[("m", 3.0), ("hz", 7.0)]),
        case("tilt", 0.02, 1): result_of("weak", words=["inconsistent"], wrong=[("m", 30.0)]),
        case("tilt", 0.02, 2): result_of("said", words=["inconsistent", "model misfit"], changes=[4.0, 5.0]),
        case("leg_mass", 6.0, 1): result_of("false_alarm", words=["inconsistent"], changes=[4.0]),
    }
    # WHEN they are counted THEN the clean one is none of the faults
    (entry,) = tally(results, ("momentum", "paper"))
    assert entry.whole.runs == 4 and entry.groups["none"].runs == 1
    expected = {"said": 1, "weak": 1, "silent": 1, "false_alarm": 1}
    assert entry.whole.outcomes == dict.fromkeys(OUTCOMES, 0) | expected
    assert entry.whole.false_changes == 2
    # AND kinds, sizes, words, wrong parameters and the largest silent error are told
    tilt = next(kind for kind in entry.kinds if kind.kind == "tilt")
    assert [size.label for size in tilt.sizes] == ["0.002 rad", "0.02 rad"]
    assert [size.runs for size in tilt.sizes] == [1, 2]
    assert tilt.whole.words == {"inconsistent": 2, "model misfit": 1}
    assert tilt.whole.wrong == {"m": 2, "hz": 1}
    assert tilt.whole.largest_percent == 7.0
    assert [case.size for case in entry.silent] == [0.002]
    # AND the rows of the table are in that order
    assert fault_report.counts(tilt.whole) == [3, 0, 1, 1, 1, 0, 0, 0, 1]


def test_sentences_of_one_cause_are_counted_together():
    # GIVEN runs that were refused with the numbers of two legs, and a sentence that is long WHEN they are counted THEN the
    # sentence is there once, without them, and the long one ends in dots
    def refused(leg, gain):
        return f"commissioning: found velocities of leg {leg} at {gain} times the change of its displacement"

    results = {
        FaultCase("velocity_gain", 0.02, "work", "momentum", seed, 16.0): result_of("refused", words=[words])
        for seed, words in enumerate((refused(4, 1.021), refused(2, -9.8e-1), "very " * 40))
    }
    (entry,) = tally(results, ("momentum",))
    words = {refused("N", "x"): 2, ("very " * 22)[:-6] + " ...": 1}
    assert entry.whole.words == words


def test_of_a_platform_stated_wrongly_a_dropped_load_tells_one_sign(tmp_path):
    # GIVEN a run in which all of the load falls off, of a platform that is stated a fifth too heavy, or too light
    base = clean_recording("multisine", SEED, 12.0, "momentum", str(tmp_path))
    dropped = load_faults.falling(base, 1.0, np.random.default_rng(1))

    def outcome_with(factor):
        platform = base.platform["platform"] | {"mass_kg": factor * base.own_theta[0]}
        return score_of(replace(dropped, platform=base.platform | {"platform": platform}), "momentum").outcome

    # WHEN the empty platform is identified THEN less than no load is no body, and sigma says so
    assert outcome_with(1.2) == "right"
    # AND what is left over is a load, as far as any log tells
    assert outcome_with(0.8) == "silent"


def test_the_diagnosis_names_the_cause_when_it_is_asked_for(tmp_path):
    # GIVEN the forces of two legs swapped, and legs counted two further, which a symmetric machine cannot show
    cases = [
        FaultCase(kind, size, "multisine", "momentum", SEED, 6.0, names_cause=True)
        for kind, size in (("force_swapped", 1.0), ("renumbered", 2.0))
    ]
    # WHEN the cases are run THEN the one is named, the other counts as one that cannot be distinguished
    results = {case: run_fault(case, tmp_path) for case in cases}
    swapped, renumbered = (result["named"] for result in results.values())
    # AND replay says so in its last line, of which a page is made
    page = fault_report.words_page("hexload faults", results)
    assert "are swapped; check the wiring against the platform file | yes |" in page
    assert "| renumbered | legs counted from another one, 2 further | converged | – | – |" in page
    assert swapped["outcome"] == "right" and "are swapped" in swapped["sentence"]
    assert renumbered["outcome"] == "cannot be distinguished" and renumbered["cause"] == ""
    # AND the tables have a column for it
    (entry,) = tally(results, ESTIMATORS)
    assert fault_report.named_of(entry.whole) == "1 of 1"
    assert "are swapped" in fault_report.markdown([entry])


def test_the_page_of_words_has_every_fault_as_it_is_listed():
    # GIVEN the page that --name-causes writes WHEN it is read THEN it has each kind of fault with what is wrong, and a sentence
    lines = (project.ROOT / "tests" / "FAULTS.md").read_text(encoding="utf-8").splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    told = {row[0]: row for row in rows[2:]}
    assert list(told) == list(KINDS)
    for name, kind in KINDS.items():
        assert told[name][1].startswith(kind.says) and told[name][2] and told[name][3]
    # AND of twenty faults that a log can tell the cause is the true one
    judged = [row[4] for row in told.values() if row[4] != "–"]
    assert judged.count("yes") >= 0.85 * len(judged)


def test_causes_and_a_rig_are_one_or_the_other():
    # GIVEN both options WHEN they are read THEN they are refused
    with pytest.raises(InputError, match="--name-causes: found it with --rig"):
        verb.settings_of(FEW, None, None, None, SEED, quick=True, is_commissioned=True, names_causes=True)


def test_every_machine_that_is_drawn_is_a_body():
    # GIVEN five hundred machines WHEN their platforms are weighed
    stated = read_toml(project.SCENARIOS / "platforms" / "paper.toml")
    for seed in range(500):
        body = cases.with_own_machine(stated, np.random.default_rng(seed))["platform"]
        xx, yy, zz, xy, xz, yz = body["inertia_kg_m2"]
        about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        com_m = np.array(body["com_m"])
        central = about_origin - body["mass_kg"] * (com_m @ com_m * np.eye(3) - np.outer(com_m, com_m))
        moments = np.linalg.eigvalsh(central)
        # THEN no principal moment is more than the two others, which no body has
        assert moments[0] > 0.0 and moments[2] < moments[0] + moments[1]
