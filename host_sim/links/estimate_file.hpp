// The estimates CSV: t, the parameters, their sigmas, the filter's part of these where it is known, nis,
// verdict; a row per tick.
#pragma once

#include <hexload_sim/estimator_link.hpp>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace hexload::sim {

struct FileCloser {
    void operator()(std::FILE* file) const noexcept;
};

class EstimateFile {
  public:
    // Creates or empties the file, for the rows of that link. Throws InputError when it cannot be written; so
    // do write() and close().
    EstimateFile(const std::filesystem::path& path, const EstimatorLink& link);

    // Nine significant digits: float32 survives the round trip.
    void write(const EstimateRow& row);
    void close();

  private:
    std::filesystem::path path_;
    std::unique_ptr<std::FILE, FileCloser> file_;
    std::size_t parameter_count_;
    std::size_t own_sigma_count_;
};

// The trace CSV, a row for each estimate: t, of the measurement; the innovations; their variances; nis;
// sum_nis and its mean; gate.
class TraceFile {
  public:
    // Creates or empties the file. Throws InputError when it cannot be written; so do write() and close().
    TraceFile(const std::filesystem::path& path, std::size_t dimension);

    void write(double t_s, const UpdateTrace& trace);
    void close();

  private:
    std::filesystem::path path_;
    std::unique_ptr<std::FILE, FileCloser> file_;
};

} // namespace hexload::sim
