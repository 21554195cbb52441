/// Every estimator's tick, with samples that are in order, and with arbitrary floats among or instead of
/// them.
#include "bytes.h"

#include "hexload/hexload.h"

#include <math.h>

enum { WITHOUT_VELOCITY = 4, RUBBING = 8, OPEN = 16, LATE = 32, KNOWN_MASS = 64, HEAVY_LEGS = 128 };

static hexload_config_t config_of(uint8_t options) {
    hexload_config_t config;
    hexload_config_default(&config);
    config.kind = (hexload_kind_t)(options % 4 % HEXLOAD_KINDS);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        config.rig.coulomb_n[leg] = (options & RUBBING) != 0 ? HEXLOAD_REAL(40.0) : HEXLOAD_REAL(0.0);
        config.rig.growth_n_n[leg] = (options & RUBBING) != 0 ? HEXLOAD_REAL(0.02) : HEXLOAD_REAL(0.0);
        config.rig.direction[0].force_gain[leg] = HEXLOAD_REAL(0.002);
    }
    config.rig.direction_count = (options & OPEN) != 0 ? 1 : 0;
    config.actuator_effects.prior_tilt_sigma_m_s2 =
        (options & OPEN) != 0 ? HEXLOAD_REAL(0.1) : HEXLOAD_REAL(0.0);
    config.rig.force_delay_s = (options & LATE) != 0 ? HEXLOAD_REAL(0.0023) : HEXLOAD_REAL(0.0);
    config.rig.leg_inertia_kg_m2 = (options & HEAVY_LEGS) != 0 ? HEXLOAD_REAL(5.0) : HEXLOAD_REAL(0.0);
    if ((options & KNOWN_MASS) != 0) {
        hexload_config_set_known_mass(&config, HEXLOAD_REAL(320.0));
    }
    if ((options & WITHOUT_VELOCITY) != 0) {
        hexload_config_set_no_velocity(&config);
        hexload_config_set_momentum(&config);
    }
    return config;
}

/// A platform with some load, moved by 2 cm: any six small displacements have a pose.
static hexload_leg_sample_t usual_sample(uint32_t tick) {
    hexload_leg_sample_t sample = {.tick = tick};
    for (uint32_t leg = 0; leg < (uint32_t)HEXLOAD_LEGS; leg++) {
        const double w = 9.0 + leg, t_s = 1e-3 * tick;
        const double noise = (double)(tick * 2654435761u >> (8 + leg) & 0xFFu) / 128.0 - 1.0;
        sample.displacement_m[leg] = (hexload_real_t)(0.02 * sin(w * t_s) + 20e-6 * noise);
        sample.velocity_m_s[leg] = (hexload_real_t)(0.02 * w * cos(w * t_s) + 1e-3 * noise);
        sample.force_n[leg] = (hexload_real_t)(750.0 - 30.0 * sin(w * t_s) + 5.0 * noise);
    }
    return sample;
}

static hexload_real_t* channel(hexload_leg_sample_t* sample, unsigned number) {
    hexload_real_t* kinds[3] = {sample->displacement_m, sample->velocity_m_s, sample->force_n};
    return &kinds[number / 6 % 3][number % 6];
}

/// The next sample, changed as the input says.
static hexload_leg_sample_t next_sample(bytes_t* bytes, uint32_t* tick) {
    const uint8_t what = take_byte(bytes);
    hexload_leg_sample_t sample = usual_sample(*tick);
    *tick += 1;
    switch (what % 8) {
    case 0: // some channels are arbitrary
        for (unsigned n = 0; n <= what / 8u % 4u; n++) {
            *channel(&sample, take_byte(bytes)) = (hexload_real_t)take_float(bytes);
        }
        break;
    case 1: // all are
        for (unsigned n = 0; n < 18; n++) {
            *channel(&sample, n) = (hexload_real_t)take_float(bytes);
        }
        break;
    case 2: // one is a multiple of what it should be
        *channel(&sample, take_byte(bytes)) *= (hexload_real_t)(int8_t)take_byte(bytes);
        break;
    case 3: // ticks are missing, or go back
        *tick += take_byte(bytes) % 16u;
        break;
    case 4:
        take(bytes, &sample.tick, sizeof sample.tick);
        break;
    case 5: // one is missing
        *channel(&sample, take_byte(bytes)) = (hexload_real_t)NAN;
        break;
    default: // in order
        break;
    }
    return sample;
}

