"""The key that a controller and those who command it share: a file of 32 hexadecimal digits, for its owner alone.

firmware/transport/key.cpp reads the same for simulator and controller.
"""

import os
import re
import secrets
import stat
from pathlib import Path

from hexload.errors import InputError

KEY_BYTES = 16
DIGITS = re.compile(rb"[0-9a-fA-F]{32}\n?")


def new_key(path: Path) -> None:
    """Writes a random one. A file that is there stays: a controller may have its key. Raises InputError."""
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        raise InputError(f"{path}: found a file, expected a new name: a key is not written over") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written, {error.strerror}") from None
    with os.fdopen(descriptor, "w") as file:
        os.fchmod(descriptor, 0o600)  # whatever the umask
        file.write(secrets.token_hex(KEY_BYTES) + "\n")


def read_key(path: Path) -> bytes:
    """Raises InputError where it is none, or others may read or write it."""
    try:
        with path.open("rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            text = file.read(2 * KEY_BYTES + 2) if stat.S_ISREG(mode) else b""
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}, expected a key file (hexload key new FILE makes one)") from None
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise InputError(
            f"{path}: found mode {stat.S_IMODE(mode):o}, expected 600: who else can read or change it commands the "
            f"controller (chmod 600 {path})"
        )
    if not DIGITS.fullmatch(text):
        raise InputError(f"{path}: found no key, expected 32 hexadecimal digits and the end of the line")
    return bytes.fromhex(text.decode())
