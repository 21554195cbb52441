"""`hexload lock`: all packages of all groups, with version and hashes, for every Python and machine: what set-up installs."""

import subprocess
import tomllib

from hexload import project
from hexload.errors import ToolFailed
from hexload_dev.requirements import requirements

PROJECTS = [project.ROOT / "pyproject.toml", project.ROOT / "tools" / "python" / "pyproject.toml"]
LOCK = project.ROOT / "tools" / "python" / "requirements.lock"


def groups() -> list[str]:
    tables = [tomllib.loads(path.read_text(encoding="utf-8"))["project"] for path in PROJECTS]
    return sorted({name for table in tables for name in table["optional-dependencies"]} - {"all"})


def run_lock(upgrade: bool) -> int:
    """Writes the lock file anew, without `upgrade` with the versions that it has; how many packages it then has."""
    lines = requirements(PROJECTS, groups())
    command = ["uv", "pip", "compile", "-", "--output-file", str(LOCK), "--universal", "--python-version", "3.11"]
    command += ["--generate-hashes", "--no-header", "--no-emit-index-url", "--quiet"]
    command += ["--upgrade"] if upgrade else []
    result = subprocess.run(command, input="\n".join(lines), text=True, capture_output=True)
    if result.returncode != 0:
        raise ToolFailed(f"lock: {result.stderr.strip()}")
    return LOCK.read_text(encoding="utf-8").count("==")