static void check_estimate(const hexload_t* estimator, const hexload_estimate_t* estimate) {
    const hexload_descriptor_t* descriptor = hexload_describe(estimator->kind);
    hexload_effects_estimate_t effects;
    for (uint32_t k = 0; k < descriptor->parameters; k++) {
        PROMISE(isfinite(estimate->value[k]) && isfinite(estimate->sigma[k]) &&
                isfinite(estimate->own_sigma[k]));
        PROMISE(estimate->sigma[k] >= 0 && estimate->own_sigma[k] >= 0);
        PROMISE((unsigned)estimate->parameter_verdict[k] <= (unsigned)HEXLOAD_VERDICT_INCONSISTENT);
        PROMISE(estimate->parameter_verdict[k] <= estimate->verdict);
    }
    PROMISE(isfinite(estimate->nis) && isfinite(estimate->nis_mean) && estimate->nis >= 0);
    if (hexload_read_effects(estimator, estimate, &effects)) {
        for (int k = 0; k < HEXLOAD_EFFECTS_DIM; k++) {
            PROMISE(isfinite(effects.value[k]) && isfinite(effects.sigma[k]) && effects.sigma[k] >= 0);
        }
    }
}

static void check_covariance(const hexload_t* estimator) {
    hexload_real_t covariance[HEXLOAD_COVARIANCES_MAX];
    const uint32_t written = hexload_covariance(estimator, covariance);
    for (uint32_t k = 0; k < written; k++) {
        PROMISE(isfinite(covariance[k]));
    }
}

/// A refused sample changes the count of refusals and nothing else; without velocity sensors the window, too.
static void check_refused(const hexload_t* before, hexload_t* after, bool has_velocity) {
    PROMISE(hexload_health(after)->refused == hexload_health(before)->refused + 1);
    if (has_velocity) {
        const ptrdiff_t at = (const uint8_t*)&hexload_health(after)->refused - (const uint8_t*)after;
        memcpy((uint8_t*)after + at, (const uint8_t*)before + at, sizeof(uint32_t));
        PROMISE(memcmp(before, after, sizeof *before) == 0);
        ((uint32_t*)(void*)((uint8_t*)after + at))[0]++;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static hexload_t estimator, before;
    bytes_t bytes = {data, size};
    const hexload_config_t config = config_of(take_byte(&bytes));
    const uint32_t run_in = take_byte(&bytes); // ticks in order, so that the filter has begun
    hexload_estimate_t estimate = {.tick = 0}, last;
    uint32_t tick = 0;
    memset(&estimator, 0, sizeof estimator);
    PROMISE(hexload_init(&estimator, &config) == HEXLOAD_OK);
    while (tick < run_in || bytes.left > 0) {
        const hexload_leg_sample_t sample = tick < run_in ? usual_sample(tick++) : next_sample(&bytes, &tick);
        memcpy(&before, &estimator, sizeof before);
        last = estimate;
        const hexload_status_t status = hexload_tick(&estimator, &config, &sample, &estimate);
        if (status != HEXLOAD_OK) {
            PROMISE(memcmp(&last, &estimate, sizeof last) == 0);
            check_refused(&before, &estimator, config.sensors.half_window_ticks == 0);
        } else {
            PROMISE(estimate.tick == sample.tick);
            check_estimate(&estimator, &estimate);
        }
    }
    check_covariance(&estimator);
    return 0;
}
