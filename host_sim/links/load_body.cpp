#include "load_body.hpp"

#include "write_error.hpp"

#include <hexload/estimate.h>

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <limits>

namespace hexload::sim {

namespace {

constexpr std::size_t size = HEXLOAD_LOAD_DIM;

template <std::size_t count>
void copy_known(const hexload_real_t (&values)[count], bool is_known, std::size_t first,
                std::array<double, size>& to) {
    for (std::size_t k = 0; k < count; k++) {
        to[first + k] = is_known ? static_cast<double>(values[k]) : std::numeric_limits<double>::quiet_NaN();
    }
}

void copy_values(const hexload_body_t& body, std::array<double, size>& value) {
    value[0] = static_cast<double>(body.mass_kg);
    copy_known(body.com_m, body.has_com, 1, value);
    copy_known(body.inertia_kg_m2, body.has_inertia, 4, value);
}

void append(fmt::memory_buffer& line, double value) {
    line.push_back(',');
    if (!std::isnan(value)) {
        fmt::format_to(std::back_inserter(line), "{:.9g}", value);
    }
}

void append(fmt::memory_buffer& line, const std::array<double, size>& values) {
    for (const double value : values) {
        append(line, value);
    }
}

void write_line(std::FILE* file, const std::filesystem::path& path, const fmt::memory_buffer& line) {
    if (std::fwrite(line.data(), 1, line.size(), file) != line.size()) {
        throw_write_error(path);
    }
}

} // namespace

LoadBody load_body(const EstimateRow& row, std::span<const double> covariance) {
    std::array<hexload_real_t, HEXLOAD_LOAD_COVARIANCES> packed{};
    std::array<hexload_real_t, size> theta{};
    std::array<hexload_real_t, size> nearest{};
    const auto states = static_cast<std::size_t>(std::lround(std::sqrt(covariance.size())));
    std::size_t entry = 0;
    for (std::size_t i = 0; i < size; i++) {
        theta[i] = static_cast<hexload_real_t>(row.value[i]);
        for (std::size_t j = 0; j <= i; j++, entry++) {
            packed[entry] = static_cast<hexload_real_t>(i == j ? row.sigma[i] * row.sigma[i]
                                                               : covariance[i * states + j]);
        }
    }
    hexload_body_t body;
    hexload_real_t distance_sigmas = 0;
    LoadBody result;
    hexload_body_describe(theta.data(), packed.data(), &body);
    copy_values(body, result.value);
    result.sigma[0] = static_cast<double>(body.mass_sigma_kg);
    copy_known(body.com_sigma_m, body.has_com, 1, result.sigma);
    copy_known(body.inertia_sigma_kg_m2, body.has_inertia, 4, result.sigma);
    result.is_consistent = body.is_consistent;
    const bool is_found = hexload_body_nearest(theta.data(), packed.data(), nearest.data(), &distance_sigmas);
    result.distance_sigmas =
        is_found ? static_cast<double>(distance_sigmas) : std::numeric_limits<double>::quiet_NaN();
    hexload_body_describe(nearest.data(), packed.data(), &body);
    copy_values(body, result.nearest);
    return result;
}

BodyFile::BodyFile(const std::filesystem::path& path) : path_(path), file_(std::fopen(path.c_str(), "w")) {
    if (!file_) {
        throw_write_error(path_);
    }
    fmt::memory_buffer line;
    fmt::format_to(std::back_inserter(line), "t,{},s_{},consistent,distance,n_{}\n",
                   fmt::join(LoadBody::names, ","), fmt::join(LoadBody::names, ",s_"),
                   fmt::join(LoadBody::names, ",n_"));
    write_line(file_.get(), path_, line);
}

void BodyFile::write(double t_s, const LoadBody& body) {
    fmt::memory_buffer line;
    fmt::format_to(std::back_inserter(line), "{:.9g}", t_s);
    append(line, body.value);
    append(line, body.sigma);
    fmt::format_to(std::back_inserter(line), ",{:d}", body.is_consistent ? 1 : 0);
    append(line, body.distance_sigmas);
    append(line, body.nearest);
    fmt::format_to(std::back_inserter(line), "\n");
    write_line(file_.get(), path_, line);
}

void BodyFile::close() {
    if (std::fclose(file_.release()) != 0) {
        throw_write_error(path_);
    }
}

} // namespace hexload::sim
