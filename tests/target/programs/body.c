/// Describes estimates inside the controller and brings them to their nearest bodies: arguments IN OUT, files
/// of the host in the format of tools/python/hexload_dev/target.py.
#include "hexload/estimate.h"

#include "arguments.h"
#include "instruction_counter.h"
#include "painted_stack.h"
#include "semihosting.h"

#include <string.h>

enum exit_status { DONE, BAD_ARGUMENTS = 2, BAD_FILE };

enum { BODY_NUMBERS = 20 }; // of hexload_body_t, before its flags

typedef struct {
    float theta[HEXLOAD_LOAD_DIM];
    float covariance[HEXLOAD_LOAD_COVARIANCES];
} question_t;

typedef struct {
    float body[BODY_NUMBERS];
    uint32_t has_com;
    uint32_t has_inertia;
    uint32_t is_consistent;
    float nearest[HEXLOAD_LOAD_DIM];
    float distance_sigmas;
    uint32_t is_found;
    uint32_t describe_instructions;
    uint32_t nearest_instructions;
    uint32_t describe_stack_bytes;
    uint32_t nearest_stack_bytes;
} answer_t;

_Static_assert(offsetof(hexload_body_t, has_com) == BODY_NUMBERS * sizeof(float),
               "numbers first, then flags");

static void answer_question(const question_t* question, answer_t* answer) {
    hexload_body_t body;
    const uint32_t* stack = paint_stack();
    uint32_t mark = instruction_counter_mark();
    hexload_body_describe(question->theta, question->covariance, &body);
    answer->describe_instructions = instruction_counter_since(mark);
    answer->describe_stack_bytes = used_stack_bytes(stack);
    stack = paint_stack();
    mark = instruction_counter_mark();
    answer->is_found = hexload_body_nearest(question->theta, question->covariance, answer->nearest,
                                            &answer->distance_sigmas);
    answer->nearest_instructions = instruction_counter_since(mark);
    answer->nearest_stack_bytes = used_stack_bytes(stack);
    memcpy(answer->body, &body, sizeof answer->body);
    answer->has_com = body.has_com;
    answer->has_inertia = body.has_inertia;
    answer->is_consistent = body.is_consistent;
}

int main(void) {
    const char* words[2];
    question_t question;
    if (!arguments_read(words, 2)) {
        return BAD_ARGUMENTS;
    }
    const int32_t in = semihosting_open(words[0], SEMIHOSTING_READ);
    const int32_t out = semihosting_open(words[1], SEMIHOSTING_WRITE);
    if (in < 0 || out < 0) {
        return BAD_FILE;
    }
    instruction_counter_start();
    while (semihosting_read(in, &question, sizeof question)) {
        answer_t answer = {0};
        answer_question(&question, &answer);
        if (!semihosting_write(out, &answer, sizeof answer)) {
            return BAD_FILE;
        }
    }
    return semihosting_close(out) ? DONE : BAD_FILE;
}
