/// @file crc.h
/// The checksums of hexload.dbc, named as in Greg Cook's catalogue of parametrised CRC algorithms.
///
/// Tables of 4.3 KiB in all. Reentrant; time grows with count only.
#ifndef HEXLOAD_BUS_CRC_H
#define HEXLOAD_BUS_CRC_H

#include <stddef.h>
#include <stdint.h>

/// CRC-8/SAE-J1850: polynomial 0x1D, start 0xFF, final XOR 0xFF. Of "123456789": 0x4B.
uint8_t hexload_crc8(const uint8_t* bytes, size_t count);

/// CRC-16/CCITT-FALSE, also IBM-3740: polynomial 0x1021, start 0xFFFF. Of "123456789": 0x29B1.
uint16_t hexload_crc16(const uint8_t* bytes, size_t count);

/// CRC-32/ISO-HDLC, the one of zlib: polynomial 0x04C11DB7 reflected, start and final XOR 0xFFFFFFFF. Of
/// "123456789": 0xCBF43926.
uint32_t hexload_crc32(const uint8_t* bytes, size_t count);

#endif
