/// Replays a log inside the controller: arguments LOG OUT, files of the host in the format of
/// tools/python/hexload_dev/target.py. Every tick runs twice, stage by stage with marks in between on a copy,
/// and as hexload_paper_tick(); both must end in the same state, so the stages' instructions are those of the
/// tick.
#include "hexload/paper.h"

#include "paper_tick.h"

#include "arguments.h"
#include "instruction_counter.h"
#include "painted_stack.h"
#include "semihosting.h"

#include <stdbool.h>
#include <string.h>

enum stage { LEG_SAMPLE, KINEMATICS, PLAUSIBILITY, WRENCH, FILTER, SUPERVISOR, STAGES };

enum exit_status { DONE, BAD_ARGUMENTS = 2, BAD_FILE, BAD_CONFIG, STAGES_DIFFER };

/// What the answer starts with.
typedef struct {
    uint32_t config_bytes;
    uint32_t estimator_bytes;
    uint32_t filter_bytes;
    uint32_t nop_instructions; ///< counted over a thousand of them
} header_t;

/// One tick of the answer. Verdicts are words here, because the size of an enum is the compiler's choice.
typedef struct {
    int32_t status;
    uint32_t health;
    float value[HEXLOAD_PAPER_DIM];
    float sigma[HEXLOAD_PAPER_DIM];
    float nis;
    float nis_mean;
    uint32_t verdict;
    uint32_t parameter_verdict[HEXLOAD_PAPER_DIM];
    uint32_t stage_instructions[STAGES];
    uint32_t tick_instructions;
    uint32_t tick_stack_bytes;
} answer_t;

static uint32_t count_nops(void) {
    const uint32_t mark = instruction_counter_mark();
    __asm volatile(".rept 1000\n nop\n .endr");
    return instruction_counter_since(mark);
}

/// From the wrench to the weight, which counts as plausibility, of a sample that lacks no force.
static void run_filter(hexload_paper_t* self, const hexload_config_t* config,
                       const hexload_present_tick_t* now, uint32_t instructions[STAGES], uint32_t* health) {
    hexload_wrench_t wrench;
    hexload_paper_step_t step;
    uint32_t mark = instruction_counter_mark();
    hexload_wrench_compute(now->motion, now->sample, &wrench);
    instructions[WRENCH] = instruction_counter_since(mark);
    mark = instruction_counter_mark();
    hexload_paper_filter_predict(&self->filter, config, now, &wrench, &step, health);
    hexload_paper_filter_correct(&self->filter, config, now, &wrench, &step, health);
    if (step.is_used) {
        hexload_residual_test_step(&self->residual_test, config, step.whitened, false);
        hexload_hum_test_step(&self->hum_test, now->gap_ticks, step.whitened);
    }
    instructions[FILTER] = instruction_counter_since(mark);
    mark = instruction_counter_mark();
    hexload_known_mass_step(&self->known_mass, config, now, &wrench);
    instructions[PLAUSIBILITY] += instruction_counter_since(mark);
}

/// hexload_paper_tick() without its bookkeeping, with marks. After a refusal the later stages have no
/// instructions. What the sensors' noise takes counts with the leg sample.
static void run_stages(hexload_paper_t* self, const hexload_config_t* config, const hexload_leg_sample_t* raw,
                       uint32_t instructions[STAGES]) {
    uint32_t health = 0;
    hexload_estimate_t estimate;
    hexload_leg_sample_t mended;
    hexload_motion_t motion;
    hexload_present_tick_t now = {.motion = &motion};
    uint32_t mark = instruction_counter_mark();
    const hexload_leg_sample_t* sample =
        hexload_lost_channels_mend(&self->lost, config, &self->leg_gate, raw, &mended, &now.lost, &health);
    hexload_status_t status =
        hexload_leg_sample_check(&self->leg_gate, config, sample, &now.gap_ticks, &health);
    instructions[LEG_SAMPLE] = instruction_counter_since(mark);
    if (status != HEXLOAD_OK) {
        return;
    }
    mark = instruction_counter_mark();
    status = hexload_kinematics_solve(&self->kinematics, config, sample, &motion);
    instructions[KINEMATICS] = instruction_counter_since(mark);
    if (status != HEXLOAD_OK) {
        return;
    }
    mark = instruction_counter_mark();
    now.sample = sample;
    hexload_leg_sample_accept(&self->leg_gate, sample);
    self->lost = now.lost;
    hexload_noise_estimator_step(&self->noise_estimator, config, sample, now.gap_ticks);
    hexload_noise_estimator_read(&self->noise_estimator, config, &now.sensors, &health);
    instructions[LEG_SAMPLE] += instruction_counter_since(mark);
    mark = instruction_counter_mark();
    hexload_plausibility_step(&self->plausibility, config, raw, &now, config->rig.velocity_delay_s);
    instructions[PLAUSIBILITY] = instruction_counter_since(mark);
    if (hexload_paper_has_torque(self, &now)) {
        run_filter(self, config, &now, instructions, &health);
    }
    mark = instruction_counter_mark();
    health |=
        hexload_paper_supervisor_judge(&self->supervisor, config, &self->filter, hexload_paper_mismatch(self),
                                       self->known_mass.weight_error, &estimate);
    instructions[SUPERVISOR] += instruction_counter_since(mark);
    mark = instruction_counter_mark();
    hexload_plausibility_judge(&self->plausibility, HEXLOAD_PAPER_DIM, &estimate, &self->health.input,
                               &health);
    hexload_known_mass_judge(&self->known_mass, &estimate, &self->health.input, &health);
    instructions[PLAUSIBILITY] += instruction_counter_since(mark);
}

static void run_tick(hexload_paper_t* self, const hexload_config_t* config,
                     const hexload_leg_sample_t* sample, answer_t* answer) {
    hexload_estimate_t estimate = {0};
    const uint32_t* stack = paint_stack();
    const uint32_t mark = instruction_counter_mark();
    answer->status = hexload_paper_tick(self, config, sample, &estimate);
    answer->tick_instructions = instruction_counter_since(mark);
    answer->tick_stack_bytes = used_stack_bytes(stack);
    answer->health = self->health.bits;
    memcpy(answer->value, estimate.value, sizeof answer->value);
    memcpy(answer->sigma, estimate.sigma, sizeof answer->sigma);
    answer->nis = estimate.nis;
    answer->nis_mean = estimate.nis_mean;
    answer->verdict = estimate.verdict;
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        answer->parameter_verdict[k] = estimate.parameter_verdict[k];
    }
}

static enum exit_status replay(int32_t log, int32_t out) {
    static hexload_paper_t estimator;
    static hexload_paper_t staged;
    static hexload_config_t config;
    const header_t header = {.config_bytes = sizeof config,
                             .estimator_bytes = sizeof estimator,
                             .filter_bytes = sizeof estimator.filter,
                             .nop_instructions = count_nops()};
    hexload_leg_sample_t sample;
    if (!semihosting_read(log, &config, sizeof config) ||
        hexload_paper_init(&estimator, &config) != HEXLOAD_OK) {
        return BAD_CONFIG;
    }
    if (!semihosting_write(out, &header, sizeof header)) {
        return BAD_FILE;
    }
    while (semihosting_read(log, &sample, sizeof sample)) {
        answer_t answer = {0};
        staged = estimator;
        run_stages(&staged, &config, &sample, answer.stage_instructions);
        run_tick(&estimator, &config, &sample, &answer);
        if (memcmp(&staged, &estimator, offsetof(hexload_paper_t, health)) != 0) {
            return STAGES_DIFFER;
        }
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
