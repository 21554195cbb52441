"""`run.py host|vcan`, called by ctest: the tests of this folder without or with the mark vcan.

Those with the mark run on this kernel when it has vcan0, else in one run of the virtual machine. Where both are missing
the status is that of a skip, or of a failure when HEXLOAD_REQUIRE_VCAN=1 or CI=true.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from hexload_tools import project, vcan, vm
from hexload_tools.errors import ToolFailed

SKIPPED = 77  # SKIP_RETURN_CODE in CMakeLists.txt
GUEST = vm.Machine(out=project.BUILD / "artefacts" / "hil_vcan", memory_mib=2048, timeout_s=1500)


def pytest_command(marks: str, artefacts: Path) -> list[str]:
    options = ["-v", "-s", "-p", "no:cacheprovider", "-m", marks, f"--junit-xml={artefacts}/junit.xml"]
    return [sys.executable, "-m", "pytest", *options, str(Path(__file__).parent)]


def run_here(marks: str, artefacts: Path) -> int:
    environment = os.environ | {"HEXLOAD_ARTEFACTS": str(artefacts)}
    return subprocess.run(pytest_command(marks, artefacts), env=environment).returncode


def run_on_vcan(artefacts: Path) -> int:
    if vcan.ready():
        return run_here("vcan", artefacts)
    missing = vm.missing_pieces()
    if not missing:
        return vm.run_in_guest(pytest_command("vcan", Path("/out")), GUEST)
    print(
        f"no vcan0 on this kernel, and no virtual machine: found no {', no '.join(missing)}; see tools/hexload doctor"
    )
    return 1 if vcan.required() else SKIPPED


def main(place: str) -> int:
    artefacts = project.BUILD / "artefacts" / f"hil_{place}"
    shutil.rmtree(artefacts, ignore_errors=True)
    artefacts.mkdir(parents=True)
    try:
        status = run_on_vcan(artefacts) if place == "vcan" else run_here("not vcan", artefacts)
    except ToolFailed as error:
        print(f"hexload: {error}", flush=True)
        status = error.exit_code
    junit = artefacts / "junit.xml"
    if junit.exists():
        target = project.BUILD / "junit" / f"hil_{place}.xml"
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(junit, target)
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
