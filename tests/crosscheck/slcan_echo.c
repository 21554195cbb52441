/// Reads SLCAN on stdin until its end and answers each frame on stdout with another one, which shows how it
/// was read: identifier with all bits turned, each byte one more. Then it prints what else it read on stderr.
#include "bus/slcan.h"

#include <stdio.h>

static void answer(hexload_bus_frame_t frame) {
    char text[HEXLOAD_SLCAN_FRAME_BYTES];
    frame.id ^= 0x7FFU;
    for (int n = 0; n < HEXLOAD_BUS_FRAME_BYTES; n++) {
        frame.data[n]++;
    }
    const int count = hexload_slcan_encode(&frame, text);
    if (count > 0) {
        fwrite(text, 1, (size_t)count, stdout);
        fflush(stdout);
    }
}

int main(void) {
    hexload_slcan_t slcan;
    hexload_bus_frame_t frame;
    hexload_slcan_init(&slcan);
    setvbuf(stdin, NULL, _IONBF, 0);
    for (int byte = getchar(); byte != EOF; byte = getchar()) {
        if (hexload_slcan_take(&slcan, (char)byte, &frame)) {
            answer(frame);
        }
    }
    fprintf(stderr, "%u %u %u", slcan.passed_over, slcan.dropped, slcan.refusals);
    return 0;
}
