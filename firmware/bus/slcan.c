#include "bus/slcan.h"

#include <string.h>

enum {
    HEADER_CHARACTERS = 5, // t, three of the identifier, length
    TIME_CHARACTERS = 4,
    LONGEST_IDENTIFIER = 0x7FF,
    NO_DIGIT = 16,
};

static const char line_end = '\r';
static const char bell = '\a';

// First letters of lines that the format knows, other than t: frames that are not ours, commands, and answers
// to them.
static const char known_letters[] = "TrRdDbBzZOLCSsYvVNFXWMmPAUQ";

static void count(uint32_t* counter) {
    if (*counter < UINT32_MAX) {
        *counter += 1;
    }
}

static void put_digits(char* text, uint32_t value, int digits) {
    static const char names[] = "0123456789ABCDEF";
    for (int n = 0; n < digits; n++) {
        text[n] = names[(value >> (4 * (digits - 1 - n))) & 0xFU];
    }
}

int hexload_slcan_encode(const hexload_bus_frame_t* frame, char text[HEXLOAD_SLCAN_FRAME_BYTES]) {
    if (frame->is_fd || frame->length > 8) {
        return HEXLOAD_BUS_ERR_LENGTH;
    }
    if (frame->id > LONGEST_IDENTIFIER) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    text[0] = 't';
    put_digits(&text[1], frame->id, 3);
    put_digits(&text[4], frame->length, 1);
    for (int n = 0; n < frame->length; n++) {
        put_digits(&text[HEADER_CHARACTERS + 2 * n], frame->data[n], 2);
    }
    const int end = HEADER_CHARACTERS + 2 * frame->length;
    text[end] = line_end;
    return end + 1;
}

/// NO_DIGIT for a character that is none.
static uint32_t digit_of(char character) {
    if (character >= '0' && character <= '9') {
        return (uint32_t)(character - '0');
    }
    if (character >= 'A' && character <= 'F') {
        return (uint32_t)(character - 'A' + 10);
    }
    if (character >= 'a' && character <= 'f') {
        return (uint32_t)(character - 'a' + 10);
    }
    return NO_DIGIT;
}

/// The number that the digits give; false when one of them is none.
static bool read_digits(const char* text, int digits, uint32_t* value) {
    *value = 0;
    for (int n = 0; n < digits; n++) {
        const uint32_t digit = digit_of(text[n]);
        if (digit == NO_DIGIT) {
            return false;
        }
        *value = 16U * *value + digit;
    }
    return true;
}

static bool read_frame(const hexload_slcan_t* self, hexload_bus_frame_t* frame) {
    hexload_bus_frame_t found = {0};
    uint32_t length = 0;
    uint32_t byte = 0;
    if (self->length < HEADER_CHARACTERS || !read_digits(&self->line[1], 3, &found.id) ||
        !read_digits(&self->line[4], 1, &length) || found.id > LONGEST_IDENTIFIER || length > 8) {
        return false;
    }
    const int end = HEADER_CHARACTERS + 2 * (int)length;
    const bool has_time = self->length == end + TIME_CHARACTERS;
    if (has_time ? !read_digits(&self->line[end], TIME_CHARACTERS, &byte) : self->length != end) {
        return false;
    }
    found.length = (uint8_t)length;
    for (int n = 0; n < (int)length; n++) {
        if (!read_digits(&self->line[HEADER_CHARACTERS + 2 * n], 2, &byte)) {
            return false;
        }
        found.data[n] = (uint8_t)byte;
    }
    *frame = found;
    return true;
}

static bool end_line(hexload_slcan_t* self, hexload_bus_frame_t* frame) {
    const char first = self->line[0];
    if (self->length > 0 && first == 't') {
        const bool is_frame = self->length <= HEXLOAD_SLCAN_LINE_BYTES && read_frame(self, frame);
        if (!is_frame) {
            count(&self->dropped);
        }
        return is_frame;
    }
    const bool is_known = self->length == 0 || (first != '\0' && strchr(known_letters, first) != NULL);
    count(is_known ? &self->passed_over : &self->dropped);
    return false;
}

void hexload_slcan_init(hexload_slcan_t* self) {
    *self = (hexload_slcan_t){0};
}

bool hexload_slcan_take(hexload_slcan_t* self, char byte, hexload_bus_frame_t* frame) {
    bool is_frame = false;
    if (byte == line_end) {
        is_frame = end_line(self, frame);
        self->length = 0;
    } else if (byte == bell) {
        count(&self->refusals);
        if (self->length > 0) {
            count(&self->dropped);
        }
        self->length = 0;
    } else if (self->length < HEXLOAD_SLCAN_LINE_BYTES) {
        self->line[self->length] = byte;
        self->length++;
    } else {
        self->length = HEXLOAD_SLCAN_LINE_BYTES + 1;
    }
    return is_frame;
}
