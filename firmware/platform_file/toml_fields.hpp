// Typed reading and writing of TOML tables. A section of a file is described once, as a function that names
// each field to a visitor; TomlReader and TomlWriter are the two visitors.
#pragma once

#include "types.hpp"

#include <toml++/toml.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hexload::platform {

struct Range {
    double min;
    double max;
    const char* words;
};
inline constexpr double unbounded = std::numeric_limits<double>::max(); // refuses inf and nan
inline constexpr Range any_number{-unbounded, unbounded, "a finite number"};
inline constexpr Range positive{std::numeric_limits<double>::min(), unbounded, "a number > 0"};
inline constexpr Range non_negative{0.0, unbounded, "a number >= 0"};
inline constexpr Range fraction{0.0, 1.0, "a number from 0 to 1"};

template <typename Enum> struct Choice {
    std::string_view name;
    Enum value;
};

// The name of a value that has one.
template <typename Enum, std::size_t n>
constexpr std::string_view name_in(const std::array<Choice<Enum>, n>& choices, Enum value) {
    std::size_t i = 0;
    while (choices[i].value != value) {
        ++i;
    }
    return choices[i].name;
}

// Throws InputError for a missing file, another encoding than UTF-8, or bad syntax.
toml::table parse_toml_file(const std::filesystem::path& path);

// Reads one table. A method leaves `value` alone where the key is absent; the require_ forms refuse that.
class TomlReader {
  public:
    TomlReader(std::string file, const toml::table& table, std::string path = {});

    void number(std::string_view key, double& value, const Range& range = any_number);
    void optional_number(std::string_view key, std::optional<double>& value, const Range& range);
    void integer(std::string_view key, std::int64_t& value, std::int64_t min, std::int64_t max);
    void boolean(std::string_view key, bool& value);
    void text(std::string_view key, std::string& value);
    void numbers(std::string_view key, std::span<double> values, const Range& range = any_number);
    void vector3(std::string_view key, Vector3& value, const Range& range = any_number);
    void vector6(std::string_view key, Vector6& value);
    void legs(std::string_view key, Legs& value, const Range& range); // one number for all, or six
    // [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]
    void tensor(std::string_view key, Matrix3& value, const Range& range = any_number);
    void points(std::string_view key, std::array<Vector3, 6>& value, const Range& range = any_number);

    template <typename Enum, std::size_t n>
    void choice(std::string_view key, Enum& value, const std::array<Choice<Enum>, n>& choices);

    bool has(std::string_view key) const;
    void require(std::string_view key);     // refuses an absent key
    TomlReader table(std::string_view key); // an absent table reads as empty
    std::vector<TomlReader> tables(std::string_view key);
    void refuse_unknown_keys() const;

    [[noreturn]] void fail(std::string_view key, const std::string& found, const std::string& expected) const;

  private:
    const toml::node* find(std::string_view key);
    [[noreturn]] void refuse_misspelt(std::string_view found, const toml::node& node,
                                      std::string_view meant) const;
    double to_number(std::string_view key, const toml::node& node, const Range& range) const;
    const toml::array& to_array(std::string_view key, const toml::node& node, std::size_t size) const;
    void read_numbers(std::string_view key, const toml::node& node, std::span<double> values,
                      const Range& range) const;
    std::string qualified(std::string_view key) const;

    std::string file_;
    const toml::table* table_;
    std::string path_;
    std::set<std::string, std::less<>> known_keys_;
};

// Writes the same fields into a table.
class TomlWriter {
  public:
    void number(std::string_view key, const double& value, const Range& = any_number);
    void integer(std::string_view key, const std::int64_t& value, std::int64_t, std::int64_t);
    void boolean(std::string_view key, const bool& value);
    void text(std::string_view key, const std::string& value);
    void vector3(std::string_view key, const Vector3& value);
    void numbers(std::string_view key, std::span<const double> values, const Range& = any_number);
    void vector6(std::string_view key, const Vector6& value);
    void legs(std::string_view key, const Legs& value, const Range&); // as short as it was read
    void tensor(std::string_view key, const Matrix3& value);
    void points(std::string_view key, const std::array<Vector3, 6>& value);
    template <typename Enum, std::size_t n>
    void choice(std::string_view key, const Enum& value, const std::array<Choice<Enum>, n>& choices) {
        text(key, std::string(name_in(choices, value)));
    }

    toml::table take();

  private:
    toml::table table_;
};

template <typename Enum, std::size_t n>
void TomlReader::choice(std::string_view key, Enum& value, const std::array<Choice<Enum>, n>& choices) {
    std::string name;
    text(key, name);
    if (!has(key)) {
        return;
    }
    std::string names;
    for (const Choice<Enum>& candidate : choices) {
        if (candidate.name == name) {
            value = candidate.value;
            return;
        }
        names += (names.empty() ? "\"" : ", \"") + std::string(candidate.name) + "\"";
    }
    fail(key, "\"" + name + "\"", "one of " + names);
}

} // namespace hexload::platform
