// What toml++ takes for granted of a file is asked in every build, and refused: by itself it would end the
// program, or with NDEBUG tell the compiler that it cannot be otherwise. "[=]" is such a file.
#undef NDEBUG
#define TOML_ASSERT(expr) hexload::platform::assert_of_parser((expr) ? true : false)
#include <stdexcept>
namespace hexload::platform {
struct ParserFailed : std::logic_error {
    using std::logic_error::logic_error;
};
constexpr void assert_of_parser(bool holds) {
    if (!holds) {
        throw ParserFailed("toml++");
    }
}
} // namespace hexload::platform

// The library's code, once; every other file sees its declarations only.
#define TOML_IMPLEMENTATION
#include "toml_fields.hpp"

#include "input_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <numeric>
#include <sstream>
#include <utility>

namespace hexload::platform {
namespace {

std::string describe(const toml::node& node) {
    std::ostringstream words;
    node.visit([&](const auto& value) {
        using Node = std::decay_t<decltype(value)>;
        if constexpr (toml::is_array<Node>) {
            words << "an array of " << value.size();
        } else if constexpr (toml::is_table<Node>) {
            words << "a table";
        } else if constexpr (toml::is_string<Node>) {
            words << '"' << value.get() << '"';
        } else {
            words << value;
        }
    });
    return words.str();
}

std::size_t line_of(const toml::node& node) {
    return node.source().begin.line;
}

// Bytes of the character that begins with `lead`; 0: none does.
std::size_t bytes_of_character(unsigned char lead) {
    if (lead < 0x80) {
        return 1;
    }
    if (lead < 0xc2 || lead > 0xf4) {
        return 0;
    }
    return lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
}

// Where text stops being UTF-8; its size: nowhere. Which code points there are is left to the parser.
std::size_t end_of_utf8(std::string_view text) {
    std::size_t place = 0;
    while (place < text.size()) {
        const std::size_t size = bytes_of_character(static_cast<unsigned char>(text[place]));
        const std::string_view character = text.substr(place, size);
        const bool is_whole = size > 0 && character.size() == size &&
                              std::all_of(character.begin() + 1, character.end(), [](char next) {
                                  return (static_cast<unsigned char>(next) & 0xc0) == 0x80;
                              });
        if (!is_whole) {
            break;
        }
        place += size;
    }
    return place;
}

// A file in another encoding is refused with the command that mends it.
void refuse_other_encodings(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    const auto mend = [&path](std::string_view encoding) {
        const std::string name = path.filename().string();
        return fmt::format("expected UTF-8: iconv -f {} -t utf-8 {} > utf8-{}", encoding, name, name);
    };
    if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
        throw InputError(fmt::format("{}:1: found text in UTF-16, {}", path.string(), mend("utf-16")));
    }
    const std::size_t end = end_of_utf8(text);
    if (end < text.size()) {
        throw InputError(fmt::format("{}:{}: found byte 0x{:02x}, which is no UTF-8 but may be Latin-1, {}",
                                     path.string(), 1 + std::ranges::count(text.substr(0, end), '\n'),
                                     static_cast<unsigned char>(text[end]), mend("latin1")));
    }
}

// Letters to add, leave out or change (Levenshtein's distance).
std::size_t edits_between(std::string_view one, std::string_view other) {
    std::vector<std::size_t> row(other.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < one.size(); ++i) {
        std::size_t before = std::exchange(row[0], i + 1);
        for (std::size_t j = 0; j < other.size(); ++j) {
            const std::size_t changed = before + (one[i] == other[j] ? 0 : 1);
            before = std::exchange(row[j + 1], std::min({row[j] + 1, row[j + 1] + 1, changed}));
        }
    }
    return row.back();
}

// One a misspelling of the other, or without its unit.
bool are_alike(std::string_view one, std::string_view other) {
    return one.starts_with(other) || other.starts_with(one) ||
           edits_between(one, other) <= 1 + std::min(one.size(), other.size()) / 4;
}

} // namespace

toml::table parse_toml_file(const std::filesystem::path& path) {
    if (!std::filesystem::is_regular_file(path)) {
        throw InputError(path.string() + ": found no such file, expected a TOML file");
    }
    try {
        return toml::parse_file(path.string());
    } catch (const toml::parse_error& error) {
        refuse_other_encodings(path);
        throw InputError(fmt::format("{}:{}: {}", path.string(), error.source().begin.line,
                                     std::string(error.description())));
    } catch (const ParserFailed&) {
        throw InputError(path.string() +
                         ": found text that is no TOML, expected [table] headers and key = value");
    }
}

