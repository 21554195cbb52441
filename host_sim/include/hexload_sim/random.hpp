// Random numbers that are the same on every compiler: std::mt19937_64 and std::seed_seq are specified bit by
// bit, the distributions of <random> are not, so those are written out here.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace hexload::sim {

// One stream per purpose: drawing more from one does not shift another.
enum class RandomPurpose : std::uint32_t {
    trajectory = 1,
    displacement_noise = 2,
    velocity_noise = 3,
    force_noise = 4,
    dropout = 5,
    hinge_errors = 6,
    bus_faults = 7,
};

class RandomStream {
  public:
    RandomStream(std::uint64_t seed, RandomPurpose purpose) {
        std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                               static_cast<std::uint32_t>(purpose)};
        engine_.seed(sequence);
    }

    // [0, 1), the upper 53 bits.
    double uniform() {
        return static_cast<double>(engine_() >> 11) * 0x1p-53;
    }

    double uniform(double min, double max) {
        return min + (max - min) * uniform();
    }

    // Standard normal by Marsaglia's polar method (SIAM Review 6, 1964, 260-264).
    double normal() {
        if (has_spare_) {
            has_spare_ = false;
            return spare_;
        }
        double u = 0.0;
        double v = 0.0;
        double square = 0.0;
        do {
            u = uniform(-1.0, 1.0);
            v = uniform(-1.0, 1.0);
            square = u * u + v * v;
        } while (square >= 1.0 || square == 0.0);
        const double factor = std::sqrt(-2.0 * std::log(square) / square);
        spare_ = v * factor;
        has_spare_ = true;
        return u * factor;
    }

  private:
    std::mt19937_64 engine_;
    double spare_ = 0.0;
    bool has_spare_ = false;
};

} // namespace hexload::sim
