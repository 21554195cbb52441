"""`hexload doctor`: each missing capability is named together with the command that mends it."""

import re
from dataclasses import replace

import pytest

from hexload import project
from hexload_dev import doctor
from hexload_dev.vcan import Interface

ALL_PROGRAMS = dict.fromkeys(doctor.PROGRAMS, True)
# A laptop with everything, and a machine like a container on which the virtual machine is set up.
LAPTOP = doctor.Found(
    af_can=True,
    kernel_modules=True,
    interfaces=(Interface("vcan0", True, 72, 1000),),
    multicast_error=None,
    programs=ALL_PROGRAMS,
    display=":0",
    capabilities=(1 << doctor.CAP_NET_ADMIN),
    realtime_limit=99,
    memlock_limit_bytes=-1,
    kernel="6.8.0-41-generic",
)
CONTAINER = replace(
    LAPTOP, af_can=False, kernel_modules=False, interfaces=(), display="", kernel="6.6.87-microsoft-WSL2"
)


def row(found, capability):
    (match,) = [row for row in doctor.diagnose(found) if row.capability == capability]
    return match


def without(found, *programs):
    return replace(found, programs=ALL_PROGRAMS | dict.fromkeys(programs, False))


def test_a_machine_with_everything_is_fit_and_nothing_is_to_be_mended():
    # GIVEN everything WHEN it is judged THEN no row is missing and no command is offered
    rows = doctor.diagnose(LAPTOP)
    assert {row.state for row in rows} <= {doctor.OK, doctor.NOT_NEEDED}
    assert not any(row.command for row in rows)
    assert doctor.fit_for_tests(LAPTOP)


def test_every_row_has_a_reason_and_every_missing_one_a_command():
    # GIVEN a machine on which nothing is found WHEN it is judged THEN each missing row says why and how
    rows = doctor.diagnose(doctor.Found(vm_missing=("insmod", "/x/linux")))
    assert len(rows) >= 13
    assert all(row.reason for row in rows)
    assert all(bool(row.command) == (row.state == doctor.MISSING) for row in rows)


@pytest.mark.parametrize(
    ("found", "capability", "command"),
    [
        (replace(CONTAINER, kernel_modules=True), "AF_CAN socket", "sudo modprobe -a can can-raw vcan"),
        (replace(CONTAINER, kernel_modules=True, is_root=True), "AF_CAN socket", "modprobe -a can can-raw vcan"),
        (
            replace(CONTAINER, kernel="6.8.0-41-generic"),
            "AF_CAN socket",
            "sudo apt-get install linux-modules-extra-6.8.0-41-generic && sudo modprobe -a can can-raw vcan",
        ),
        (
            replace(CONTAINER, kernel="6.1.0-56-cloud-amd64"),
            "AF_CAN socket",
            "sudo apt-get install linux-image-amd64 && sudo reboot",
        ),
        (
            CONTAINER,
            "AF_CAN socket",
            "tools/hexload vm -- COMMAND  (this kernel has no CAN; the virtual machine's has)",
        ),
        (
            replace(LAPTOP, interfaces=()),
            "vcan0",
            "sudo ip link add vcan0 type vcan && sudo ip link set vcan0 mtu 72 up",
        ),
        (
            replace(LAPTOP, interfaces=(Interface("vcan0", False, 72, 1000),)),
            "vcan0",
            "sudo ip link set vcan0 mtu 72 up",
        ),
        (
            replace(LAPTOP, interfaces=(Interface("vcan0", True, 16, 1000),)),
            "vcan0",
            "sudo ip link set vcan0 down && sudo ip link set vcan0 mtu 72 up",
        ),
        (
            replace(LAPTOP, interfaces=(), capabilities=0),
            "right to make interfaces",
            "sudo -v  (then the commands of the other rows)",
        ),
        (
            replace(LAPTOP, interfaces=(*LAPTOP.interfaces, Interface("can0", True, 72, 10))),
            "txqueuelen",
            "sudo ip link set can0 txqueuelen 1000",
        ),
        (without(LAPTOP, "candump"), "can-utils", "sudo apt-get install can-utils iproute2"),
        (without(CONTAINER, "insmod"), "kmod", "sudo apt-get install kmod"),
        (replace(CONTAINER, vm_missing=("/x/linux",)), "kernel for the virtual machine", "tools/hexload vm -- true"),
        (replace(CONTAINER, vm_missing=("setpriv",)), "kernel for the virtual machine", "tools/hexload vm -- true"),
        (
            replace(LAPTOP, multicast_error="Network is unreachable"),
            "multicast",
            "sudo ip link set lo multicast on && sudo ip route add 224.0.0.0/4 dev lo",
        ),
        (without(LAPTOP, "javac"), "JDK", "sudo apt-get install default-jdk-headless default-jre"),
        (without(CONTAINER, "Xvfb"), "display for lcm-spy", "sudo apt-get install xvfb"),
        (
            replace(LAPTOP, realtime_limit=0),
            "real-time priority",
            'echo "$USER - rtprio 50" | sudo tee -a /etc/security/limits.d/hexload.conf  (then log in again)',
        ),
        (
            replace(LAPTOP, memlock_limit_bytes=8 << 20),
            "locked memory",
            'echo "$USER - memlock 65536" | sudo tee -a /etc/security/limits.d/hexload.conf  (then log in again)',
        ),
    ],
)
def test_a_missing_capability_names_the_command_that_mends_it(found, capability, command):
    result = row(found, capability)
    assert (result.state, result.command) == (doctor.MISSING, command)


