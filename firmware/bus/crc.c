#include "bus/crc.h"

// Entry n: the remainder that the four bits n leave.
static const uint8_t table8[16] = {0x00, 0x1D, 0x3A, 0x27, 0x74, 0x69, 0x4E, 0x53,
                                   0xE8, 0xF5, 0xD2, 0xCF, 0x9C, 0x81, 0xA6, 0xBB};
static const uint16_t table16[16] = {0x0000, 0x1021, 0x2042, 0x3063, 0x4084, 0x50A5, 0x60C6, 0x70E7,
                                     0x8108, 0x9129, 0xA14A, 0xB16B, 0xC18C, 0xD1AD, 0xE1CE, 0xF1EF};
static const uint32_t table32[16] = {
    0x00000000u, 0x1DB71064u, 0x3B6E20C8u, 0x26D930ACu, 0x76DC4190u, 0x6B6B51F4u, 0x4DB26158u, 0x5005713Cu,
    0xEDB88320u, 0xF00F9344u, 0xD6D6A3E8u, 0xCB61B38Cu, 0x9B64C2B0u, 0x86D3D2D4u, 0xA00AE278u, 0xBDBDF21Cu};

uint8_t hexload_crc8(const uint8_t* bytes, size_t count) {
    unsigned crc = 0xFFu;
    for (size_t n = 0; n < count; n++) {
        crc ^= bytes[n];
        crc = ((crc << 4) & 0xFFu) ^ table8[crc >> 4];
        crc = ((crc << 4) & 0xFFu) ^ table8[crc >> 4];
    }
    return (uint8_t)(crc ^ 0xFFu);
}

uint16_t hexload_crc16(const uint8_t* bytes, size_t count) {
    unsigned crc = 0xFFFFu;
    for (size_t n = 0; n < count; n++) {
        crc ^= (unsigned)bytes[n] << 8;
        crc = ((crc << 4) & 0xFFFFu) ^ table16[crc >> 12];
        crc = ((crc << 4) & 0xFFFFu) ^ table16[crc >> 12];
    }
    return (uint16_t)crc;
}

uint32_t hexload_crc32(const uint8_t* bytes, size_t count) {
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t n = 0; n < count; n++) {
        crc ^= bytes[n];
        crc = (crc >> 4) ^ table32[crc & 0xFu];
        crc = (crc >> 4) ^ table32[crc & 0xFu];
    }
    return crc ^ 0xFFFFFFFFu;
}
