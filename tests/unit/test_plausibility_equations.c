/// What one window of the plausibility stage finds, beside sums over its raw samples in double precision
/// (P1).
#include "front_end/noise_estimator.h"
#include "front_end/plausibility.h"
#include "machine.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { LEGS = HEXLOAD_LEGS, BLOCKS = 32, BLOCK = 16, TICKS = BLOCKS * BLOCK, NONE = HEXLOAD_LEGS };

typedef struct window {
    hexload_config_t config;
    hexload_leg_sample_t sample[TICKS + 1];
    hexload_motion_t motion[TICKS + 1];
    int turn;
    double late_s;
} window_t;

/// What sensors do to a leg: the kind of fault, its size, and that of the motion.
typedef struct fault {
    double gain, lag_s, noise_m, drift_m_s;
    int leg; ///< whose velocity it shows
} fault_t;

static fault_t random_fault(uint64_t* seed, int leg) {
    fault_t fault = {1.0, 0.0, 20e-6, 0.0, leg};
    const double size = pow(10.0, 1.5 * uniform(seed)); // 0.03 to 30
    switch ((int)(7.99 * fabs(uniform(seed)))) {
    case 0:
        fault.gain = -1.0 + 0.01 * size * uniform(seed);
        break;
    case 1:
        fault.gain = 1.0 + 0.03 * size * uniform(seed);
        break;
    case 2:
        fault.lag_s = 0.003 * size * uniform(seed);
        break;
    case 3:
        fault.gain = 0.1 * size * uniform(seed);
        break;
    case 4:
        fault.leg = (leg + 1 + (int)(4.99 * fabs(uniform(seed)))) % LEGS;
        break;
    case 5:
        fault.gain = 1.0 + 0.02 * uniform(seed);
        fault.lag_s = 0.004 * uniform(seed);
        break;
    case 6:
        fault.drift_m_s = 0.02 * size;
        break;
    default:
        break;
    }
    return fault;
}

/// Two sines for each leg, whose velocities and displacements go through the faults.
static void move(window_t* window, uint64_t* seed, double size_m_s, bool is_common) {
    const double common_gain = 1.0 + 0.03 * uniform(seed);
    double omega[LEGS][2], phase[LEGS][2], part[LEGS];
    fault_t fault[LEGS];
    for (int leg = 0; leg < LEGS; leg++) {
        fault[leg] = random_fault(seed, leg);
        const bool is_in_order = is_common || (leg != window->turn && fabs(uniform(seed)) < 0.8);
        if (is_in_order) { // but for what all legs have in common
            fault[leg] = (fault_t){common_gain + 0.012 * uniform(seed), 0.0, 20e-6, 0.0, leg};
        }
        part[leg] = fabs(uniform(seed)) < 0.1 ? 0.0 : 1.0;
        for (int n = 0; n < 2; n++) {
            omega[leg][n] = 10.0 + 8.0 * uniform(seed);
            phase[leg][n] = 3.1 * uniform(seed);
        }
    }
    for (int tick = 0; tick <= TICKS; tick++) {
        double v[LEGS] = {0}, x[LEGS] = {0}, way[LEGS] = {0};
        for (int leg = 0; leg < LEGS; leg++) {
            for (int n = 0; n < 2; n++) {
                const double angle = omega[leg][n] * 1e-3 * tick + phase[leg][n];
                v[leg] += part[leg] * size_m_s * cos(angle);
                x[leg] += part[leg] * size_m_s * sin(angle) / omega[leg][n];
            }
        }
        for (int leg = 0; leg < LEGS; leg++) {
            way[leg] = fault[leg].gain * x[leg] + fault[leg].lag_s * v[leg] +
                       fault[leg].drift_m_s * sin(3e-2 * tick) * 0.02;
            window->sample[tick].displacement_m[leg] =
                (hexload_real_t)(way[leg] + fault[leg].noise_m * normal(seed));
            window->sample[tick].velocity_m_s[leg] =
                (hexload_real_t)(v[fault[leg].leg] +
                                 (double)window->config.sensors.velocity_sigma_m_s * normal(seed));
        }
    }
}

