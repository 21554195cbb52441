"""`run.py host|vcan|zynqmp_r5`, called by ctest: the tests of this folder without the mark vcan, with it, or with it and
another controller: --controller zynqmp_r5.

Those with the mark run on this kernel when it has vcan0, else in one run of the virtual machine. Where both are missing
the status is that of a skip, or of a failure when HEXLOAD_REQUIRE_VCAN=1 or CI=true. Words after the place go to pytest.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from hexload_tools import project, target, vcan, vm, zynqmp_r5
from hexload_tools.errors import ToolFailed

SKIPPED = 77  # SKIP_RETURN_CODE in CMakeLists.txt
PLACES = {"host": ["-m", "not vcan"], "vcan": ["-m", "vcan"], "zynqmp_r5": ["-m", "vcan", "--controller", "zynqmp_r5"]}


def pytest_command(options: list[str], artefacts: Path) -> list[str]:
    common = ["-v", "-s", "-p", "no:cacheprovider", "-p", "no:hypothesispytest", f"--junit-xml={artefacts}/junit.xml"]
    return [sys.executable, "-m", "pytest", *common, *options, str(Path(__file__).parent)]


def run_here(options: list[str], artefacts: Path) -> int:
    environment = os.environ | {"HEXLOAD_ARTEFACTS": str(artefacts)}
    return subprocess.run(pytest_command(options, artefacts), env=environment).returncode


def run_on_vcan(options: list[str], artefacts: Path) -> int:
    if vcan.ready():
        return run_here(options, artefacts)
    missing = vm.missing_pieces()
    if not missing:
        guest = vm.Machine(out=artefacts, memory_mib=2048, timeout_s=1500)
        return vm.run_in_guest(pytest_command(options, Path("/out")), guest)
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
        status = run_here(options, artefacts) if place == "host" else run_on_vcan(options, artefacts)
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
