#include "app/authentication.h"

#include "app/saturate.h"

static void make_next_nonce(hexload_authentication_t* self) {
    hexload_bus_make_nonce(&self->cipher, self->seed, self->nonces, &self->nonce);
    self->nonces++;
}

void hexload_authentication_init(hexload_authentication_t* self, const hexload_cipher_t* cipher,
                                 uint64_t seed) {
    *self = (hexload_authentication_t){.cipher = *cipher, .seed = seed};
    if (hexload_authentication_is_on(self)) {
        make_next_nonce(self);
    }
}

/// Holds a command, and gives back the one that has waited in vain: kind 0 when none has.
static void hold(hexload_authentication_t* self, const hexload_bus_frame_t* frame,
                 hexload_bus_command_t* command) {
    const hexload_bus_command_t before = self->command;
    self->frame = *frame;
    self->command = *command;
    self->held_ms = 0;
    *command = before;
}

static hexload_bus_status_t take_code(hexload_authentication_t* self, const hexload_bus_frame_t* frame,
                                      hexload_bus_command_t* command) {
    const bool is_looked_at = self->command.kind != 0u && self->pause_ms == 0u;
    *command = (hexload_bus_command_t){0};
    if (is_looked_at) {
        *command = self->command;
    }
    self->command.kind = 0;
    if (!is_looked_at) {
        return HEXLOAD_BUS_ERR_AUTHENTICATION;
    }
    const bool matches = hexload_bus_matches_command(&self->cipher, &self->nonce, &self->frame, frame);
    self->pause_ms = matches ? 0 : HEXLOAD_AUTHENTICATION_PAUSE_MS;
    make_next_nonce(self);
    return matches ? HEXLOAD_BUS_OK : HEXLOAD_BUS_ERR_AUTHENTICATION;
}

hexload_bus_status_t hexload_authentication_take(hexload_authentication_t* self,
                                                 const hexload_bus_frame_t* frame,
                                                 hexload_bus_command_t* command) {
    hexload_bus_status_t status = hexload_bus_decode_command(frame, command);
    if (status == HEXLOAD_BUS_OK) {
        hold(self, frame, command);
        return command->kind != 0u ? HEXLOAD_BUS_ERR_AUTHENTICATION : HEXLOAD_BUS_PARTIAL;
    }
    if (status == HEXLOAD_BUS_OTHER) {
        status = hexload_bus_is_command_mac(frame);
        if (status == HEXLOAD_BUS_OK) {
            return take_code(self, frame, command);
        }
    }
    return status;
}

bool hexload_authentication_elapse(hexload_authentication_t* self, uint32_t elapsed_ms,
                                   hexload_bus_command_t* command) {
    self->pause_ms -= elapsed_ms < self->pause_ms ? elapsed_ms : self->pause_ms;
    hexload_count(&self->held_ms, elapsed_ms);
    if (self->command.kind == 0u || self->held_ms < (uint32_t)HEXLOAD_AUTHENTICATION_HOLD_MS) {
        return false;
    }
    *command = self->command;
    self->command.kind = 0;
    return true;
}
