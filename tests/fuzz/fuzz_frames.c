/// Decoders of frames, and the assemblies of samples and answers.
#include "bytes.h"

#include "frames.h"

#include "bus/answer_assembly.h"
#include "bus/sample_assembly.h"

#include <math.h>

void setUp(void) {}
void tearDown(void) {}

static hexload_bus_frame_t next_frame(bytes_t* bytes) {
    hexload_bus_frame_t frame = {0};
    uint16_t id;
    const uint8_t what = take_byte(bytes);
    take(bytes, &id, sizeof id);
    frame.id = what % 2 == 0 ? id % 0x130u : id;
    frame.is_fd = (what & 2) != 0;
    frame.length = (uint8_t)(take_byte(bytes) % (frame.is_fd ? 65 : 9));
    take(bytes, frame.data, frame.length);
    if ((what & 4) == 0 && frame.length >= 4) {
        seal(&frame); // else hardly any gets past its checksum
    }
    return frame;
}

static void check_sample(const hexload_leg_sample_t* sample) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        PROMISE(isfinite(sample->displacement_m[leg]) && isfinite(sample->force_n[leg]));
        PROMISE(!isinf(sample->velocity_m_s[leg]));
    }
}

static void check_answer(const hexload_bus_answer_t* answer) {
    for (int k = 0; k < (answer->filter == HEXLOAD_FILTER_PAPER ? 4 : 10); k++) {
        PROMISE(isfinite(answer->estimate.value[k]));
        PROMISE((unsigned)answer->estimate.parameter_verdict[k] <= (unsigned)HEXLOAD_VERDICT_INCONSISTENT);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    bytes_t bytes = {data, size};
    const hexload_bus_profile_t profile = take_byte(&bytes) % 2 == 0 ? HEXLOAD_BUS_FD : HEXLOAD_BUS_CLASSIC;
    hexload_sample_assembly_t samples;
    hexload_answer_assembly_t answers;
    hexload_sample_assembly_init(&samples, profile);
    hexload_answer_assembly_init(&answers, profile);
    while (bytes.left > 0) {
        const hexload_bus_frame_t frame = next_frame(&bytes);
        hexload_leg_sample_t sample, sample_before;
        hexload_bus_answer_t answer;
        hexload_bus_command_t command;
        hexload_bus_acknowledge_t acknowledge;
        hexload_bus_controller_status_t status;
        hexload_bus_load_change_t change;
        uint32_t tick;
        memset(&sample, 0x5A, sizeof sample);
        memset(&status, 0, sizeof status);
        sample_before = sample;
        if (hexload_sample_assembly_add(&samples, &frame, &sample) == HEXLOAD_BUS_OK) {
            check_sample(&sample);
        } else {
            PROMISE(memcmp(&sample_before, &sample, sizeof sample) == 0);
        }
        if (hexload_answer_assembly_add(&answers, &frame, 17, &tick, &answer) == HEXLOAD_BUS_OK) {
            check_answer(&answer);
        }
        PROMISE(hexload_bus_decode_command(&frame, &command) != HEXLOAD_BUS_OK || isfinite(command.argument));
        (void)(hexload_bus_decode_acknowledge(&frame, &acknowledge) == HEXLOAD_BUS_OK);
        (void)(hexload_bus_decode_status(&frame, &status) == HEXLOAD_BUS_OK);
        (void)(hexload_bus_decode_load_change(&frame, &change) == HEXLOAD_BUS_OK);
    }
    return 0;
}