TomlReader::TomlReader(std::string file, const toml::table& table, std::string path)
    : file_(std::move(file)), table_(&table), path_(std::move(path)) {}

void TomlReader::number(std::string_view key, double& value, const Range& range) {
    if (const toml::node* node = find(key)) {
        value = to_number(key, *node, range);
    }
}

void TomlReader::optional_number(std::string_view key, std::optional<double>& value, const Range& range) {
    if (const toml::node* node = find(key)) {
        value = to_number(key, *node, range);
    }
}

void TomlReader::integer(std::string_view key, std::int64_t& value, std::int64_t min, std::int64_t max) {
    if (const toml::node* node = find(key)) {
        const auto* found = node->as_integer();
        if (found == nullptr || found->get() < min || found->get() > max) {
            fail(key, describe(*node), fmt::format("a whole number from {} to {}", min, max));
        }
        value = found->get();
    }
}

void TomlReader::boolean(std::string_view key, bool& value) {
    if (const toml::node* node = find(key)) {
        const auto* found = node->as_boolean();
        if (found == nullptr) {
            fail(key, describe(*node), "true or false");
        }
        value = found->get();
    }
}

void TomlReader::text(std::string_view key, std::string& value) {
    if (const toml::node* node = find(key)) {
        const auto* found = node->as_string();
        if (found == nullptr) {
            fail(key, describe(*node), "a string");
        }
        value = found->get();
    }
}

void TomlReader::numbers(std::string_view key, std::span<double> values, const Range& range) {
    if (const toml::node* node = find(key)) {
        read_numbers(key, *node, values, range);
    }
}

void TomlReader::vector3(std::string_view key, Vector3& value, const Range& range) {
    numbers(key, {value.data(), 3}, range);
}

void TomlReader::vector6(std::string_view key, Vector6& value) {
    numbers(key, {value.data(), 6});
}

void TomlReader::legs(std::string_view key, Legs& value, const Range& range) {
    const toml::node* node = find(key);
    if (node != nullptr && node->is_number()) {
        value.setConstant(to_number(key, *node, range));
    } else if (node != nullptr && node->is_array()) {
        read_numbers(key, *node, {value.data(), 6}, range);
    } else if (node != nullptr) {
        fail(key, describe(*node), fmt::format("{}, or an array of 6 of them", range.words));
    }
}

void TomlReader::tensor(std::string_view key, Matrix3& value, const Range& range) {
    if (const toml::node* node = find(key)) {
        Vector6 entries;
        read_numbers(key, *node, {entries.data(), 6}, range);
        value << entries(0), entries(3), entries(4), //
            entries(3), entries(1), entries(5),      //
            entries(4), entries(5), entries(2);
    }
}

void TomlReader::points(std::string_view key, std::array<Vector3, 6>& value, const Range& range) {
    if (const toml::node* node = find(key)) {
        const toml::array& rows = to_array(key, *node, value.size());
        for (std::size_t row = 0; row < value.size(); ++row) {
            read_numbers(fmt::format("{}[{}]", key, row), rows[row], {value[row].data(), 3}, range);
        }
    }
}

bool TomlReader::has(std::string_view key) const {
    return table_->contains(key);
}

void TomlReader::require(std::string_view key) {
    known_keys_.emplace(key);
    if (has(key)) {
        return;
    }
    for (const auto& [found, node] : *table_) {
        if (!known_keys_.contains(found.str()) && are_alike(found.str(), key)) {
            refuse_misspelt(found.str(), node, key);
        }
    }
    fail(key, "nothing", "this key");
}

TomlReader TomlReader::table(std::string_view key) {
    static const toml::table empty;
    const toml::node* node = find(key);
    if (node == nullptr) {
        return {file_, empty, qualified(key)};
    }
    if (!node->is_table()) {
        fail(key, describe(*node), "a table");
    }
    return {file_, *node->as_table(), qualified(key)};
}

std::vector<TomlReader> TomlReader::tables(std::string_view key) {
    std::vector<TomlReader> readers;
    if (const toml::node* node = find(key)) {
        if (!node->is_array_of_tables()) {
            fail(key, describe(*node), fmt::format("one or more [[{}]] tables", key));
        }
        for (const toml::node& entry : *node->as_array()) {
            readers.emplace_back(file_, *entry.as_table(),
                                 fmt::format("{}[{}]", qualified(key), readers.size()));
        }
    }
    return readers;
}

