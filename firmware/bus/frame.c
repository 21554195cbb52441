#include "bus/frame.h"

#include "bus/crc.h"

#include <string.h>

static bool is_fd(const hexload_frame_layout_t* layout) {
    return layout->length > 8;
}

static uint32_t checksum(const hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout) {
    const size_t count = (size_t)layout->length - layout->crc_bytes;
    switch (layout->crc_bytes) {
    case HEXLOAD_FRAME_CRC8:
        return hexload_crc8(frame->data, count);
    case HEXLOAD_FRAME_CRC16:
        return hexload_crc16(frame->data, count);
    case HEXLOAD_FRAME_CRC32:
        return hexload_crc32(frame->data, count);
    default:
        return 0;
    }
}

void hexload_frame_begin(hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout) {
    memset(frame, 0, sizeof *frame);
    frame->id = layout->id;
    frame->is_fd = is_fd(layout);
    frame->length = layout->length;
}

void hexload_frame_seal(hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout) {
    uint32_t crc = checksum(frame, layout);
    for (int n = layout->length - layout->crc_bytes; n < layout->length; n++) {
        frame->data[n] = (uint8_t)(crc & 0xFFu);
        crc >>= 8;
    }
}

bool hexload_frame_fits(const hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout) {
    return frame->length == layout->length && frame->is_fd == is_fd(layout);
}

hexload_bus_status_t hexload_frame_check(const hexload_bus_frame_t* frame,
                                         const hexload_frame_layout_t* layout) {
    if (frame->id != layout->id) {
        return HEXLOAD_BUS_OTHER;
    }
    if (!hexload_frame_fits(frame, layout)) {
        return HEXLOAD_BUS_ERR_LENGTH;
    }
    uint32_t found = 0;
    for (int n = layout->length - 1; n >= layout->length - layout->crc_bytes; n--) {
        found = (found << 8) | frame->data[n];
    }
    return found == checksum(frame, layout) ? HEXLOAD_BUS_OK : HEXLOAD_BUS_ERR_CRC;
}
