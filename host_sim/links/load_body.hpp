// The load as a body, by the firmware's own functions, and the bodies CSV.
#pragma once

#include <hexload_sim/estimator_link.hpp>

#include <cstdio>
#include <filesystem>
#include <memory>

namespace hexload::sim {

// Mass in kg, centre of mass in m, tensor about it in kg m^2, platform axes; NaN is not known.
struct LoadBody {
    static constexpr std::array<std::string_view, 10> names = {"m",   "cx",  "cy",  "cz",  "Ixx",
                                                               "Iyy", "Izz", "Ixy", "Ixz", "Iyz"};
    std::array<double, 10> value{};
    std::array<double, 10> sigma{};
    bool is_consistent = false;
    double distance_sigmas = 0.0;     // to the nearest consistent body; NaN: none was found
    std::array<double, 10> nearest{}; // as value; value itself when that is consistent
};

// Of an estimate of all ten parameters: with its covariance, a square row by row that begins with theirs, but
// the row's sigmas, which a tare makes larger.
LoadBody load_body(const EstimateRow& row, std::span<const double> covariance);

// t, the body, its sigmas, consistent (1 or 0), distance, the nearest body (n_m, n_cx, ...); a row per tick.
// What is not known is left out between the commas.
class BodyFile {
  public:
    // Creates or empties the file. Throws InputError when it cannot be written; so do write() and close().
    explicit BodyFile(const std::filesystem::path& path);

    void write(double t_s, const LoadBody& body);
    void close();

  private:
    struct Closer {
        void operator()(std::FILE* file) const noexcept {
            (void)std::fclose(file); // of one that is given up: close() tells
        }
    };
    std::filesystem::path path_;
    std::unique_ptr<std::FILE, Closer> file_;
};

} // namespace hexload::sim
