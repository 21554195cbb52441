"""The end-to-end protection of firmware/bus/hexload.dbc: checksums that count an identifier's Data ID in.

Frames of up to 8 bytes are AUTOSAR's E2E Profile 22: CRC-8H2F in byte 0. Longer ones have its Profile 4's CRC-32P4 in the
last four bytes. firmware/bus/frame.h has the same in C. The frames of authentication have none.
"""

import functools

FIRST_OF_32 = 0x484C0000  # Data ID of a long frame: this and the identifier
UNCHECKED = (0x011, 0x087, 0x107, 0x111)  # CommandMac, SampleMac, AnswerMac, Challenge: a damaged one does not match


def protected(identifier: int, data: bytes) -> bytes:
    """The frame's bytes, with its checksum in place of what stands there."""
    if len(data) > 8:
        return data[:-4] + checksum(identifier, data).to_bytes(4, "little")
    return bytes([checksum(identifier, data)]) + data[1:]


def found_checksum(data: bytes) -> int:
    return int.from_bytes(data[-4:], "little") if len(data) > 8 else data[0]


def checksum(identifier: int, data: bytes) -> int:
    """What is to stand in a frame whose other bytes are `data`."""
    if len(data) > 8:
        return crc32p4(data[:-4] + (FIRST_OF_32 + identifier).to_bytes(4, "little"))
    return crc8h2f(data[1:] + bytes([(identifier ^ identifier >> 4) & 0xFF]))


def crc8h2f(data: bytes) -> int:
    """Polynomial 0x2F, start and final XOR 0xFF; of b"123456789" 0xDF."""
    register, table = 0xFF, _table8()
    for byte in data:
        register = table[register ^ byte]
    return register ^ 0xFF


def crc32p4(data: bytes) -> int:
    """Polynomial 0xF4ACFB13, all reflected, start and final XOR 0xFFFFFFFF; of b"123456789" 0x1697D06A."""
    register, table = 0xFFFFFFFF, _table32()
    for byte in data:
        register = register >> 8 ^ table[(register ^ byte) & 0xFF]
    return register ^ 0xFFFFFFFF


@functools.cache
def _table8() -> list[int]:
    """What is left of a byte after eight shifts."""
    table = []
    for register in range(256):
        for _ in range(8):
            register = (register << 1 ^ (0x2F if register & 0x80 else 0)) & 0xFF
        table.append(register)
    return table


@functools.cache
def _table32() -> list[int]:
    table = []
    for register in range(256):
        for _ in range(8):
            register = register >> 1 ^ (0xC8DF352F if register & 1 else 0)
        table.append(register)
    return table
