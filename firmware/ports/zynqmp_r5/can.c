#include "can.h"

#include "message_words.h"

// Registers, by word; UG1087, module CAN.
enum {
    SRR = 0x00 / 4,
    MSR = 0x04 / 4,
    BRPR = 0x08 / 4,
    BTR = 0x0C / 4,
    SR = 0x18 / 4,
    ISR = 0x1C / 4,
    IER = 0x20 / 4,
    ICR = 0x24 / 4,
    TXFIFO = 0x30 / 4,
    RXFIFO = 0x50 / 4,
    AFR = 0x60 / 4,
};

// Their bits.
enum {
    SRR_RESET = 1 << 0,
    SRR_ENABLE = 1 << 1,
    SR_CONFIGURATION = 1 << 0,
    SR_TX_FULL = 1 << 10,
    ISR_RX_OVERFLOW = 1 << 6,
    ISR_RX_NOT_EMPTY = 1 << 7,
    ISR_BUS_OFF = 1 << 9,
};

// 1 Mbit/s from 100 MHz: 20 quanta of 50 ns, sample point at 80 %. Each field holds its value less one.
enum { PRESCALER = 5, SEGMENT_1 = 15, SEGMENT_2 = 4, JUMP_WIDTH = 4 };

// The reset is over within some periods of the CAN clock; each read of a register takes longer than one.
enum { RESET_READS = 100 };

static void enter_bus(const can_t* self) {
    volatile uint32_t* const registers = self->registers;
    registers[SRR] = SRR_RESET;
    for (int n = 0; n < RESET_READS && (registers[SR] & SR_CONFIGURATION) == 0; n++) {
    }
    registers[BRPR] = PRESCALER - 1;
    registers[BTR] = (JUMP_WIDTH - 1) << 7 | (SEGMENT_2 - 1) << 4 | (SEGMENT_1 - 1);
    registers[MSR] = 0; // normal: neither sleep, nor loop-back, nor snoop
    registers[AFR] = 0; // every frame is received
    registers[IER] = 0; // polled
    registers[ICR] = UINT32_MAX;
    registers[SRR] = SRR_ENABLE;
}

void can_start(can_t* self, volatile uint32_t* registers) {
    *self = (can_t){0};
    self->registers = registers;
    enter_bus(self);
}

// All four words are read, in their order, whatever the length: the last one frees the FIFO's place.
static bool read_words(const can_t* self, message_words_t* words) {
    volatile uint32_t* const registers = self->registers;
    if ((registers[ISR] & ISR_RX_NOT_EMPTY) == 0) {
        return false;
    }
    words->id = registers[RXFIFO];
    words->dlc = registers[RXFIFO + 1];
    words->data[0] = registers[RXFIFO + 2];
    words->data[1] = registers[RXFIFO + 3];
    registers[ICR] = ISR_RX_NOT_EMPTY; // set again at once when there is more
    return true;
}

bool can_receive(can_t* self, hexload_bus_frame_t* frame) {
    message_words_t words;
    for (int n = 0; n < CAN_FIFO_FRAMES && self->rest_ms == 0 && read_words(self, &words); n++) {
        if (message_words_unpack(&words, frame)) {
            return true;
        }
    }
    return false;
}

bool can_send(can_t* self, const hexload_bus_frame_t* frame) {
    volatile uint32_t* const registers = self->registers;
    message_words_t words;
    if (self->rest_ms != 0 || frame->is_fd || (registers[SR] & SR_TX_FULL) != 0) {
        return false;
    }
    message_words_pack(frame, &words);
    registers[TXFIFO] = words.id;
    registers[TXFIFO + 1] = words.dlc;
    registers[TXFIFO + 2] = words.data[0];
    registers[TXFIFO + 3] = words.data[1]; // sends
    return true;
}

bool can_take_overflow(can_t* self) {
    if ((self->registers[ISR] & ISR_RX_OVERFLOW) == 0) {
        return false;
    }
    self->registers[ICR] = ISR_RX_OVERFLOW;
    self->overflows++;
    return true;
}

bool can_check_bus(can_t* self, uint32_t periods) {
    if (self->rest_ms == 0 && (self->registers[ISR] & ISR_BUS_OFF) != 0) {
        self->registers[SRR] = SRR_RESET;
        self->rest_ms = CAN_BUS_OFF_MS;
        self->bus_offs++;
    } else if (self->rest_ms > periods) {
        self->rest_ms -= periods;
    } else if (self->rest_ms > 0) {
        self->rest_ms = 0;
        enter_bus(self);
    }
    return self->rest_ms == 0;
}
