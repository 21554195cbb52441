#include "front_end/wrench.h"

#include "algebra/real.h"

void hexload_wrench_compute(const hexload_motion_t* motion, const hexload_leg_sample_t* sample,
                            hexload_wrench_t* wrench) {
    hexload_real_t base_axes[6] = {0}; // (12), with J in base axes
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        HEXLOAD_UNROLL
        for (int k = 0; k < 6; k++) {
            base_axes[k] = hexload_fma(motion->J[leg][k], sample->force_n[leg], base_axes[k]);
        }
    }
    hexload_motion_to_platform(motion, &base_axes[0], wrench->force_n);
    hexload_motion_to_platform(motion, &base_axes[3], wrench->moment_nm);
}
