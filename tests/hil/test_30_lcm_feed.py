"""The loop over LCM alone: the same estimates as in process, and every way in which it can break has a name."""

import itertools
import json
import subprocess
import sys

import lcm
import pytest

from hexload import project
from lcm_listener import Controller, Relay, private_url
from loop import PATIENT, SLOW_MACHINE
from momentum_scenario import platform_of, write

SCENARIO = project.SCENARIOS / "paper.toml"
PLATFORM = project.SCENARIOS / "platforms" / "paper.toml"


@pytest.fixture
def url():
    return private_url()


@pytest.fixture
def run(start, simulator, tmp_path):
    """run(name, *options) -> (program, run directory), not waited for."""

    def starter(name, *options, duration_s="2"):
        out = tmp_path / name
        return start(simulator, SCENARIO, "--out", out, "--duration", duration_s, *options), out

    return starter


@pytest.fixture
def controller(start, ecu, url):
    def starter(*options):
        program = start(ecu, "--feed", f"lcm:{url}", "--platform", PLATFORM, "--die-with-parent", *options)
        program.wait_for("ready on LCM")
        return program

    return starter


def test_lockstep_over_lcm_gives_the_bytes_of_the_run_in_process_twice(run, controller, url):
    # GIVEN a run in process
    inproc, expected = run("inproc")
    assert inproc.wait() == 0
    # WHEN the same run feeds a controller over LCM, twice
    program = controller()
    for name in ("first", "second"):
        fed, out = run(name, "--feed", f"lcm:{url}", "--lockstep", *PATIENT)
        assert fed.wait() == 0
        # THEN log and estimates are the same to the byte
        for file in ("log.csv", "truth.csv", "estimates.csv"):
            assert (out / file).read_bytes() == (expected / file).read_bytes(), file
    # and no message was lost on the way; a command comes again when its acknowledge is late
    assert program.interrupt() == 0
    expected = r"4002 samples and (\d+) commands received, 0 messages lost, 0 refused, 4002 answers sent, 0 failed"
    said = program.wait_for(expected)
    assert int(said[1]) >= 8


def test_the_momentum_filter_over_lcm_gives_the_bytes_of_the_run_in_process_and_the_event(
    start, ecu, simulator, url, tmp_path
):
    # GIVEN a run of the momentum filter in process, in which another load is picked up
    scenario = write(tmp_path)
    inproc = start(simulator, scenario, "--out", tmp_path / "inproc")
    assert inproc.wait() == 0
    # WHEN the same run feeds a controller over LCM
    start(ecu, "--feed", f"lcm:{url}", "--platform", platform_of(scenario)).wait_for("ready on LCM")
    listener = Relay(simulators=private_url(), controllers=url)
    options = ["--out", tmp_path / "fed", "--feed", f"lcm:{listener.simulators}", "--lockstep", *PATIENT]
    fed = start(simulator, scenario, *options)
    listener.run_with(fed.process)
    assert fed.wait() == 0
    # THEN log and estimates are the same to the byte, and so is when the new load was detected
    for file in ("log.csv", "estimates.csv"):
        assert (tmp_path / "fed" / file).read_bytes() == (tmp_path / "inproc" / file).read_bytes(), file
    detected_s = [
        json.loads((tmp_path / name / "meta.json").read_text())["load_changes_detected_s"] for name in ("inproc", "fed")
    ]
    assert detected_s[0] == detected_s[1] and len(detected_s[0]) == 1
    # and that is a message of its own
    (change,) = listener.messages["load_change_t"]
    assert (change.tick, change.load_changes) == (round(1000 * detected_s[0][0]), 1)
    last = listener.messages["estimate_t"][-1]
    assert (last.filter, last.count) == ("momentum", 10)
    assert list(last.name) == ["m", "hx", "hy", "hz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"]


