#include "momentum/loose_plug.h"

#include "algebra/real.h"
#include "configuration/health.h"
#include "front_end/leg_sample.h"

/// A plug that is loose for longer counts as a zero that has moved.
#define LOOSE_S HEXLOAD_REAL(0.1)

/// By which a velocity sensor that fails, or is late, may be wrong.
#define MOST_WRONG_M_S HEXLOAD_REAL(1.0)

/// @param[out] jumped the last leg that has moved by more than `least_m` beyond what its velocity explains.
/// @return how many have.
static int find_jumps(const hexload_leg_gate_t* gate, const hexload_leg_sample_t* sample,
                      hexload_real_t gap_s, hexload_real_t least_m, int* jumped) {
    int jumps = 0;
    for (int leg = 0; leg < (int)HEXLOAD_LEGS; leg++) {
        const hexload_real_t moved_m =
            hexload_abs(sample->displacement_m[leg] - gate->last_displacement_m[leg]);
        if ((moved_m > least_m) && // few legs are as fast
            (moved_m > hexload_fma(gap_s, hexload_abs(sample->velocity_m_s[leg]), least_m))) {
            *jumped = leg;
            jumps++;
        }
    }
    return jumps;
}

const hexload_leg_sample_t*
hexload_loose_plug_bridge(const hexload_lost_channels_t* lost, const hexload_config_t* config,
                          const hexload_leg_gate_t* gate, const hexload_leg_sample_t* sample,
                          hexload_leg_sample_t* bridged, hexload_lost_channels_t* next, uint32_t* health) {
    const uint32_t gap_ticks = sample->tick - gate->last_tick;
    const hexload_real_t gap_s = config->tick_s * (hexload_real_t)gap_ticks;
    const hexload_real_t least_m =
        hexload_fma(gap_s, MOST_WRONG_M_S, HEXLOAD_REACH_SIGMAS * config->sensors.displacement_sigma_m);
    const bool is_long = config->tick_s * (hexload_real_t)lost->displacement_ticks >= LOOSE_S;
    int jumped = 0;
    const int jumps = find_jumps(gate, sample, gap_s, least_m, &jumped);
    if (jumps != 1 || is_long || gate->accepted == 0U || next->displacement_ticks > 0U ||
        config->sensors.half_window_ticks > 0U) {
        return sample;
    }
    *bridged = *sample;
    bridged->displacement_m[jumped] =
        hexload_fma(gap_s, sample->velocity_m_s[jumped], gate->last_displacement_m[jumped]);
    next->displacement_ticks = lost->displacement_ticks + gap_ticks;
    hexload_health_set(health, HEXLOAD_HEALTH_CHANNEL_LOST);
    return bridged;
}
