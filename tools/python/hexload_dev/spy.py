"""`hexload spy`: lcm-spy with the types of lcm_types on its class path, so that it decodes our channels."""

import os
import shutil
from pathlib import Path

import lcm

from hexload import project
from hexload.errors import ToolFailed
from hexload_dev import build, doctor


def run_spy(url: str) -> None:
    """Becomes lcm-spy: does not return. Raises ToolFailed when there is no display, Java or route for multicast."""
    _check_machine(url)
    build.ensure_built("hexload_lcm_jar")
    types = project.build_directory() / "share" / "hexload_lcm_types.jar"
    if not types.is_file():
        raise ToolFailed(f"{types}: found no such file, expected the LCM types: was there a JDK when it was built?")
    class_path = os.pathsep.join([str(types), *filter(None, [os.environ.get("CLASSPATH")])])
    # Not the wrapper of the same name in the virtual environment: it would stay between us and the window.
    program = Path(lcm.__file__).parents[1] / "bin" / "lcm-spy"
    os.execve(program, [str(program), f"--lcm-url={url}"], os.environ | {"CLASSPATH": class_path})


def _check_machine(url: str) -> None:
    if not os.environ.get("DISPLAY"):
        raise ToolFailed(
            "DISPLAY: found no X display, expected one for the window of lcm-spy; "
            "without a screen: xvfb-run -a tools/hexload spy"
        )
    for program in ("java", "javac", "jar"):
        if shutil.which(program) is None:
            raise ToolFailed(f"found no {program}, expected a JDK: apt-get install default-jdk-headless default-jre")
    if url.startswith("udpm:") and (error := doctor.multicast_error()) is not None:
        raise ToolFailed(f"{url}: found no way for multicast ({error}): ip route add 224.0.0.0/4 dev lo")