def test_the_virtual_machine_is_not_needed_where_the_kernel_has_the_bus():
    # GIVEN a laptop with vcan0 and without what the machine needs WHEN it is judged THEN it is fit without
    found = replace(without(LAPTOP, "insmod"), vm_missing=("insmod", "/x/linux"))
    assert row(found, "kmod").state == doctor.NOT_NEEDED
    assert row(found, "kernel for the virtual machine").state == doctor.NOT_NEEDED
    assert doctor.fit_for_tests(found)


def test_a_machine_without_can_is_fit_through_the_virtual_machine_only():
    assert doctor.fit_for_tests(CONTAINER)
    assert not doctor.fit_for_tests(replace(CONTAINER, vm_missing=("/x/linux",)))


@pytest.mark.parametrize("change", [{"multicast_error": "Network is unreachable"}, {"programs": {}}])
def test_a_machine_that_lacks_what_the_tests_need_is_not_fit(change):
    assert not doctor.fit_for_tests(replace(CONTAINER, **change))


def test_slow_ticks_are_no_reason_to_be_unfit():
    # GIVEN no right to real-time priority WHEN it is judged THEN the tests can still run
    assert doctor.fit_for_tests(replace(LAPTOP, realtime_limit=0, memlock_limit_bytes=0))


def test_the_packages_named_are_those_that_the_launcher_installs():
    # GIVEN every command for a machine on which nothing is found
    commands = [row.command for row in doctor.diagnose(doctor.Found(vm_missing=("insmod",)))]
    packages = {
        word
        for command in commands
        for words in re.findall(r"apt-get install ([^&]*)", command)
        for word in words.split()
    }
    # WHEN their packages are looked up in the launcher's list THEN it has all of them
    launcher = (project.ROOT / "tools" / "hexload").read_text()
    listed = set(re.findall(r"[\w.+-]+", launcher.partition("python_packages=")[2].partition("say()")[0]))
    assert packages and packages <= listed


def test_this_machine_is_judged_and_the_last_line_agrees_with_the_status(capsys):
    # GIVEN this machine WHEN the verb runs THEN status, table and last line say the same
    status = doctor.run_doctor()
    output = capsys.readouterr().out
    assert "AF_CAN socket" in output
    assert ("hexload test has all that it needs" in output.splitlines()[-1]) == (status == 0)
