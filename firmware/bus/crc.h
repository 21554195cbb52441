/// @file crc.h
/// The checksums of hexload.dbc: those of AUTOSAR's end-to-end profiles 22 and 4, as its "Specification of
/// CRC Routines" and Greg Cook's catalogue of parametrised CRC algorithms have them.
///
/// Tables of 4.3 KiB in all. Reentrant; time grows with count only.
#ifndef HEXLOAD_BUS_CRC_H
#define HEXLOAD_BUS_CRC_H

#include <stddef.h>
#include <stdint.h>

/// CRC-8H2F, in the catalogue CRC-8/AUTOSAR: polynomial 0x2F, start and final XOR 0xFF. Of "123456789": 0xDF.
/// @param before checksum of the bytes that precede these; 0: none do.
uint8_t hexload_crc8(uint8_t before, const uint8_t* bytes, size_t count);

/// CRC-32P4, in the catalogue CRC-32/AUTOSAR: polynomial 0xF4ACFB13 reflected, start and final XOR
/// 0xFFFFFFFF. Of "123456789": 0x1697D06A.
/// @param before as of hexload_crc8().
uint32_t hexload_crc32(uint32_t before, const uint8_t* bytes, size_t count);

#endif
