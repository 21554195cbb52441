#include "bus/frame.h"

#include "bus/crc.h"

#include <stddef.h>

enum { CRC32_BYTES = 4 };

/// Profile 22. An identifier's Data ID is (id xor id / 16) modulo 256.
static uint8_t crc8_of(const uint8_t* data, const hexload_frame_layout_t* layout) {
    const uint8_t data_id = (uint8_t)((layout->id ^ layout->id >> 4) & 0xFFu);
    return hexload_crc8(hexload_crc8(0, &data[1], (size_t)layout->length - 1), &data_id, 1);
}

/// The Data ID is 0x484C0000 + identifier, least significant byte first.
static uint32_t crc32_of(const uint8_t* data, const hexload_frame_layout_t* layout) {
    const uint8_t data_id[4] = {(uint8_t)(layout->id & 0xFFu), (uint8_t)(layout->id >> 8), 0x4C, 0x48};
    const size_t count = (size_t)layout->length - CRC32_BYTES;
    return hexload_crc32(hexload_crc32(0, data, count), data_id, sizeof data_id);
}

/// The checksum that stands in an FD frame.
static uint32_t found_crc32(const uint8_t* data, const hexload_frame_layout_t* layout) {
    const uint8_t* bytes = &data[layout->length - CRC32_BYTES];
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

void hexload_frame_seal(hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout) {
    if (!hexload_frame_is_fd(layout)) {
        frame->data[0] = crc8_of(frame->data, layout);
        return;
    }
    const uint32_t crc = crc32_of(frame->data, layout);
    uint8_t* bytes = &frame->data[layout->length - CRC32_BYTES];
    for (unsigned n = 0; n < CRC32_BYTES; n++) {
        bytes[n] = (uint8_t)(crc >> (8 * n) & 0xFFu);
    }
}

/// Whether length and format are those of the layout.
static bool fits(const hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout) {
    return frame->length == layout->length && frame->is_fd == hexload_frame_is_fd(layout);
}

hexload_bus_status_t hexload_frame_check(const hexload_bus_frame_t* frame,
                                         const hexload_frame_layout_t* layout) {
    if (frame->id != layout->id) {
        return HEXLOAD_BUS_OTHER;
    }
    if (!fits(frame, layout)) {
        return HEXLOAD_BUS_ERR_LENGTH;
    }
    const bool is_right = hexload_frame_is_fd(layout)
                              ? found_crc32(frame->data, layout) == crc32_of(frame->data, layout)
                              : frame->data[0] == crc8_of(frame->data, layout);
    return is_right ? HEXLOAD_BUS_OK : HEXLOAD_BUS_ERR_CRC;
}