/// Legs that lean, carry a platform that accelerates, and forces of which one may be dead or of the wrong
/// sign.
static void push(window_t* window, uint64_t* seed) {
    const int kind = (int)(5.99 * fabs(uniform(seed)));
    const double mass_kg = kind == 0 ? 100.0 * fabs(uniform(seed)) : 400.0;
    const double a[3] = {uniform(seed), uniform(seed), 0.5 * uniform(seed)};
    double J[LEGS][6], force_n[LEGS];
    for (int leg = 0; leg < LEGS; leg++) {
        J[leg][0] = 0.5 * uniform(seed);
        J[leg][1] = 0.5 * uniform(seed);
        J[leg][2] = 0.8;
        J[leg][3] = uniform(seed);
        J[leg][4] = uniform(seed);
        J[leg][5] = 0.3 * uniform(seed);
        force_n[leg] = mass_kg * 9.81 / 6.0 / 0.8 * (1.0 + 0.2 * uniform(seed));
    }
    // what the legs lean sidewards is taken off in pairs, but for a rest
    for (int k = 0; k < 6; k += k == 1 ? 4 : 1) {
        double sum = 0.0;
        for (int leg = 0; leg < LEGS; leg++) {
            sum += J[leg][k] * force_n[leg] / LEGS;
        }
        for (int leg = 0; leg < LEGS; leg++) {
            J[leg][k] -= sum / force_n[leg] * (k == 5 ? 1.0 : 0.99);
        }
    }
    if (kind == 1 || kind == 2) {
        force_n[kind == 1 ? window->turn : (window->turn + 1) % LEGS] *= -1.0;
    } else if (kind == 3) {
        force_n[window->turn] *= 0.5 * uniform(seed);
    } else if (kind == 4) {
        for (int leg = 0; leg < LEGS; leg++) {
            force_n[leg] *= -fabs(uniform(seed));
        }
    }
    for (int tick = 0; tick <= TICKS; tick++) {
        for (int leg = 0; leg < LEGS; leg++) {
            window->sample[tick].force_n[leg] = (hexload_real_t)(force_n[leg] + 5.0 * uniform(seed));
            for (int k = 0; k < 6; k++) {
                window->motion[tick].J[leg][k] = (hexload_real_t)J[leg][k];
            }
        }
        for (int k = 0; k < 3; k++) {
            window->motion[tick].twist[k] = (hexload_real_t)(a[k] * 1e-3 * tick);
        }
    }
}

/// Ways of the blocks, the changes of speed.
typedef struct raw {
    double shown[LEGS][BLOCKS], integral[LEGS][BLOCKS], change[LEGS][BLOCKS];
} raw_t;

static void read_blocks(const window_t* window, raw_t* raw) {
    for (int leg = 0; leg < LEGS; leg++) {
        for (int b = 0; b < BLOCKS; b++) {
            const hexload_leg_sample_t* at = &window->sample[BLOCK * b];
            double sum = 0.0;
            for (int tick = 0; tick < BLOCK; tick++) { // trapezoids
                sum += 0.5 * 1e-3 *
                       ((double)at[tick].velocity_m_s[leg] + (double)at[tick + 1].velocity_m_s[leg]);
            }
            raw->integral[leg][b] = sum;
            raw->shown[leg][b] = (double)at[BLOCK].displacement_m[leg] - (double)at[0].displacement_m[leg];
            raw->change[leg][b] = (double)at[BLOCK].velocity_m_s[leg] - (double)at[0].velocity_m_s[leg];
        }
    }
}

/// Sum of products about the means.
static double moment(const double* a, const double* b) {
    double mean_a = 0.0, mean_b = 0.0, sum = 0.0;
    for (int k = 0; k < BLOCKS; k++) {
        mean_a += a[k] / BLOCKS;
        mean_b += b[k] / BLOCKS;
    }
    for (int k = 0; k < BLOCKS; k++) {
        sum += (a[k] - mean_a) * (b[k] - mean_b);
    }
    return sum;
}

typedef struct found {
    int moving, worst;
    double least, largest;
    bool has_moved, could_show, is_close;
    hexload_input_cause_t motion, force;
    double left; ///< of the displacement by gain and lag
} found_t;

/// a > b; remembers when rounding may decide otherwise.
static bool exceeds(found_t* found, double a, double b) {
    found->is_close = found->is_close || fabs(a - b) < 3e-3 * (fabs(a) + fabs(b));
    return a > b;
}