def test_one_command_runs_simulator_and_controller_over_lcm(url, tmp_path):
    words = ["sim", "paper", "--feed", f"lcm:{url}", "--duration", "1", "--out", tmp_path / "run", *PATIENT]
    result = subprocess.run([sys.executable, "-m", "hexload_dev", *map(str, words)], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert "1001 samples, 1001 answers, 0 missing" in result.stdout
    bus = json.loads((tmp_path / "run" / "meta.json").read_text())["bus"]
    assert (bus["name"], bus["answers"], bus["answers_missing"]) == (f"lcm:{url}", 1001, 0)


def test_a_controller_in_python_hears_every_tick_in_order(run, url):
    # GIVEN a controller written in Python, with a fixed answer
    controller = Controller(url)
    # WHEN the simulator runs with it
    program, out = run("run", "--feed", f"lcm:{url}", *PATIENT)
    controller.run_with(program.process)
    # THEN it has heard every tick once, in order
    assert program.process.returncode == 0, program.tail()
    samples = controller.messages["leg_sample_t"]
    assert [sample.tick for sample in samples] == list(range(2001))
    assert [sample.sequence for sample in samples] == list(range(2001))
    command_t = project.message_type("command_t")
    # and each command, which comes again when its acknowledge is late
    commands = [kind for kind, _ in itertools.groupby(command.kind for command in controller.messages["command_t"])]
    assert commands == [command_t.RESET, command_t.SELECT_FILTER, command_t.START, command_t.STOP]
    # and its answers are the run's estimates
    assert (out / "estimates.csv").read_text().splitlines()[-1] == "2,1,2,3,4,1,2,3,4,0,converging"


def test_real_time_over_lcm_answers_every_tick_and_survives_a_restarted_controller(run, controller, url):
    # GIVEN a run by the clock, long enough for a controller to start on a busy machine
    first = controller(*SLOW_MACHINE)
    program, out = run("run", "--feed", f"lcm:{url}", "--real-time", *PATIENT, duration_s="10")
    first.wait_for("estimating")
    # WHEN its controller is killed and another one is started
    first.process.kill()
    controller(*SLOW_MACHINE).wait_for("estimating")
    # THEN the run goes on to its end, and counts what was lost
    assert program.wait() == 0
    program.wait_for("the controller has been started again at tick")
    bus = json.loads((out / "meta.json").read_text())["bus"]
    assert bus["rejoins"] == 1
    assert bus["answers"] + bus["answers_missing"] == bus["answers_expected"] == 10001


# What breaks the loop


def test_a_missing_controller_is_named_with_status_3(run, url):
    program, _ = run("run", "--feed", f"lcm:{url}")
    assert program.wait() == 3
    program.wait_for(f"lcm:{url}".replace("?", r"\?") + ": no controller acknowledges RESET within 2000 ms")


def test_a_controller_that_falls_silent_is_named_with_its_tick_and_status_3(run, controller, url):
    # GIVEN a long run in lockstep
    ecu = controller()
    program, _ = run("run", "--feed", f"lcm:{url}", duration_s="1000")
    ecu.wait_for("estimating")
    # WHEN the controller is killed THEN the simulator says since when it is silent
    ecu.process.kill()
    assert program.wait() == 3
    silent, answered = map(int, program.wait_for(r"silent since tick (\d+) \(last answer to tick (\d+)\)").groups())
    assert silent == answered + 1


def test_two_controllers_are_named_with_status_5(run, controller, url):
    controller()
    controller()
    program, _ = run("run", "--feed", f"lcm:{url}", *PATIENT, duration_s="1000")
    assert program.wait() == 5
    program.wait_for("a second controller is on the bus")


def test_a_simulator_that_falls_silent_is_a_fault_of_the_controller_that_a_new_run_mends(run, controller, url):
    # GIVEN a run by the clock
    ecu = controller()
    program, _ = run("run", "--feed", f"lcm:{url}", "--real-time", duration_s="1000")
    ecu.wait_for("estimating")
    # WHEN the simulator is killed THEN the controller says so
    program.process.kill()
    ecu.wait_for("fault: the samples are silent since tick")
    # and a new run begins anew
    again, _ = run("again", "--feed", f"lcm:{url}", *PATIENT)
    assert again.wait() == 0


@pytest.mark.needs("process")
@pytest.mark.vcan  # not for the bus, but for a network namespace, which needs root
@pytest.mark.parametrize("program", ["hexload_ecu", "hexload_sim"])
def test_a_missing_multicast_route_is_named_with_the_command_that_adds_it(program, start, ecu, simulator, tmp_path):
    # GIVEN a network without any route
    words = {
        "hexload_ecu": [ecu, "--feed", "lcm", "--platform", PLATFORM],
        "hexload_sim": [simulator, SCENARIO, "--out", tmp_path / "run", "--publish", "lcm"],
    }[program]
    # WHEN LCM is to be used THEN it is refused, with the remedy
    result = start("unshare", "--net", *words)
    assert result.wait() == {"hexload_ecu": 4, "hexload_sim": 6}[program]
    result.wait_for(f"^{program}: .* this adds one: ip route add 224.0.0.0/4 dev lo$")


@pytest.mark.parametrize("program", ["hexload_ecu", "hexload_sim"])
def test_an_option_that_is_no_lcm_url_is_refused(program, start, ecu, simulator, tmp_path):
    words = {
        "hexload_ecu": [ecu, "--feed", "can0", "--platform", PLATFORM],
        "hexload_sim": [simulator, SCENARIO, "--out", tmp_path / "run", "--feed", "can0"],
    }[program]
    result = start(*words)
    assert result.wait() == 2
    result.wait_for(f"^{program}: LCM: found 'can0', expected lcm or lcm:URL, e.g. lcm:udpm://")


def test_two_simulators_on_one_url_are_a_fault_of_the_controller_by_name(controller, url):
    # GIVEN a controller on LCM that has been started
    program = controller()
    bus = lcm.LCM(url)
    command, sample = project.message_type("command_t")(), project.message_type("leg_sample_t")()
    command.kind = command.START
    bus.publish("HEXLOAD_COMMAND", command.encode())
    program.wait_for("armed")
    # WHEN samples come of two publishers, each with numbers of its own
    for n in range(6):
        for first in (0, 500):
            sample.sequence, sample.tick = first + n, n
            bus.publish("HEXLOAD_LEG_SAMPLE", sample.encode())
    # THEN the controller is in fault, and says what for
    program.wait_for("fault: samples of two sources are on the bus", patience_s=5.0)
