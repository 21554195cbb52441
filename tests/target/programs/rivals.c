/// Runs the filters of rivals.h on one problem: argument OUT, a file of the host, see
/// tools/python/hexload_dev/target.py.
#include "rivals.h"

#include "instruction_counter.h"
#include "semihosting.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

void* _sbrk(ptrdiff_t increment);

/// Eigen's fixed-size matrices refer to the heap without using it: it is empty.
void* _sbrk(ptrdiff_t increment) {
    (void)increment;
    return (void*)-1;
}

enum { STEPS = 300, FILTERS = 4 };

typedef struct {
    uint32_t instructions; ///< of the longest step
    float parameter[PARAMETERS];
} answer_t;

static const float truth[PARAMETERS] = {0.2f, 25.0f, 22.0f, 18.0f};

static rival_filter_t start(void) {
    static const float sigma[RIVAL_STATES] = {1e-3f, 1e-3f, 1e-3f, 0.1f, 5.0f, 5.0f, 5.0f};
    rival_filter_t filter = {.x = {0.0f, 0.0f, 0.0f, 0.3f, 20.0f, 20.0f, 20.0f}};
    for (int i = 0; i < RIVAL_STATES; i++) {
        filter.P[i][i] = sigma[i] * sigma[i];
    }
    return filter;
}

/// A motion like the paper's: N's five entries swing, and the rates follow from the true parameters.
static rival_input_t input_of(int step, float rate[RATES]) {
    rival_input_t input = {.N = {{0}}};
    for (int i = 0; i < RATES; i++) {
        const float phase = (float)((step * (7 + 2 * i)) % 64) / 32.0f - 1.0f;
        input.N[i][1 + i] = 1e-4f * phase;
        input.N[i][0] = i < 2 ? 1e-2f * (0.5f - phase * phase) : 0.0f;
        input.Q[i][i] = 1e-9f;
        input.R[i][i] = 1e-6f;
        rate[i] += input.N[i][0] * truth[0] + input.N[i][1 + i] * truth[1 + i];
        input.measured[i] = rate[i];
    }
    return input;
}

static dense_input_t dense_input_of(const rival_input_t* input) {
    dense_input_t dense = {.F = {{0}}};
    for (int i = 0; i < RIVAL_STATES; i++) {
        dense.F[i][i] = 1.0f;
    }
    for (int i = 0; i < RATES; i++) {
        dense.H[i][i] = 1.0f;
        memcpy(&dense.F[i][RATES], input->N[i], sizeof input->N[i]);
    }
    return dense;
}

static void count(uint32_t mark, answer_t* answer) {
    const uint32_t instructions = instruction_counter_since(mark);
    answer->instructions = instructions > answer->instructions ? instructions : answer->instructions;
}

int main(void) {
    char command_line[512];
    char* rest = NULL;
    answer_t answers[FILTERS] = {{0}};
    rival_filter_t dense = start();
    rival_filter_t eigen = start();
    own_filter_start(&dense);
    float rate[RATES] = {0};
    instruction_counter_start();
    for (int step = 0; step < STEPS; step++) {
        rival_input_t input = input_of(step, rate);
        const dense_input_t dense_input = dense_input_of(&input);
        uint32_t mark = instruction_counter_mark();
        dense_filter_step(&dense, &dense_input, &input);
        count(mark, &answers[0]);
        mark = instruction_counter_mark();
        eigen_filter_step(&eigen, &input);
        count(mark, &answers[1]);
        own_filter_prepare(&input);
        mark = instruction_counter_mark();
        own_filter_step(&input);
        count(mark, &answers[2]);
        mark = instruction_counter_mark();
        kalman_filter_step(&input);
        count(mark, &answers[3]);
    }
    memcpy(answers[0].parameter, &dense.x[RATES], sizeof answers[0].parameter);
    memcpy(answers[1].parameter, &eigen.x[RATES], sizeof answers[1].parameter);
    own_filter_read(answers[2].parameter);
    kalman_filter_read(answers[3].parameter);
    if (!semihosting_command_line(command_line, sizeof command_line) ||
        strtok_r(command_line, " ", &rest) == NULL) {
        return 2;
    }
    const char* out_path = strtok_r(NULL, " ", &rest);
    const int32_t out = out_path != NULL ? semihosting_open(out_path, SEMIHOSTING_WRITE) : -1;
    const bool is_written =
        out >= 0 && semihosting_write(out, answers, sizeof answers) && semihosting_close(out);
    return is_written ? 0 : 3;
}