static void screen(const window_t* window, const raw_t* raw, found_t* found) {
    const double noise = BLOCK * pow(1e-3 * (double)window->config.sensors.velocity_sigma_m_s, 2.0);
    double largest_error = 0.02;
    found->worst = NONE;
    for (int leg = 0; leg < LEGS; leg++) {
        const double motion = moment(raw->integral[leg], raw->integral[leg]) - BLOCKS * noise;
        if (exceeds(found, motion, 400.0 * BLOCKS * noise)) {
            const double gain = moment(raw->shown[leg], raw->integral[leg]) / motion;
            found->least = found->moving == 0 ? gain : fmin(gain, found->least);
            found->largest = found->moving == 0 ? gain : fmax(gain, found->largest);
            found->moving++;
            if (exceeds(found, fabs(gain - 1.0), largest_error)) {
                largest_error = fabs(gain - 1.0);
                found->worst = leg;
            }
        }
    }
}

static bool is_common(found_t* found) {
    return found->moving >= 4 && exceeds(found, 0.02 * fabs(found->largest), found->largest - found->least) &&
           exceeds(found, fabs(found->largest - 1.0), 0.02) && exceeds(found, fabs(found->least - 1.0), 0.01);
}

/// Gain and lag by least squares, as far as five sigma and the floors let them count.
static hexload_input_cause_t regress(const window_t* window, const raw_t* raw, found_t* found) {
    const int leg = window->turn;
    const double *x = raw->integral[leg], *c = raw->change[leg], *y = raw->shown[leg];
    const double velocity2 = pow((double)window->config.sensors.velocity_sigma_m_s, 2.0);
    const double edge2 = pow((double)window->config.sensors.displacement_sigma_m, 2.0);
    const double noise = BLOCK * 1e-6 * velocity2;
    const double xx = moment(x, x) - BLOCKS * noise, cc = moment(c, c) - 2.0 * BLOCKS * velocity2;
    const bool has_lag = exceeds(found, cc, 4.0 * 2.0 * BLOCKS * velocity2);
    const double xc = has_lag ? moment(x, c) : 0.0;
    const double determinant = xx * cc - xc * xc;
    if (!exceeds(found, xx, 0.0) || !exceeds(found, cc, 0.0) ||
        !exceeds(found, determinant, 0.01 * xx * cc)) {
        found->could_show = false;
        return HEXLOAD_INPUT_PLAUSIBLE;
    }
    double jumps = 0.0;
    for (int b = 0; b < BLOCKS; b++) {
        jumps += pow(c[b] - (b == 0 ? 0.0 : c[b - 1]), 2.0);
    }
    const double steps = BLOCK * 1e-3 * sqrt(moment(c, c)); // of the integral, from block to block
    const double gain = (moment(y, x) * cc - moment(y, c) * xc) / determinant - 1.0;
    const double lag = (moment(y, c) * xx - moment(y, x) * xc) / determinant - window->late_s;
    const double gain_edge = (cc * steps + fabs(xc) * sqrt(jumps)) / determinant;
    const double lag_edge = (xx * sqrt(jumps) + fabs(xc) * steps) / determinant;
    const double gain_variance =
        edge2 * (gain_edge * gain_edge + 4.0 / BLOCKS * cc / determinant) + noise * cc / determinant;
    const double lag_variance = edge2 * lag_edge * lag_edge + noise * xx / determinant;
    found->left =
        moment(y, y) - (gain + 1.0) * moment(y, x) - (has_lag ? (lag + window->late_s) * moment(y, c) : 0.0);
    const bool is_gain =
        exceeds(found, fabs(gain), 0.02) && exceeds(found, gain * gain, 25.0 * gain_variance);
    const bool is_lag =
        has_lag && exceeds(found, fabs(lag), 0.002) && exceeds(found, lag * lag, 25.0 * lag_variance);
    found->could_show =
        exceeds(found, 4e-4, 6.25 * gain_variance) && (!has_lag || exceeds(found, 4e-6, 6.25 * lag_variance));
    if (is_lag && !(is_gain && exceeds(found, gain * gain * xx, lag * lag * cc))) {
        return HEXLOAD_INPUT_VELOCITY_LAG;
    }
    return is_gain ? HEXLOAD_INPUT_VELOCITY_GAIN : HEXLOAD_INPUT_PLAUSIBLE;
}

