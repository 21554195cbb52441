#include "bus/crc.h"

// What a byte leaves is linear: entry n of a table is the XOR of the entries of n's bits. REMAINDERS8 writes
// all 256 from those of the bits, most significant first.
#define REMAINDERS0(sum) (sum)
#define REMAINDERS1(sum, a) REMAINDERS0(sum), REMAINDERS0((sum) ^ (a))
#define REMAINDERS2(sum, b, a) REMAINDERS1(sum, a), REMAINDERS1((sum) ^ (b), a)
#define REMAINDERS3(sum, c, b, a) REMAINDERS2(sum, b, a), REMAINDERS2((sum) ^ (c), b, a)
#define REMAINDERS4(sum, d, c, b, a) REMAINDERS3(sum, c, b, a), REMAINDERS3((sum) ^ (d), c, b, a)
#define REMAINDERS5(sum, e, d, c, b, a) REMAINDERS4(sum, d, c, b, a), REMAINDERS4((sum) ^ (e), d, c, b, a)
#define REMAINDERS6(sum, f, e, d, c, b, a)                                                                   \
    REMAINDERS5(sum, e, d, c, b, a), REMAINDERS5((sum) ^ (f), e, d, c, b, a)
#define REMAINDERS7(sum, g, f, e, d, c, b, a)                                                                \
    REMAINDERS6(sum, f, e, d, c, b, a), REMAINDERS6((sum) ^ (g), f, e, d, c, b, a)
#define REMAINDERS8(h, g, f, e, d, c, b, a)                                                                  \
    REMAINDERS7(0u, g, f, e, d, c, b, a), REMAINDERS7((h), g, f, e, d, c, b, a)

static const uint8_t table8[256] = {REMAINDERS8(0x26u, 0x13u, 0x87u, 0xCDu, 0xE8u, 0x74u, 0x3Au, 0x1Du)};

// Commands alone have it: four bits at a time will do.
static const uint16_t table16[16] = {0x0000, 0x1021, 0x2042, 0x3063, 0x4084, 0x50A5, 0x60C6, 0x70E7,
                                     0x8108, 0x9129, 0xA14A, 0xB16B, 0xC18C, 0xD1AD, 0xE1CE, 0xF1EF};

// What a byte leaves when no, one, two or three bytes of zero follow it: four bytes go in one step ("slicing
// by 4").
static const uint32_t table32_0[256] = {REMAINDERS8(0xEDB88320u, 0x76DC4190u, 0x3B6E20C8u, 0x1DB71064u,
                                                    0x0EDB8832u, 0x076DC419u, 0xEE0E612Cu, 0x77073096u)};
static const uint32_t table32_1[256] = {REMAINDERS8(0x3B83984Bu, 0xF0794F05u, 0x958424A2u, 0x4AC21251u,
                                                    0xC8D98A08u, 0x646CC504u, 0x32366282u, 0x191B3141u)};
static const uint32_t table32_2[256] = {REMAINDERS8(0xE1351B80u, 0x709A8DC0u, 0x384D46E0u, 0x1C26A370u,
                                                    0x0E1351B8u, 0x0709A8DCu, 0x0384D46Eu, 0x01C26A37u)};
static const uint32_t table32_3[256] = {REMAINDERS8(0xED59B63Bu, 0x9B14583Du, 0xA032AF3Eu, 0x5019579Fu,
                                                    0xC5B428EFu, 0x8F629757u, 0xAA09C88Bu, 0xB8BC6765u)};

uint8_t hexload_crc8(const uint8_t* bytes, size_t count) {
    unsigned crc = 0xFFu;
    for (size_t n = 0; n < count; n++) {
        crc = table8[crc ^ bytes[n]];
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
    const uint8_t* next = bytes;
    for (size_t words = count / 4; words > 0; words--) {
        crc ^= (uint32_t)next[0] | (uint32_t)next[1] << 8 | (uint32_t)next[2] << 16 | (uint32_t)next[3] << 24;
        crc = table32_3[crc & 0xFFu] ^ table32_2[(crc >> 8) & 0xFFu] ^ table32_1[(crc >> 16) & 0xFFu] ^
              table32_0[crc >> 24];
        next = &next[4];
    }
    for (size_t rest = count % 4; rest > 0; rest--) {
        crc = (crc >> 8) ^ table32_0[(crc ^ *next) & 0xFFu];
        next = &next[1];
    }
    return crc ^ 0xFFFFFFFFu;
}
