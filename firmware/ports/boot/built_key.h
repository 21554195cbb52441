/// @file built_key.h
/// The key that an image was built with (CMake: HEXLOAD_KEY_FILE), for boards without a key store.
#ifndef HEXLOAD_BUILT_KEY_H
#define HEXLOAD_BUILT_KEY_H

#include "app/port.h"

/// Gives a port the cipher, when the image has a key.
/// @param nonce_seed as the port has it; 0: the machine has none.
/// @return false: there is a key and no seed. Then the controller must not start: at each start the commands
///         of the one before could be played again.
bool hexload_built_key_give(hexload_port_t* port, uint64_t nonce_seed);

#endif