static hexload_input_cause_t contradict(const window_t* window, const raw_t* raw, double noise,
                                        found_t* found) {
    const int turn = window->turn;
    const double shown = moment(raw->shown[turn], raw->shown[turn]);
    const double integral = moment(raw->integral[turn], raw->integral[turn]);
    const double product = moment(raw->shown[turn], raw->integral[turn]);
    double least = shown + integral;
    int best = turn;
    for (int leg = 0; leg < LEGS; leg++) {
        const double own = moment(raw->integral[leg], raw->integral[leg]);
        const double left = shown + own - 2.0 * fabs(moment(raw->shown[turn], raw->integral[leg]));
        const double in_place = moment(raw->shown[leg], raw->integral[leg]);
        if (exceeds(found, least, left) && exceeds(found, fabs(in_place - own), 0.1 * own)) {
            least = left;
            best = leg;
        }
    }
    if (exceeds(found, 0.01 * shown, integral)) {
        return HEXLOAD_INPUT_VELOCITY_STUCK;
    }
    if (exceeds(found, 0.01 * integral + 2.0 * noise, shown)) {
        return HEXLOAD_INPUT_DISPLACEMENT_STUCK;
    }
    if (exceeds(found, 0.05 * fmax(shown, integral) + 2.0 * noise, least) &&
        exceeds(found, 0.5 * (shown + integral - 2.0 * product), least)) {
        return best == turn ? HEXLOAD_INPUT_VELOCITY_SIGN : HEXLOAD_INPUT_VELOCITY_SWAPPED;
    }
    return exceeds(found, product * product, 0.8 * shown * integral) ? HEXLOAD_INPUT_VELOCITY_GAIN
                                                                     : HEXLOAD_INPUT_VELOCITY_OTHER;
}

static void look(const window_t* window, const raw_t* raw, found_t* found) {
    const double *y = raw->shown[window->turn], *x = raw->integral[window->turn];
    const double velocity = 1e-3 * (double)window->config.sensors.velocity_sigma_m_s;
    const double noise = BLOCKS * (2.0 * pow((double)window->config.sensors.displacement_sigma_m, 2.0) +
                                   BLOCK * velocity * velocity);
    const double motion = fmax(moment(x, x), moment(y, y));
    const double left = moment(x, x) + moment(y, y) - 2.0 * moment(x, y);
    found->motion = HEXLOAD_INPUT_PLAUSIBLE;
    found->has_moved = exceeds(found, motion, 4.0 * noise);
    found->could_show = found->has_moved;
    if (!found->has_moved) {
        return;
    }
    if (exceeds(found, left, 0.02 * motion + 4.0 * noise)) {
        found->motion = contradict(window, raw, noise, found);
    }
    if (found->motion == HEXLOAD_INPUT_PLAUSIBLE || found->motion == HEXLOAD_INPUT_VELOCITY_GAIN) {
        const hexload_input_cause_t finer = regress(window, raw, found);
        found->motion = finer == HEXLOAD_INPUT_PLAUSIBLE ? found->motion : finer;
        if (found->motion == HEXLOAD_INPUT_PLAUSIBLE &&
            exceeds(found, found->left, 1e-4 * moment(y, y) + 3.0 * noise)) {
            found->motion = HEXLOAD_INPUT_VELOCITY_OTHER;
        }
    }
    if (found->motion == HEXLOAD_INPUT_VELOCITY_GAIN && is_common(found)) {
        found->motion = HEXLOAD_INPUT_CLOCK;
    }
}

static void draw_rig(hexload_rig_config_t* rig, double size, uint64_t* seed) {
    for (int leg = 0; leg < LEGS; leg++) {
        rig->coulomb_n[leg] = (hexload_real_t)(size * 40.0 * uniform(seed));
        rig->stribeck_n[leg] = (hexload_real_t)(size * 40.0 * (uniform(seed) - 0.5));
        rig->viscous_n_s_m[leg] = (hexload_real_t)(size * 300.0 * uniform(seed));
        rig->growth_n_n[leg] = (hexload_real_t)(size * 0.02 * uniform(seed));
        rig->force_offset_n[leg] = (hexload_real_t)(size * 60.0 * (uniform(seed) - 0.5));
        rig->force_gain[leg] = (hexload_real_t)(size * 0.02 * (uniform(seed) - 0.5));
    }
}

