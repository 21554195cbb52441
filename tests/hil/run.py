"""`run.py PLACE`, called by ctest: the tests of this folder. PLACE is vm (of the virtual machine itself), host (the others
without the mark vcan), vcan (with it), real_time (with it and the mark apart) or zynqmp_r5 (all with the mark vcan, and
another controller: --controller zynqmp_r5).

Those with the mark vcan run on this kernel when it has vcan0, else in one run of the virtual machine. Where both are missing
the status is that of a skip, or of a failure when HEXLOAD_REQUIRE_VCAN=1 or CI=true. Words after the place go to pytest.
"""

import fcntl
import os
import shutil
import subprocess
import sys
from pathlib import Path

from hexload import project
from hexload.errors import ToolFailed
from hexload_dev import target, vcan, vm, zynqmp_r5

SKIPPED = 77  # SKIP_RETURN_CODE in CMakeLists.txt
FOLDER = Path(__file__).parent
OF_THE_VM = FOLDER / "test_00_vm.py"
PLACES = {
    "vm": [],
    "host": ["-m", "not vcan", f"--ignore={OF_THE_VM}"],
    "vcan": ["-m", "vcan and not apart"],
    "real_time": ["-m", "vcan and apart"],
    "zynqmp_r5": ["-m", "vcan", "--controller", "zynqmp_r5"],
}


def pytest_command(options: list[str], artefacts: Path, files: list[Path]) -> list[str]:
    common = ["-v", "-s", "-p", "no:cacheprovider", "-p", "no:hypothesispytest", f"--junit-xml={artefacts}/junit.xml"]
    return [sys.executable, "-m", "pytest", *common, *options, *map(str, files)]


def run_here(options: list[str], artefacts: Path, files: list[Path]) -> int:
    environment = os.environ | {"HEXLOAD_ARTEFACTS": str(artefacts)}
    return subprocess.run(pytest_command(options, artefacts, files), env=environment).returncode


def run_vm_tests(options: list[str], artefacts: Path) -> int:
    """Where the kernel itself has vcan0, no virtual machine is set up."""
    missing = vm.missing_pieces()
    if vcan.ready() and missing:
        print(
            f"this kernel has {vcan.INTERFACE}, and there is no virtual machine to test: found no {', no '.join(missing)}"
        )
        return SKIPPED
    return run_here(options, artefacts, [OF_THE_VM])


def run_on_vcan(options: list[str], artefacts: Path) -> int:
    if vcan.ready():
        with (artefacts.parent / f"{vcan.INTERFACE}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)  # of this kernel there is one, of virtual machines one for each run
            return run_here(options, artefacts, [FOLDER])
    missing = vm.missing_pieces()
    if not missing:
        guest = vm.GuestOptions(out=artefacts, memory_mib=2048, timeout_s=3000)
        return vm.run_in_guest(pytest_command(options, Path("/out"), [FOLDER]), guest)
    print(
        f"no vcan0 on this kernel, and no virtual machine: found no {', no '.join(missing)}; see tools/hexload doctor"
    )
    return 1 if vcan.required() else SKIPPED


def main(place: str, *words: str) -> int:
    artefacts = project.BUILD / "artefacts" / f"hil_{place}"
    shutil.rmtree(artefacts, ignore_errors=True)
    artefacts.mkdir(parents=True)
    options = [*PLACES[place], *words]
    try:
        if place == "zynqmp_r5":
            target.build_preset(zynqmp_r5.PRESET)
        if place == "vm":
            status = run_vm_tests(options, artefacts)
        elif place == "host":
            status = run_here(options, artefacts, [FOLDER])
        else:
            status = run_on_vcan(options, artefacts)
    except ToolFailed as error:
        print(f"hexload: {error}", flush=True)
        status = error.exit_code
    junit = artefacts / "junit.xml"
    if junit.exists():
        target_file = project.BUILD / "junit" / f"hil_{place}.xml"
        target_file.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(junit, target_file)
    return status


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
