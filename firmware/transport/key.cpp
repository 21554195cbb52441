#include "transport/key.hpp"

#include "ports/mbedtls/aes128.h"
#include "transport/descriptor.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

namespace hexload::transport {
namespace {

constexpr std::size_t digits = 2 * std::tuple_size_v<Key>;

int digit_of(char letter) {
    constexpr const char* all = "0123456789abcdef0123456789ABCDEF";
    const char* place = letter == '\0' ? nullptr : std::strchr(all, letter);
    return place == nullptr ? -1 : static_cast<int>((place - all) % 16);
}

void require_private(int file, const std::string& path) {
    struct stat status {};
    if (fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
        throw KeyError(path +
                       ": found no regular file, expected a key file (hexload key new FILE makes one)");
    }
    if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
        throw KeyError(
            fmt::format("{0}: found mode {1:o}, expected 600: who else can read or change it commands "
                        "the controller (chmod 600 {0})",
                        path, status.st_mode & 07777U));
    }
}

} // namespace

Key read_key(const std::string& path) {
    const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (file.get() < 0) {
        throw KeyError(fmt::format("{}: {}, expected a key file (hexload key new FILE makes one)", path,
                                   std::generic_category().message(errno)));
    }
    require_private(file.get(), path);
    std::array<char, digits + 2> text{};
    const ssize_t count = read(file.get(), text.data(), text.size());
    const bool is_whole = count == static_cast<ssize_t>(digits) ||
                          (count == static_cast<ssize_t>(digits) + 1 && text[digits] == '\n');
    Key key{};
    for (std::size_t n = 0; n < digits; ++n) {
        const int digit = is_whole ? digit_of(text[n]) : -1;
        if (digit < 0) {
            throw KeyError(path + ": found no key, expected 32 hexadecimal digits and the end of the line");
        }
        key[n / 2] = static_cast<std::uint8_t>(key[n / 2] << 4 | digit);
    }
    return key;
}

Aes128::Aes128(const Key& key) : state_(new hexload_aes128_t) {
    hexload_aes128_init(state_.get(), key.data());
}

void Aes128::Delete::operator()(hexload_aes128* state) const {
    delete state;
}

hexload_cipher_t Aes128::cipher() const {
    return {state_.get(), hexload_aes128_encrypt_block};
}

std::uint64_t draw_nonce_seed() {
    std::uint64_t seed = 0;
    if (getrandom(&seed, sizeof seed, 0) != static_cast<ssize_t>(sizeof seed)) {
        throw std::system_error(errno, std::generic_category(), "random numbers");
    }
    return seed;
}

} // namespace hexload::transport