/// What sensors and friction of the rig may take off the weight, at the window's speeds.
static double of_rig(const window_t* window, const raw_t* raw, double platform_n) {
    const hexload_rig_config_t* rig = &window->config.rig;
    double sum = 0.0;
    for (int leg = 0; leg < LEGS; leg++) {
        double square = 0.0;
        for (int b = 0; b < BLOCKS; b++) {
            square += pow(raw->integral[leg][b] / (BLOCK * 1e-3), 2.0) / BLOCKS;
        }
        sum += fabs((double)rig->force_offset_n[leg]) + (double)rig->coulomb_n[leg];
        sum += fmax((double)rig->stribeck_n[leg], 0.0) + (double)rig->viscous_n_s_m[leg] * sqrt(square);
        sum += (fabs((double)rig->force_gain[leg]) + (double)rig->growth_n_n[leg]) * platform_n / LEGS;
    }
    return sum;
}

/// Means over the window by the trapezoidal rule, at the eighth tick of each block.
static void balance(const window_t* window, const raw_t* raw, found_t* found) {
    static const int column[4] = {0, 1, 5, 2};
    double wrench[4] = {0}, own[4] = {0}, force_n = 0.0, a[3];
    for (int b = 0; b < BLOCKS; b++) {
        const int tick = BLOCK * b + 8;
        const double weight = (b == 0 || b == BLOCKS - 1 ? 0.5 : 1.0) / (BLOCKS - 1);
        for (int leg = 0; leg < LEGS; leg++) {
            const double force = weight * (double)window->sample[tick].force_n[leg];
            for (int k = 0; k < 4; k++) {
                const double part = force * (double)window->motion[tick].J[leg][column[k]];
                wrench[k] += part;
                own[k] += leg == window->turn ? part : 0.0;
            }
            force_n += leg == window->turn ? force : 0.0;
        }
    }
    for (int k = 0; k < 3; k++) {
        a[k] =
            ((double)window->motion[BLOCK * (BLOCKS - 1) + 8].twist[k] - (double)window->motion[8].twist[k]) /
            ((BLOCKS - 1) * BLOCK * 1e-3);
    }
    const double g = (double)window->config.gravity_m_s2;
    const double mass = wrench[3] / (g + a[2]), weight = mass * g;
    const double platform = (double)window->config.platform.mass_kg * g;
    const double length = (double)window->config.geometry.home_leg_length_m[window->turn];
    const hexload_real_t* row = window->motion[0].J[window->turn];
    const double whole[3] = {wrench[0] - mass * a[0], wrench[1] - mass * a[1], wrench[2] / length};
    const double along[3] = {(double)row[0], (double)row[1], (double)row[5] / length};
    const double part[3] = {own[0], own[1], own[2] / length};
    double total = 0.0, share = 0.0, square = 0.0, left = 0.0;
    for (int k = 0; k < 3; k++) {
        total += whole[k] * whole[k];
        share += whole[k] * along[k];
        square += along[k] * along[k];
    }
    const bool is_dead = exceeds(found, 0.05 * fabs(weight), fabs(force_n));
    for (int k = 0; k < 3; k++) {
        left += pow(whole[k] - (is_dead ? share / square * along[k] : 2.0 * part[k]), 2.0);
    }
    found->force = HEXLOAD_INPUT_PLAUSIBLE;
    if (exceeds(found, total, 0.0025 * weight * weight) && exceeds(found, 0.15 * total, left) &&
        exceeds(found, 0.0, (is_dead ? share : force_n) * weight)) {
        found->force = is_dead ? HEXLOAD_INPUT_FORCE_DEAD : HEXLOAD_INPUT_FORCE_SIGN;
    } else if (exceeds(found, -0.5 * platform, weight + of_rig(window, raw, platform))) {
        found->force = HEXLOAD_INPUT_FORCES_NEGATED;
    } else if (exceeds(found, 0.7 * platform, weight + of_rig(window, raw, platform))) {
        found->force = HEXLOAD_INPUT_FORCES_LIGHT;
    }
}

