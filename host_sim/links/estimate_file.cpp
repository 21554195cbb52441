#include "estimate_file.hpp"

#include "write_error.hpp"

#include <fmt/format.h>

#include <iterator>

namespace hexload::sim {

void FileCloser::operator()(std::FILE* file) const noexcept {
    (void)std::fclose(file); // of one that is given up: close() tells
}

EstimateFile::EstimateFile(const std::filesystem::path& path, const EstimatorLink& link)
    : path_(path), file_(std::fopen(path.c_str(), "w")), parameter_count_(link.parameter_names().size()),
      own_sigma_count_(link.own_sigma_names().size()) {
    if (!file_) {
        throw_write_error(path_);
    }
    fmt::memory_buffer line;
    fmt::format_to(std::back_inserter(line), "t");
    for (const std::string_view name : link.parameter_names()) {
        fmt::format_to(std::back_inserter(line), ",{}", name);
    }
    for (const std::string_view name : link.parameter_names()) {
        fmt::format_to(std::back_inserter(line), ",s_{}", name);
    }
    for (const std::string_view name : link.own_sigma_names()) {
        fmt::format_to(std::back_inserter(line), ",n_{}", name);
    }
    fmt::format_to(std::back_inserter(line), ",nis,verdict\n");
    if (std::fwrite(line.data(), 1, line.size(), file_.get()) != line.size()) {
        throw_write_error(path_);
    }
}

void EstimateFile::write(const EstimateRow& row) {
    fmt::memory_buffer line;
    fmt::format_to(std::back_inserter(line), "{:.9g}", row.t_s);
    for (std::size_t k = 0; k < parameter_count_; k++) {
        fmt::format_to(std::back_inserter(line), ",{:.9g}", row.value[k]);
    }
    for (std::size_t k = 0; k < parameter_count_; k++) {
        fmt::format_to(std::back_inserter(line), ",{:.9g}", row.sigma[k]);
    }
    for (std::size_t k = 0; k < own_sigma_count_; k++) {
        fmt::format_to(std::back_inserter(line), ",{:.9g}", row.own_sigma[k]);
    }
    fmt::format_to(std::back_inserter(line), ",{:.9g},{}\n", row.nis, row.verdict);
    if (std::fwrite(line.data(), 1, line.size(), file_.get()) != line.size()) {
        throw_write_error(path_);
    }
}

void EstimateFile::close() {
    if (std::fclose(file_.release()) != 0) {
        throw_write_error(path_);
    }
}

TraceFile::TraceFile(const std::filesystem::path& path, std::size_t dimension)
    : path_(path), file_(std::fopen(path.c_str(), "w")) {
    if (!file_) {
        throw_write_error(path_);
    }
    fmt::memory_buffer line;
    fmt::format_to(std::back_inserter(line), "t");
    for (const char* prefix : {"e", "v"}) {
        for (std::size_t k = 1; k <= dimension; k++) {
            fmt::format_to(std::back_inserter(line), ",{}{}", prefix, k);
        }
    }
    fmt::format_to(std::back_inserter(line), ",nis,sum_nis,sum_nis_mean,gate\n");
    if (std::fwrite(line.data(), 1, line.size(), file_.get()) != line.size()) {
        throw_write_error(path_);
    }
}

void TraceFile::write(double t_s, const UpdateTrace& trace) {
    fmt::memory_buffer line;
    fmt::format_to(std::back_inserter(line), "{:.9g}", t_s);
    for (const auto* numbers : {&trace.innovation, &trace.variance}) {
        for (std::size_t k = 0; k < trace.dimension; k++) {
            fmt::format_to(std::back_inserter(line), ",{:.9g}", (*numbers)[k]);
        }
    }
    fmt::format_to(std::back_inserter(line), ",{:.9g},{:.9g},{:.9g},{}\n", trace.nis, trace.sum_nis,
                   trace.sum_nis_mean, trace.gate);
    if (std::fwrite(line.data(), 1, line.size(), file_.get()) != line.size()) {
        throw_write_error(path_);
    }
}

void TraceFile::close() {
    if (std::fclose(file_.release()) != 0) {
        throw_write_error(path_);
    }
}

} // namespace hexload::sim
