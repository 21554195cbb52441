"""`hexload bridge`: becomes hexload_bridge, which tells on LCM what a CAN bus carries."""

import os

from hexload import project


def run_bridge(options: tuple[str, ...]) -> None:
    """Does not return: signals reach the bridge itself."""
    project.ensure_built("hexload_bridge")
    program = project.build_directory() / "host_sim" / "hexload_bridge"
    os.execv(program, [str(program), *options])