static void show(hexload_plausibility_t* self, const window_t* window, int tick) {
    hexload_noise_estimator_t noise;
    hexload_noise_estimator_init(&noise);
    const hexload_present_tick_t now = {.sample = &window->sample[tick],
                                        .motion = &window->motion[tick],
                                        .sensors = window->config.sensors,
                                        .noise = &noise,
                                        .gap_ticks = 1};
    hexload_plausibility_step(self, &window->config, &window->sample[tick], &now,
                              (hexload_real_t)window->late_s);
}

/// All of a window, up to where the evaluation is about to conclude.
static void run(hexload_plausibility_t* self, const window_t* window) {
    hexload_plausibility_init(self);
    self->turn = (uint8_t)window->turn;
    for (int tick = 0; tick <= TICKS; tick++) {
        show(self, window, tick);
    }
    for (int stage = 0; stage < LEGS + 2; stage++) { // that see the last tick again: sums of the next window
        TEST_ASSERT_EQUAL_UINT8(stage + 1, self->stage);
        show(self, window, TICKS);
    }
}

static void test_a_window_finds_what_sums_over_its_samples_say(void) {
    // GIVEN a thousand windows of legs that move, from less than noise to 1 m/s, with faults of all kinds and
    // sizes in velocities and forces, half of them of a machine with friction, offsets and gains
    static window_t window;
    uint64_t seed = 41;
    int judged = 0, causes[32] = {0};
    memset(&window, 0, sizeof window);
    window.config = paper_machine();
    for (int trial = 0; trial < 1000; trial++) {
        hexload_plausibility_t self;
        found_t found;
        raw_t raw;
        memset(&found, 0, sizeof found);
        window.turn = trial % LEGS;
        window.late_s = trial % 4 == 0 ? 0.003 : 0.0;
        window.config.sensors.velocity_sigma_m_s = trial % 3 == 0 ? HEXLOAD_REAL(0.02) : HEXLOAD_REAL(0.004);
        window.config.sensors.displacement_sigma_m =
            trial % 7 < 4 ? HEXLOAD_REAL(20e-6) : HEXLOAD_REAL(150e-6);
        draw_rig(&window.config.rig, trial % 2, &seed);
        move(&window, &seed, pow(10.0, -1.7 + 1.5 * uniform(&seed)), trial % 5 == 0);
        push(&window, &seed);
        read_blocks(&window, &raw);
        screen(&window, &raw, &found);
        look(&window, &raw, &found);
        const bool is_close = found.is_close;
        found.is_close = false;
        balance(&window, &raw, &found);
        // WHEN a window is evaluated
        run(&self, &window);
        // THEN legs, gains and causes are those of the equations, but where rounding decides
        if (!is_close) {
            judged++;
            causes[found.motion]++;
            TEST_ASSERT_EQUAL_UINT8(found.moving, self.moving);
            TEST_ASSERT_EQUAL_UINT8(found.worst, self.worst);
            TEST_ASSERT_EQUAL_INT(found.has_moved, self.has_moved);
            TEST_ASSERT_EQUAL_INT(found.could_show, self.could_show);
            TEST_ASSERT_EQUAL_UINT8(found.motion, self.motion_cause);
            if (found.moving > 0) {
                TEST_ASSERT_DOUBLE_WITHIN(3e-3 * (1.0 + fabs(found.least)), found.least,
                                          (double)self.least_gain);
                TEST_ASSERT_DOUBLE_WITHIN(3e-3 * (1.0 + fabs(found.largest)), found.largest,
                                          (double)self.largest_gain);
            }
        }
        if (!found.is_close) {
            causes[found.force]++;
            TEST_ASSERT_EQUAL_UINT8(found.force, self.force_cause);
        }
    }
    // AND all causes were among them
    TEST_ASSERT_GREATER_THAN_INT(500, judged);
    for (int cause = HEXLOAD_INPUT_PLAUSIBLE; cause <= HEXLOAD_INPUT_FORCE_DEAD; cause++) {
        const bool is_of_ticks = cause == HEXLOAD_INPUT_ROWS_REPEATED || cause == HEXLOAD_INPUT_FORCE_STUCK;
        TEST_ASSERT_TRUE(is_of_ticks || causes[cause] > 0);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_window_finds_what_sums_over_its_samples_say);
    return UNITY_END();
}
