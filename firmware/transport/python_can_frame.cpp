#include "python_can_frame.hpp"

#include <msgpack.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string_view>

namespace hexload::transport {
namespace {

constexpr std::uint32_t highest_standard_id = 0x7FF;
constexpr std::size_t classic_bytes = 8;
constexpr std::size_t fd_bytes = HEXLOAD_BUS_FRAME_BYTES;

int append(void* context, const char* data, std::size_t size) {
    auto& packed = *static_cast<std::vector<char>*>(context);
    packed.insert(packed.end(), data, data + size);
    return 0;
}

void pack_key(msgpack_packer& packer, std::string_view key) {
    msgpack_pack_str(&packer, key.size());
    msgpack_pack_str_body(&packer, key.data(), key.size());
}

void pack_flag(msgpack_packer& packer, std::string_view key, bool value) {
    pack_key(packer, key);
    if (value) {
        msgpack_pack_true(&packer);
    } else {
        msgpack_pack_false(&packer);
    }
}

// Bytes of a msgpack object that holds no other; nothing: it may.
std::optional<std::size_t> bytes_of_scalar(std::span<const char> packed) {
    const auto byte = [packed](std::size_t n) {
        return n < packed.size() ? static_cast<unsigned char>(packed[n]) : 0U;
    };
    const unsigned type = byte(0);
    const std::size_t two = byte(1) << 8U | byte(2);
    if (type < 0x80 || type >= 0xE0 || type == 0xC0 || type == 0xC2 ||
        type == 0xC3) { // small numbers, nil, flags
        return 1;
    }
    if (type >= 0xA0 && type < 0xC0) { // short texts
        return 1 + (type & 0x1FU);
    }
    switch (type) {
    case 0xC4: // bytes and texts with a length of 8 or 16 bits
    case 0xD9:
        return 2 + byte(1);
    case 0xC5:
    case 0xDA:
        return 3 + two;
    case 0xCC: // numbers
    case 0xD0:
        return 2;
    case 0xCD:
    case 0xD1:
        return 3;
    case 0xCA:
    case 0xCE:
    case 0xD2:
        return 5;
    case 0xCB:
    case 0xCF:
    case 0xD3:
        return 9;
    default: // maps, arrays, extensions, lengths of 32 bits
        return std::nullopt;
    }
}

// The fields that we look at; the others (timestamp, channel, bit-rate switch, error state) may be anything.
struct Fields {
    std::optional<std::uint64_t> id;
    std::optional<std::span<const char>> data;
    bool is_extended = false;
    bool is_remote = false;
    bool is_error = false;
    bool is_fd = false;
};

void read_field(std::string_view key, const msgpack_object& value, Fields& fields) {
    const bool flag = value.type == MSGPACK_OBJECT_BOOLEAN && value.via.boolean;
    if (key == "arbitration_id" && value.type == MSGPACK_OBJECT_POSITIVE_INTEGER) {
        fields.id = value.via.u64;
    } else if (key == "data" && value.type == MSGPACK_OBJECT_BIN) {
        fields.data.emplace(value.via.bin.ptr, value.via.bin.size);
    } else if (key == "is_extended_id") {
        fields.is_extended = flag;
    } else if (key == "is_remote_frame") {
        fields.is_remote = flag;
    } else if (key == "is_error_frame") {
        fields.is_error = flag;
    } else if (key == "is_fd") {
        fields.is_fd = flag;
    }
}

Datagram to_datagram(const Fields& fields) {
    if (!fields.id || !fields.data) {
        return {};
    }
    if (fields.is_extended || fields.is_remote || fields.is_error) {
        return {.kind = DatagramKind::other_frame};
    }
    const std::size_t longest = fields.is_fd ? fd_bytes : classic_bytes;
    if (*fields.id > highest_standard_id || fields.data->size() > longest) {
        return {};
    }
    Datagram datagram{.kind = DatagramKind::frame};
    datagram.frame.id = static_cast<std::uint32_t>(*fields.id);
    datagram.frame.is_fd = fields.is_fd;
    datagram.frame.length = static_cast<std::uint8_t>(fields.data->size());
    std::copy(fields.data->begin(), fields.data->end(), datagram.frame.data);
    return datagram;
}

// A map of 15 fields at most with no container in it: msgpack would allocate what a header claims, whatever
// the datagram holds. Counts what the bytes say, without looking at them more closely than that.
bool is_flat_map(std::span<const char> packed) {
    constexpr unsigned fixmap = 0x80;
    if (packed.empty() || (static_cast<unsigned char>(packed[0]) & 0xF0U) != fixmap) {
        return false;
    }
    std::size_t left = std::size_t{2} * (static_cast<unsigned char>(packed[0]) & 0x0FU);
    std::size_t at = 1;
    for (; left > 0 && at < packed.size(); --left) {
        const auto bytes = bytes_of_scalar(packed.subspan(at));
        if (!bytes) {
            return false;
        }
        at += *bytes;
    }
    return left == 0 && at <= packed.size();
}

} // namespace

void pack_frame(const hexload_bus_frame_t& frame, double timestamp_s, std::vector<char>& packed) {
    packed.clear();
    msgpack_packer packer;
    msgpack_packer_init(&packer, &packed, append);
    msgpack_pack_map(&packer, 11);
    pack_key(packer, "timestamp");
    msgpack_pack_double(&packer, timestamp_s);
    pack_key(packer, "arbitration_id");
    msgpack_pack_uint32(&packer, frame.id);
    pack_flag(packer, "is_extended_id", false);
    pack_flag(packer, "is_remote_frame", false);
    pack_flag(packer, "is_error_frame", false);
    pack_key(packer, "channel");
    msgpack_pack_nil(&packer);
    pack_key(packer, "dlc");
    msgpack_pack_uint8(&packer, frame.length); // python-can means the number of bytes
    pack_key(packer, "data");
    msgpack_pack_bin(&packer, frame.length);
    msgpack_pack_bin_body(&packer, frame.data, frame.length);
    pack_flag(packer, "is_fd", frame.is_fd);
    pack_flag(packer, "bitrate_switch", frame.is_fd);
    pack_flag(packer, "error_state_indicator", false);
}

Datagram unpack_frame(std::span<const char> packed) {
    if (!is_flat_map(packed)) {
        return {};
    }
    msgpack_unpacked unpacked;
    msgpack_unpacked_init(&unpacked);
    const std::unique_ptr<msgpack_unpacked, decltype(&msgpack_unpacked_destroy)> owner(
        &unpacked, &msgpack_unpacked_destroy);
    if (msgpack_unpack_next(&unpacked, packed.data(), packed.size(), nullptr) != MSGPACK_UNPACK_SUCCESS ||
        unpacked.data.type != MSGPACK_OBJECT_MAP) {
        return {};
    }
    Fields fields;
    for (std::uint32_t k = 0; k < unpacked.data.via.map.size; ++k) {
        const msgpack_object_kv& entry = unpacked.data.via.map.ptr[k];
        if (entry.key.type == MSGPACK_OBJECT_STR) {
            read_field({entry.key.via.str.ptr, entry.key.via.str.size}, entry.val, fields);
        }
    }
    return to_datagram(fields);
}

} // namespace hexload::transport
