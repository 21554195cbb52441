#include "motion_file.hpp"

#include "platform_file/input_error.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <string>
#include <string_view>

namespace hexload::sim {
namespace {

constexpr std::string_view header_of_motions = "t,x,y,z,roll,pitch,yaw";
constexpr std::array<const char*, 7> column_names{"t", "x", "y", "z", "roll", "pitch", "yaw"};

std::string_view without_carriage_return(std::string_view line) {
    return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
}

std::array<double, 7> parse_row(const std::string& file, std::size_t line_number, std::string_view line) {
    std::array<double, 7> values{};
    for (std::size_t column = 0; column < values.size(); ++column) {
        const bool is_last = column + 1 == values.size();
        const std::size_t comma = line.find(',');
        if ((comma == std::string_view::npos) != is_last) {
            throw InputError(file, line_number, column_names[column],
                             is_last ? "more columns" : "too few columns", "seven columns");
        }
        const std::string_view field = line.substr(0, comma);
        const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), values[column]);
        if (error != std::errc{} || end != field.data() + field.size() || !std::isfinite(values[column])) {
            throw InputError(file, line_number, column_names[column], "\"" + std::string(field) + "\"",
                             "a finite number");
        }
        line.remove_prefix(is_last ? line.size() : comma + 1);
    }
    return values;
}

} // namespace

std::vector<MotionFileRow> read_motion_file(const std::filesystem::path& path) {
    const std::string file = path.string();
    std::ifstream stream(path);
    if (!std::filesystem::is_regular_file(path) || !stream) {
        throw InputError(file + ": found no such file, expected a trajectory CSV");
    }
    std::string line;
    std::getline(stream, line);
    if (without_carriage_return(line) != header_of_motions) {
        throw InputError(file, 1, "header", "\"" + line + "\"", "\"" + std::string(header_of_motions) + "\"");
    }
    std::vector<MotionFileRow> rows;
    for (std::size_t line_number = 2; std::getline(stream, line); ++line_number) {
        const std::array<double, 7> values = parse_row(file, line_number, without_carriage_return(line));
        if (!rows.empty() && !(values[0] > rows.back().t_s)) {
            throw InputError(file, line_number, "t", std::to_string(values[0]), "a time after the row above");
        }
        rows.push_back({values[0], Vector6(values.data() + 1)});
    }
    if (rows.size() < 2) {
        throw InputError(file + ": found " + std::to_string(rows.size()) + " rows, expected at least two");
    }
    return rows;
}

} // namespace hexload::sim
