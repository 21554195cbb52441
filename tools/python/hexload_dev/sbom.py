"""`hexload sbom`: what the project is made with, as CycloneDX 1.6: Python packages, Debian packages, fetched sources."""

import hashlib
import importlib.metadata
import json
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

from hexload import project
from hexload.io.atomic_file import replaced_when_done
from hexload_dev import build, lock
from hexload_dev.requirements import Locked, read_lock

LAUNCHER = project.ROOT / "tools" / "hexload"
SHA256 = re.compile(r"--hash=sha256:([0-9a-f]{64})")
DOCUMENTS = Path("/usr/share/doc")
DPKG = Path("/var/lib/dpkg/info")
KERNEL = project.BUILD / "deps" / "vm" / "linux"


def document() -> dict:
    """The same lock and the same machine give the same document: no time, no serial number."""
    components = [*python_packages(), *debian_packages(), *fetched_sources()]
    own = {"type": "application", "name": "hexload", "version": project.version(), "licenses": _licence("BSD-3-Clause")}
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": own},
        "components": sorted(components, key=lambda component: component["bom-ref"]),
    }


def python_packages() -> Iterator[dict]:
    """All that the lock names, installed or not; the licence of those that are installed."""
    for package in read_lock(lock.LOCK.read_text(encoding="utf-8")):
        yield _component(
            f"pkg:pypi/{package.name}@{package.version}",
            package.name,
            package.version,
            licenses=_licence(_python_licence(package)),
            # Of all its files, for every machine: which of them is installed depends on that.
            hashes=[_sha256(value) for value in SHA256.findall(" ".join(package.lines))],
        )


def _python_licence(package: Locked) -> str | None:
    try:
        found = importlib.metadata.metadata(package.name)
    except importlib.metadata.PackageNotFoundError:
        return None
    classifiers = [line for line in found.get_all("Classifier", ()) if line.startswith("License :: ")]
    text = found.get("License-Expression") or (
        classifiers[0].split(" :: ")[-1] if classifiers else found.get("License")
    )
    return text.strip().splitlines()[0] if text and text.strip() else None


def debian_packages() -> Iterator[dict]:
    """What the launcher's lists name and this machine has; none on a machine without dpkg."""
    if shutil.which("dpkg-query") is None:
        return
    form = "${Package}\t${Version}\t${Architecture}\t${db:Status-Status}\n"
    listed = subprocess.run(["dpkg-query", "-W", "-f", form, *launcher_packages()], capture_output=True, text=True)
    for line in listed.stdout.splitlines():  # status 1, where one is missing, is not of interest
        name, version, architecture, status = line.split("\t")
        if status == "installed":
            yield _component(
                f"pkg:deb/{name}@{version}?arch={architecture}",
                name,
                version,
                licenses=_licence(_debian_licence(name)),
                properties=_installed_files(name, architecture),
            )


def _installed_files(name: str, architecture: str) -> list[dict]:
    """The hash of dpkg's list of its files, which has the hash of each."""
    lists = [DPKG / f"{name}.md5sums", DPKG / f"{name}:{architecture}.md5sums"]
    found = [hashlib.sha256(path.read_bytes()).hexdigest() for path in lists if path.is_file()]
    return [{"name": "hexload:sha256 of md5sums", "value": value} for value in found]


def launcher_packages() -> list[str]:
    lists = re.findall(r"^\w+_packages=\((.*?)\)\s*(?:#.*)?$", LAUNCHER.read_text(), re.MULTILINE | re.DOTALL)
    words = [word for text in lists for word in re.sub(r"#.*", "", text).replace("'", "").split()]
    return sorted({name for word in words if not word.startswith('"') for name in word.split("|")})


def _debian_licence(name: str) -> str | None:
    """The first that its copyright file names, where that is in the machine-readable form."""
    path = DOCUMENTS / name / "copyright"
    if not path.is_file():
        return None
    found = re.search(r"^License: *(\S.*)$", path.read_text(encoding="utf-8", errors="replace"), re.MULTILINE)
    return found[1].strip() if found else None


def fetched_sources() -> Iterator[dict]:
    """Unity, from a source package whose signature apt has checked, and the kernel of the virtual machine."""
    header = build.UNITY / "src" / "unity.h"
    if header.is_file():
        numbers = re.findall(r"define UNITY_VERSION_(?:MAJOR|MINOR|BUILD)\s+(\d+)", header.read_text())
        version = ".".join(numbers) or "unknown"
        yield _component(f"pkg:generic/unity@{version}", "unity", version, _licence("MIT"), _hash_of(header))
    if KERNEL.is_file():
        yield _component("pkg:generic/linux", "linux", "", _licence("GPL-2.0-only"), _hash_of(KERNEL))


def _component(purl: str, name: str, version: str, licenses=(), hashes=(), properties=()) -> dict:
    optional = {"licenses": list(licenses), "hashes": list(hashes), "properties": list(properties)}
    entry = {"type": "library", "bom-ref": purl, "name": name, "version": version, "purl": purl}
    return entry | {key: value for key, value in optional.items() if value}


def _licence(text: str | None) -> list[dict]:
    return [{"license": {"name": text}}] if text else []


def _sha256(value: str) -> dict:
    return {"alg": "SHA-256", "content": value}


def _hash_of(path: Path) -> list[dict]:
    return [_sha256(hashlib.sha256(path.read_bytes()).hexdigest())]


def write(path: Path) -> int:
    """How many components it has."""
    found = document()
    with replaced_when_done(path) as temporary:
        temporary.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return len(found["components"])
