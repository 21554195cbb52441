"""What an emulated controller finds in memory before it starts, as firmware/ports/boot/boot_options.h has it."""

import secrets
import struct

MARK = 0x33304C48


def boot_options(config: bytes = b"", sample_timeout_ms: int = 0) -> bytes:
    """`config`: of native.config_bytes(); nothing: the controller keeps its own."""
    return struct.pack("<IIIQ", MARK, sample_timeout_ms, len(config), secrets.randbits(64)) + config
