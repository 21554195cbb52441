/// Bytes of a serial line; what is read can be written and read again.
#include "bytes.h"

#include "bus/slcan.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    hexload_slcan_t slcan;
    hexload_bus_frame_t frame, again;
    hexload_slcan_init(&slcan);
    for (size_t n = 0; n < size; n++) {
        if (hexload_slcan_take(&slcan, (char)data[n], &frame)) {
            hexload_slcan_t other;
            char text[HEXLOAD_SLCAN_FRAME_BYTES];
            const int count = hexload_slcan_encode(&frame, text);
            bool is_read = false;
            PROMISE(count > 0 && (size_t)count <= sizeof text);
            hexload_slcan_init(&other);
            for (int k = 0; k < count; k++) {
                is_read = hexload_slcan_take(&other, text[k], &again);
            }
            PROMISE(is_read && frame.id == again.id && frame.length == again.length);
            PROMISE(memcmp(frame.data, again.data, frame.length) == 0);
        }
    }
    return 0;
}
