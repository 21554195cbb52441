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

static const uint8_t table8[256] = {REMAINDERS8(0xE3u, 0xE6u, 0x73u, 0xAEu, 0x57u, 0xBCu, 0x5Eu, 0x2Fu)};

// What a byte leaves when no, one, two or three bytes of zero follow it: four bytes go in one step ("slicing
// by 4").
static const uint32_t table32_0[256] = {REMAINDERS8(0xC8DF352Fu, 0xACB0AFB8u, 0x565857DCu, 0x2B2C2BEEu,
                                                    0x159615F7u, 0xC2143FD4u, 0x610A1FEAu, 0x30850FF5u)};
static const uint32_t table32_1[256] = {REMAINDERS8(0xD09DB2D5u, 0xA091EC45u, 0x9897C30Du, 0x8494D4A9u,
                                                    0x8A955F7Bu, 0x8D959A92u, 0x46CACD49u, 0xEBBA538Bu)};
static const uint32_t table32_2[256] = {REMAINDERS8(0xBD021CEAu, 0x5E810E75u, 0xE79FB215u, 0xBB10EC25u,
                                                    0x9557433Du, 0x827494B1u, 0x89E57F77u, 0x8C2D8A94u)};
static const uint32_t table32_3[256] = {REMAINDERS8(0x4616C54Au, 0x230B62A5u, 0xD95A847Du, 0xA4727711u,
                                                    0x9AE60EA7u, 0x85AC327Cu, 0x42D6193Eu, 0x216B0C9Fu)};

uint8_t hexload_crc8(uint8_t before, const uint8_t* bytes, size_t count) {
    uint8_t crc = before ^ 0xFFu;
    for (size_t n = 0; n < count; n++) {
        crc = table8[crc ^ bytes[n]];
    }
    return crc ^ 0xFFu;
}

uint32_t hexload_crc32(uint32_t before, const uint8_t* bytes, size_t count) {
    uint32_t crc = before ^ 0xFFFFFFFFu;
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
