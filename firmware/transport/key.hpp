// The key with which commands to a controller are authenticated, from a file, and AES with it.
#pragma once

#include "bus/cmac.h"

#include <array>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

struct hexload_aes128;

namespace hexload::transport {

using Key = std::array<std::uint8_t, 16>;

class KeyError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

// 32 hexadecimal digits, in a file that nobody but its owner may read or write. Throws KeyError.
Key read_key(const std::string& path);

// AES-128 of mbedTLS.
class Aes128 {
  public:
    explicit Aes128(const Key& key);
    // Valid as long as this object is, wherever it is moved.
    hexload_cipher_t cipher() const;

  private:
    struct Delete {
        void operator()(hexload_aes128* state) const;
    };
    std::unique_ptr<hexload_aes128, Delete> state_;
};

// Random bits of the system's: no start of a controller has had them before.
std::uint64_t draw_nonce_seed();

} // namespace hexload::transport
