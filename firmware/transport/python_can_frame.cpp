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