void TomlReader::refuse_unknown_keys() const {
    for (const auto& [key, node] : *table_) {
        const std::string_view found = key.str();
        if (known_keys_.contains(found)) {
            continue;
        }
        const auto nearest =
            std::min_element(known_keys_.begin(), known_keys_.end(),
                             [found](const std::string& one, const std::string& other) {
                                 return edits_between(one, found) < edits_between(other, found);
                             });
        if (nearest != known_keys_.end() && are_alike(*nearest, found)) {
            refuse_misspelt(found, node, *nearest);
        }
        throw InputError(file_, line_of(node), qualified(found), "an unknown key",
                         fmt::format("one of {}", fmt::join(known_keys_, ", ")));
    }
}

void TomlReader::refuse_misspelt(std::string_view found, const toml::node& node,
                                 std::string_view meant) const {
    throw InputError(fmt::format("{}:{}: {}: found an unknown key, did you mean {}?", file_, line_of(node),
                                 qualified(found), qualified(meant)));
}

void TomlReader::fail(std::string_view key, const std::string& found, const std::string& expected) const {
    const toml::node* node = table_->get(key.substr(0, key.find('[')));
    throw InputError(file_, node != nullptr ? line_of(*node) : std::max<std::size_t>(line_of(*table_), 1),
                     qualified(key), found, expected);
}

const toml::node* TomlReader::find(std::string_view key) {
    known_keys_.emplace(key);
    return table_->get(key);
}

double TomlReader::to_number(std::string_view key, const toml::node& node, const Range& range) const {
    const std::optional<double> value = node.value<double>();
    if (!node.is_number() || !value || !(*value >= range.min && *value <= range.max)) {
        fail(key, describe(node), range.words);
    }
    return *value;
}

const toml::array& TomlReader::to_array(std::string_view key, const toml::node& node,
                                        std::size_t size) const {
    const toml::array* array = node.as_array();
    if (array == nullptr || array->size() != size) {
        fail(key, describe(node), fmt::format("an array of {}", size));
    }
    return *array;
}

void TomlReader::read_numbers(std::string_view key, const toml::node& node, std::span<double> values,
                              const Range& range) const {
    const toml::array& entries = to_array(key, node, values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
        values[i] = to_number(fmt::format("{}[{}]", key, i), entries[i], range);
    }
}

std::string TomlReader::qualified(std::string_view key) const {
    return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

void TomlWriter::number(std::string_view key, const double& value, const Range&) {
    table_.insert(key, value);
}

void TomlWriter::integer(std::string_view key, const std::int64_t& value, std::int64_t, std::int64_t) {
    table_.insert(key, value);
}

void TomlWriter::boolean(std::string_view key, const bool& value) {
    table_.insert(key, value);
}

void TomlWriter::text(std::string_view key, const std::string& value) {
    table_.insert(key, value);
}

void TomlWriter::vector3(std::string_view key, const Vector3& value) {
    table_.insert(key, toml::array{value.x(), value.y(), value.z()});
}

void TomlWriter::numbers(std::string_view key, std::span<const double> values, const Range&) {
    toml::array array;
    for (const double value : values) {
        array.push_back(value);
    }
    table_.insert(key, std::move(array));
}

void TomlWriter::legs(std::string_view key, const Legs& value, const Range& range) {
    if ((value == value(0)).all()) {
        number(key, value(0), range);
    } else {
        numbers(key, {value.data(), 6}, range);
    }
}

void TomlWriter::points(std::string_view key, const std::array<Vector3, 6>& value) {
    toml::array rows;
    for (const Vector3& point : value) {
        rows.push_back(toml::array{point.x(), point.y(), point.z()});
    }
    table_.insert(key, std::move(rows));
}

void TomlWriter::vector6(std::string_view key, const Vector6& value) {
    table_.insert(key, toml::array{value(0), value(1), value(2), value(3), value(4), value(5)});
}

void TomlWriter::tensor(std::string_view key, const Matrix3& value) {
    table_.insert(key,
                  toml::array{value(0, 0), value(1, 1), value(2, 2), value(0, 1), value(0, 2), value(1, 2)});
}

toml::table TomlWriter::take() {
    return std::move(table_);
}

} // namespace hexload::platform
