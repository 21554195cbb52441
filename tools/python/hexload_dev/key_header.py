"""A key file as the C header hexload_key.h, for boards' images: key_header.py KEY HEADER, called by CMake."""

import os
import sys
from pathlib import Path

from hexload.errors import InputError
from hexload.io.key_file import read_key


def write_header(key: Path, header: Path) -> None:
    """For its owner alone, as the key is. Raises InputError."""
    numbers = ", ".join(f"0x{byte:02X}" for byte in read_key(key))
    header.unlink(missing_ok=True)
    with os.fdopen(os.open(header, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(f"#define HEXLOAD_KEY {{{numbers}}}\n")


if __name__ == "__main__":
    try:
        write_header(Path(sys.argv[1]), Path(sys.argv[2]))
    except InputError as error:
        sys.exit(f"HEXLOAD_KEY_FILE: {error}")
