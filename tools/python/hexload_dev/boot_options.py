"""What an emulated controller finds in memory before it starts, as firmware/ports/boot/boot_options.h has it."""

import struct

MARK = 0x32304C48


def boot_options(config: bytes = b"", sample_timeout_ms: int = 0) -> bytes:
    """`config`: of native.config_bytes(); nothing: the controller keeps its own."""
    return struct.pack("<III", MARK, sample_timeout_ms, len(config)) + config
