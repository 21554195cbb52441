/// Replays a log inside the controller with the momentum estimator, or as the program `momentum_effects` with
/// that which finds bias and friction too: arguments LOG OUT, files of the host in the format of
/// tools/python/hexload_dev/target.py.
#include "hexload/momentum.h"

#include "arguments.h"
#include "instruction_counter.h"
#include "painted_stack.h"
#include "semihosting.h"

#include <string.h>

enum exit_status { DONE, BAD_ARGUMENTS = 2, BAD_FILE, BAD_CONFIG };

/// What the answer starts with.
typedef struct {
    uint32_t config_bytes;
    uint32_t estimator_bytes;
} header_t;

/// One tick of the answer. Verdicts are words here, because the size of an enum is the compiler's choice.
typedef struct {
    int32_t status;
    uint32_t health;
    float value[HEXLOAD_LOAD_DIM];
    float sigma[HEXLOAD_LOAD_DIM];
    float nis;
    uint32_t verdict;
    uint32_t tick_instructions;
    uint32_t tick_stack_bytes;
} answer_t;

#ifdef WITH_EFFECTS
typedef hexload_momentum_effects_t estimator_t;

static hexload_status_t init(estimator_t* self, const hexload_config_t* config) {
    return hexload_momentum_effects_init(self, config);
}

static hexload_status_t tick(estimator_t* self, const hexload_config_t* config,
                             const hexload_leg_sample_t* sample, hexload_estimate_t* estimate) {
    return hexload_momentum_effects_tick(self, config, sample, estimate);
}

static const hexload_health_t* health_of(const estimator_t* self) {
    return &self->momentum.health;
}
#else
typedef hexload_momentum_t estimator_t;

static hexload_status_t init(estimator_t* self, const hexload_config_t* config) {
    return hexload_momentum_init(self, config);
}

static hexload_status_t tick(estimator_t* self, const hexload_config_t* config,
                             const hexload_leg_sample_t* sample, hexload_estimate_t* estimate) {
    return hexload_momentum_tick(self, config, sample, estimate);
}

static const hexload_health_t* health_of(const estimator_t* self) {
    return &self->health;
}
#endif

static void run_tick(estimator_t* self, const hexload_config_t* config, const hexload_leg_sample_t* sample,
                     answer_t* answer) {
    hexload_estimate_t estimate = {0};
    const uint32_t* stack = paint_stack();
    const uint32_t mark = instruction_counter_mark();
    answer->status = tick(self, config, sample, &estimate);
    answer->tick_instructions = instruction_counter_since(mark);
    answer->tick_stack_bytes = used_stack_bytes(stack);
    answer->health = health_of(self)->bits;
    memcpy(answer->value, estimate.value, sizeof answer->value);
    memcpy(answer->sigma, estimate.sigma, sizeof answer->sigma);
    answer->nis = estimate.nis;
    answer->verdict = estimate.verdict;
}

static enum exit_status replay(int32_t log, int32_t out) {
    static estimator_t estimator;
    static hexload_config_t config;
    const header_t header = {.config_bytes = sizeof config, .estimator_bytes = sizeof estimator};
    hexload_leg_sample_t sample;
    if (!semihosting_read(log, &config, sizeof config) || init(&estimator, &config) != HEXLOAD_OK) {
        return BAD_CONFIG;
    }
    if (!semihosting_write(out, &header, sizeof header)) {
        return BAD_FILE;
    }
    while (semihosting_read(log, &sample, sizeof sample)) {
        answer_t answer = {0};
        run_tick(&estimator, &config, &sample, &answer);
        if (!semihosting_write(out, &answer, sizeof answer)) {
            return BAD_FILE;
        }
    }
    return semihosting_close(out) ? DONE : BAD_FILE;
}

int main(void) {
    const char* words[2];
    if (!arguments_read(words, 2)) {
        return BAD_ARGUMENTS;
    }
    const int32_t log = semihosting_open(words[0], SEMIHOSTING_READ);
    const int32_t out = semihosting_open(words[1], SEMIHOSTING_WRITE);
    if (log < 0 || out < 0) {
        return BAD_FILE;
    }
    instruction_counter_start();
    return replay(log, out);
}
