#include "bus/answer_frames.h"

#include "bus/frame.h"

#include <hexload_dbc.h>
#include <math.h>
#include <stddef.h>

// Codes of the DBC are those of the core. The application checks its own.
#define SAME_VERDICTS(signal)                                                                                \
    _Static_assert((int)HEXLOAD_DBC_##signal##_CONVERGED_CHOICE == HEXLOAD_VERDICT_CONVERGED &&              \
                       (int)HEXLOAD_DBC_##signal##_CONVERGING_CHOICE == HEXLOAD_VERDICT_CONVERGING &&        \
                       (int)HEXLOAD_DBC_##signal##_NOT_EXCITED_CHOICE == HEXLOAD_VERDICT_NOT_EXCITED &&      \
                       (int)HEXLOAD_DBC_##signal##_MISFIT_CHOICE == HEXLOAD_VERDICT_MISFIT &&                \
                       (int)HEXLOAD_DBC_##signal##_INCONSISTENT_CHOICE == HEXLOAD_VERDICT_INCONSISTENT,      \
                   "verdicts of the DBC")
SAME_VERDICTS(HEALTH_FD_VERDICT);
SAME_VERDICTS(ANSWER_PAGE_VERDICT);
#define SAME_VERDICTS_OF(parameter)                                                                          \
    SAME_VERDICTS(HEALTH_FD_VERDICT_##parameter);                                                            \
    SAME_VERDICTS(ANSWER_PAGE_VERDICT_##parameter)
SAME_VERDICTS_OF(DZ);
SAME_VERDICTS_OF(IXX);
SAME_VERDICTS_OF(IYY);
SAME_VERDICTS_OF(IZZ);
SAME_VERDICTS_OF(LOAD_M);
SAME_VERDICTS_OF(LOAD_HX);
SAME_VERDICTS_OF(LOAD_HY);
SAME_VERDICTS_OF(LOAD_HZ);
SAME_VERDICTS_OF(LOAD_IXX);
SAME_VERDICTS_OF(LOAD_IYY);
SAME_VERDICTS_OF(LOAD_IZZ);
SAME_VERDICTS_OF(LOAD_IXY);
SAME_VERDICTS_OF(LOAD_IXZ);
SAME_VERDICTS_OF(LOAD_IYZ);

#define SAME_STATUSES(signal)                                                                                \
    _Static_assert(HEXLOAD_DBC_##signal##_OK_CHOICE == HEXLOAD_OK &&                                         \
                       HEXLOAD_DBC_##signal##_ERR_CONFIG_CHOICE == HEXLOAD_ERR_CONFIG &&                     \
                       HEXLOAD_DBC_##signal##_ERR_SAMPLE_CHOICE == HEXLOAD_ERR_SAMPLE &&                     \
                       HEXLOAD_DBC_##signal##_ERR_TICK_CHOICE == HEXLOAD_ERR_TICK &&                         \
                       HEXLOAD_DBC_##signal##_ERR_POSE_CHOICE == HEXLOAD_ERR_POSE &&                         \
                       HEXLOAD_DBC_##signal##_ERR_SINGULAR_CHOICE == HEXLOAD_ERR_SINGULAR,                   \
                   "statuses of the DBC")
SAME_STATUSES(HEALTH_FD_STATUS);
SAME_STATUSES(ANSWER_PAGE_STATUS);

_Static_assert((int)HEXLOAD_HEALTH_BITS == 16,
               "health bits of the DBC: its range and its comments name each");

#define SAME_FILTERS(signal)                                                                                 \
    _Static_assert((int)HEXLOAD_DBC_##signal##_PAPER_CHOICE == HEXLOAD_FILTER_PAPER &&                       \
                       (int)HEXLOAD_DBC_##signal##_MOMENTUM_CHOICE == HEXLOAD_FILTER_MOMENTUM,               \
                   "filters of the DBC")
SAME_FILTERS(HEALTH_FD_FILTER);
SAME_FILTERS(ANSWER_PAGE_FILTER);

// The ten parameters among the codec's fields: in an initialiser, and as the entries of an array.
#define LOAD_FIELDS(prefix, type, from)                                                                      \
    .prefix##load_m = (type)(from)[HEXLOAD_LOAD_M], .prefix##load_hx = (type)(from)[HEXLOAD_LOAD_HX],        \
    .prefix##load_hy = (type)(from)[HEXLOAD_LOAD_HY], .prefix##load_hz = (type)(from)[HEXLOAD_LOAD_HZ],      \
    .prefix##load_ixx = (type)(from)[HEXLOAD_LOAD_IXX], .prefix##load_iyy = (type)(from)[HEXLOAD_LOAD_IYY],  \
    .prefix##load_izz = (type)(from)[HEXLOAD_LOAD_IZZ], .prefix##load_ixy = (type)(from)[HEXLOAD_LOAD_IXY],  \
    .prefix##load_ixz = (type)(from)[HEXLOAD_LOAD_IXZ], .prefix##load_iyz = (type)(from)[HEXLOAD_LOAD_IYZ]
#define LOAD_ENTRIES(prefix, message)                                                                        \
    {                                                                                                        \
        (message).prefix##load_m, (message).prefix##load_hx, (message).prefix##load_hy,                      \
            (message).prefix##load_hz, (message).prefix##load_ixx, (message).prefix##load_iyy,               \
            (message).prefix##load_izz, (message).prefix##load_ixy, (message).prefix##load_ixz,              \
            (message).prefix##load_iyz                                                                       \
    }
_Static_assert(HEXLOAD_LOAD_M == 0 && HEXLOAD_LOAD_HZ == 3 && HEXLOAD_LOAD_IZZ == 6 && HEXLOAD_LOAD_IYZ == 9,
               "order of the entries");

static const hexload_frame_layout_t estimate_layout = {HEXLOAD_DBC_ESTIMATE_FD_FRAME_ID,
                                                       HEXLOAD_DBC_ESTIMATE_FD_LENGTH};
static const hexload_frame_layout_t sigma_layout = {HEXLOAD_DBC_SIGMA_FD_FRAME_ID,
                                                    HEXLOAD_DBC_SIGMA_FD_LENGTH};
static const hexload_frame_layout_t load_layout = {HEXLOAD_DBC_LOAD_FD_FRAME_ID, HEXLOAD_DBC_LOAD_FD_LENGTH};
static const hexload_frame_layout_t load_sigma_layout = {HEXLOAD_DBC_LOAD_SIGMA_FD_FRAME_ID,
                                                         HEXLOAD_DBC_LOAD_SIGMA_FD_LENGTH};
static const hexload_frame_layout_t health_layout = {HEXLOAD_DBC_HEALTH_FD_FRAME_ID,
                                                     HEXLOAD_DBC_HEALTH_FD_LENGTH};
static const hexload_frame_layout_t page_layout = {HEXLOAD_DBC_ANSWER_PAGE_FRAME_ID,
                                                   HEXLOAD_DBC_ANSWER_PAGE_LENGTH};

// Codes of a classic answer's pages. Values and sigmas of a filter follow one another.
enum {
    PAGE_HEALTH = HEXLOAD_DBC_ANSWER_PAGE_PAGE_HEALTH_CHOICE,
    PAGE_VALUE = HEXLOAD_DBC_ANSWER_PAGE_PAGE_DZ_CHOICE,
    PAGE_SIGMA = HEXLOAD_DBC_ANSWER_PAGE_PAGE_SIGMA_DZ_CHOICE,
    PAGE_NIS = HEXLOAD_DBC_ANSWER_PAGE_PAGE_NIS_CHOICE,
    PAGE_NIS_MEAN = HEXLOAD_DBC_ANSWER_PAGE_PAGE_NIS_MEAN_CHOICE,
    PAGE_VERDICTS = HEXLOAD_DBC_ANSWER_PAGE_PAGE_VERDICTS_CHOICE,
    PAGE_REFUSED = HEXLOAD_DBC_ANSWER_PAGE_PAGE_REFUSED_CHOICE,
    PAGE_LOAD_VALUE = HEXLOAD_DBC_ANSWER_PAGE_PAGE_LOAD_M_CHOICE,
    PAGE_LOAD_SIGMA = HEXLOAD_DBC_ANSWER_PAGE_PAGE_SIGMA_LOAD_M_CHOICE,
    PAGE_LOAD_VERDICTS = HEXLOAD_DBC_ANSWER_PAGE_PAGE_LOAD_VERDICTS_CHOICE,
};
_Static_assert((int)HEXLOAD_DBC_ANSWER_PAGE_PAGE_IZZ_CHOICE == PAGE_VALUE + HEXLOAD_PAPER_DIM - 1 &&
                   (int)HEXLOAD_DBC_ANSWER_PAGE_PAGE_SIGMA_IZZ_CHOICE == PAGE_SIGMA + HEXLOAD_PAPER_DIM - 1 &&
                   PAGE_HEALTH == 0 && PAGE_VALUE == 1 && PAGE_SIGMA == PAGE_VALUE + HEXLOAD_PAPER_DIM &&
                   PAGE_NIS == PAGE_SIGMA + HEXLOAD_PAPER_DIM && PAGE_LOAD_VALUE == PAGE_REFUSED + 1 &&
                   PAGE_REFUSED == HEXLOAD_BUS_ANSWER_PAGES - 1,
               "pages of the DBC");
_Static_assert((int)HEXLOAD_DBC_ANSWER_PAGE_PAGE_LOAD_IYZ_CHOICE == PAGE_LOAD_VALUE + HEXLOAD_LOAD_DIM - 1 &&
                   PAGE_LOAD_SIGMA == PAGE_LOAD_VALUE + HEXLOAD_LOAD_DIM &&
                   (int)HEXLOAD_DBC_ANSWER_PAGE_PAGE_SIGMA_LOAD_IYZ_CHOICE ==
                       PAGE_LOAD_SIGMA + HEXLOAD_LOAD_DIM - 1 &&
                   PAGE_REFUSED == PAGE_NIS + 3,
               "pages of the DBC");

// Places in a round of the momentum filter: health, values and sigmas, nis to refused, verdicts.
enum {
    PLACE_NIS = 1 + 2 * HEXLOAD_LOAD_DIM,
    PLACE_VERDICTS = PLACE_NIS + 4,
};
_Static_assert(PLACE_VERDICTS == HEXLOAD_BUS_LOAD_ANSWER_PAGES - 1, "pages of the DBC");

/// Code of the page at this place of a round.
static int page_code(uint8_t filter, int place) {
    if (filter != HEXLOAD_FILTER_MOMENTUM || place == 0) {
        return place;
    }
    if (place < PLACE_NIS) {
        return PAGE_LOAD_VALUE - 1 + place;
    }
    return place < PLACE_VERDICTS ? PAGE_NIS - PLACE_NIS + place : PAGE_LOAD_VERDICTS;
}

/// The place of a page in a round; -1: rounds of this filter have no such page.
static int page_place(uint8_t filter, int code) {
    for (int place = 0; place < hexload_bus_answer_pages(filter); place++) {
        if (page_code(filter, place) == code) {
            return place;
        }
    }
    return -1;
}

static int parameters_of(uint8_t filter) {
    return filter == HEXLOAD_FILTER_MOMENTUM ? (int)HEXLOAD_LOAD_DIM : (int)HEXLOAD_PAPER_DIM;
}

/// Checks a number that goes on the bus as float32 or came from there.
static bool is_float32(hexload_real_t value) {
    return isfinite((float)value);
}

static bool is_finite(const hexload_estimate_t* estimate, int parameters) {
    for (int k = 0; k < parameters; k++) {
        if (!is_float32(estimate->value[k]) || !is_float32(estimate->sigma[k])) {
            return false;
        }
    }
    return is_float32(estimate->nis) && is_float32(estimate->nis_mean);
}

static void encode_estimate(const hexload_bus_answer_t* answer, hexload_bus_frame_t* frame) {
    const hexload_estimate_t* estimate = &answer->estimate;
    const struct hexload_dbc_estimate_fd_t message = {
        .tick = answer->tick,
        .dz = (float)estimate->value[HEXLOAD_PAPER_DZ],
        .ixx = (float)estimate->value[HEXLOAD_PAPER_IXX],
        .iyy = (float)estimate->value[HEXLOAD_PAPER_IYY],
        .izz = (float)estimate->value[HEXLOAD_PAPER_IZZ],
        .nis = (float)estimate->nis,
    };
    hexload_frame_begin(frame, &estimate_layout);
    (void)hexload_dbc_estimate_fd_pack(frame->data, &message, sizeof frame->data);
    hexload_frame_seal(frame, &estimate_layout);
}

static void encode_sigma(const hexload_bus_answer_t* answer, hexload_bus_frame_t* frame) {
    const hexload_estimate_t* estimate = &answer->estimate;
    const struct hexload_dbc_sigma_fd_t message = {
        .tick = answer->tick,
        .sigma_dz = (float)estimate->sigma[HEXLOAD_PAPER_DZ],
        .sigma_ixx = (float)estimate->sigma[HEXLOAD_PAPER_IXX],
        .sigma_iyy = (float)estimate->sigma[HEXLOAD_PAPER_IYY],
        .sigma_izz = (float)estimate->sigma[HEXLOAD_PAPER_IZZ],
        .nis_mean = (float)estimate->nis_mean,
    };
    hexload_frame_begin(frame, &sigma_layout);
    (void)hexload_dbc_sigma_fd_pack(frame->data, &message, sizeof frame->data);
    hexload_frame_seal(frame, &sigma_layout);
}

static void encode_load(const hexload_bus_answer_t* answer, hexload_bus_frame_t* frame) {
    const struct hexload_dbc_load_fd_t message = {.tick = answer->tick,
                                                  LOAD_FIELDS(, float, answer->estimate.value),
                                                  .nis = (float)answer->estimate.nis};
    hexload_frame_begin(frame, &load_layout);
    (void)hexload_dbc_load_fd_pack(frame->data, &message, sizeof frame->data);
    hexload_frame_seal(frame, &load_layout);
}

static void encode_load_sigma(const hexload_bus_answer_t* answer, hexload_bus_frame_t* frame) {
    const struct hexload_dbc_load_sigma_fd_t message = {.tick = answer->tick,
                                                        LOAD_FIELDS(sigma_, float, answer->estimate.sigma),
                                                        .nis_mean = (float)answer->estimate.nis_mean};
    hexload_frame_begin(frame, &load_sigma_layout);
    (void)hexload_dbc_load_sigma_fd_pack(frame->data, &message, sizeof frame->data);
    hexload_frame_seal(frame, &load_sigma_layout);
}

/// The codec writes the verdicts of the filter alone.
static void encode_health(const hexload_bus_answer_t* answer, hexload_bus_frame_t* frame) {
    const hexload_verdict_t* verdict = answer->estimate.parameter_verdict;
    const struct hexload_dbc_health_fd_t message = {
        .tick = answer->tick,
        .status = answer->status,
        .state = answer->state,
        .fault = answer->fault,
        .verdict = (uint8_t)answer->estimate.verdict,
        .verdict_dz = (uint8_t)verdict[HEXLOAD_PAPER_DZ],
        .verdict_ixx = (uint8_t)verdict[HEXLOAD_PAPER_IXX],
        .verdict_iyy = (uint8_t)verdict[HEXLOAD_PAPER_IYY],
        .verdict_izz = (uint8_t)verdict[HEXLOAD_PAPER_IZZ],
        LOAD_FIELDS(verdict_, uint8_t, verdict),
        .missing_legs = answer->missing_legs,
        .filter = answer->filter,
        .health = answer->health,
        .input_cause = (uint8_t)answer->input.cause,
        .input_leg = hexload_frame_leg_code(&answer->input),
        .refused = answer->refused,
    };
    hexload_frame_begin(frame, &health_layout);
    (void)hexload_dbc_health_fd_pack(frame->data, &message, sizeof frame->data);
    hexload_frame_seal(frame, &health_layout);
}

static uint16_t tick_low(const hexload_bus_answer_t* answer) {
    return (uint16_t)(answer->tick % HEXLOAD_ANSWER_TICKS);
}

/// Goes up by one from page to page.
static uint8_t page_counter(uint32_t tick) {
    return hexload_frame_counter(tick / HEXLOAD_BUS_ANSWER_PERIOD);
}

// The codec writes the signals of the page alone.

static void pack_health_page(const hexload_bus_answer_t* answer, uint8_t* data) {
    const struct hexload_dbc_answer_page_t message = {.page = PAGE_HEALTH,
                                                      .counter = page_counter(answer->tick),
                                                      .tick_low = tick_low(answer),
                                                      .health = answer->health,
                                                      .state = answer->state,
                                                      .verdict = (uint8_t)answer->estimate.verdict,
                                                      .fault = answer->fault,
                                                      .filter = answer->filter};
    (void)hexload_dbc_answer_page_pack(data, &message, HEXLOAD_DBC_ANSWER_PAGE_LENGTH);
}

static void pack_verdict_page(const hexload_bus_answer_t* answer, uint8_t* data) {
    const hexload_verdict_t* verdict = answer->estimate.parameter_verdict;
    const struct hexload_dbc_answer_page_t message = {.page = PAGE_VERDICTS,
                                                      .counter = page_counter(answer->tick),
                                                      .tick_low = tick_low(answer),
                                                      .verdict_dz = (uint8_t)verdict[HEXLOAD_PAPER_DZ],
                                                      .verdict_ixx = (uint8_t)verdict[HEXLOAD_PAPER_IXX],
                                                      .verdict_iyy = (uint8_t)verdict[HEXLOAD_PAPER_IYY],
                                                      .verdict_izz = (uint8_t)verdict[HEXLOAD_PAPER_IZZ],
                                                      .status = answer->status,
                                                      .missing_legs = answer->missing_legs};
    (void)hexload_dbc_answer_page_pack(data, &message, HEXLOAD_DBC_ANSWER_PAGE_LENGTH);
}

static void pack_load_verdict_page(const hexload_bus_answer_t* answer, uint8_t* data) {
    const hexload_verdict_t* verdict = answer->estimate.parameter_verdict;
    const struct hexload_dbc_answer_page_t message = {.page = PAGE_LOAD_VERDICTS,
                                                      .counter = page_counter(answer->tick),
                                                      .tick_low = tick_low(answer),
                                                      LOAD_FIELDS(verdict_, uint8_t, verdict)};
    (void)hexload_dbc_answer_page_pack(data, &message, HEXLOAD_DBC_ANSWER_PAGE_LENGTH);
}

static void pack_refused_page(const hexload_bus_answer_t* answer, uint8_t* data) {
    const struct hexload_dbc_answer_page_t message = {.page = PAGE_REFUSED,
                                                      .counter = page_counter(answer->tick),
                                                      .tick_low = tick_low(answer),
                                                      .refused = answer->refused};
    (void)hexload_dbc_answer_page_pack(data, &message, HEXLOAD_DBC_ANSWER_PAGE_LENGTH);
}

/// All pages with a number have it in the same place: it is packed as that of one, with the code of another.
static void pack_number_page(const hexload_bus_answer_t* answer, int code, hexload_real_t number,
                             uint8_t* data) {
    const struct hexload_dbc_answer_page_t message = {.page = PAGE_NIS,
                                                      .counter = page_counter(answer->tick),
                                                      .tick_low = tick_low(answer),
                                                      .nis = (float)number};
    (void)hexload_dbc_answer_page_pack(data, &message, HEXLOAD_DBC_ANSWER_PAGE_LENGTH);
    data[3] = (uint8_t)((data[3] & 0x03u) | (unsigned)code << 2); // the upper six bits, as the DBC says
}

/// The number of a page that has one.
static hexload_real_t number_of(const hexload_estimate_t* estimate, int code) {
    if (code >= PAGE_LOAD_VALUE) {
        const int k = code - PAGE_LOAD_VALUE;
        return k < HEXLOAD_LOAD_DIM ? estimate->value[k] : estimate->sigma[k - HEXLOAD_LOAD_DIM];
    }
    if (code >= PAGE_NIS) {
        return code == PAGE_NIS ? estimate->nis : estimate->nis_mean;
    }
    const int k = code - PAGE_VALUE;
    return k < HEXLOAD_PAPER_DIM ? estimate->value[k] : estimate->sigma[k - HEXLOAD_PAPER_DIM];
}

// Once all is inlined, the codec's choice among all pages is one that the compiler makes.
#if defined(__GNUC__)
#define WITH_ITS_CALLEES __attribute__((flatten))
#else
#define WITH_ITS_CALLEES
#endif

static WITH_ITS_CALLEES void encode_page(const hexload_bus_answer_t* answer, int code,
                                         hexload_bus_frame_t* frame) {
    hexload_frame_begin(frame, &page_layout);
    switch (code) {
    case PAGE_HEALTH:
        pack_health_page(answer, frame->data);
        break;
    case PAGE_VERDICTS:
        pack_verdict_page(answer, frame->data);
        break;
    case PAGE_REFUSED:
        pack_refused_page(answer, frame->data);
        break;
    case PAGE_LOAD_VERDICTS:
        pack_load_verdict_page(answer, frame->data);
        break;
    default:
        pack_number_page(answer, code, number_of(&answer->estimate, code), frame->data);
        break;
    }
    hexload_frame_seal(frame, &page_layout);
}

int hexload_bus_encode_answer(hexload_bus_profile_t profile, const hexload_bus_answer_t* answer, int page,
                              hexload_bus_frame_t frames[HEXLOAD_BUS_ANSWER_FRAMES]) {
    if (!is_finite(&answer->estimate, parameters_of(answer->filter))) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    if (profile == HEXLOAD_BUS_CLASSIC) {
        encode_page(answer, page_code(answer->filter, page), &frames[0]);
        return 1;
    }
    if (answer->filter == HEXLOAD_FILTER_MOMENTUM) {
        encode_load(answer, &frames[HEXLOAD_ANSWER_ESTIMATE]);
        encode_load_sigma(answer, &frames[HEXLOAD_ANSWER_SIGMA]);
    } else {
        encode_estimate(answer, &frames[HEXLOAD_ANSWER_ESTIMATE]);
        encode_sigma(answer, &frames[HEXLOAD_ANSWER_SIGMA]);
    }
    encode_health(answer, &frames[HEXLOAD_ANSWER_HEALTH]);
    return HEXLOAD_BUS_ANSWER_FRAMES;
}

/// The DBC's ranges: of a value any finite number, of sigmas, nis and the paper's inertias none below 0.
static bool is_number(float number, bool is_signed) {
    return isfinite(number) && (is_signed || number >= 0.0f);
}

/// The parameters, so many of them signed, and one more number; the outputs change only when all are in
/// range.
static hexload_bus_status_t take_numbers(const float* numbers, int count, int signed_count, float last,
                                         hexload_real_t* out, hexload_real_t* last_out) {
    bool all_good = is_number(last, false);
    for (int k = 0; k < count; k++) {
        all_good = all_good && is_number(numbers[k], k < signed_count);
    }
    if (!all_good) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    for (int k = 0; k < count; k++) {
        out[k] = (hexload_real_t)numbers[k];
    }
    *last_out = (hexload_real_t)last;
    return HEXLOAD_BUS_OK;
}

static hexload_bus_status_t decode_estimate(const hexload_bus_frame_t* frame, hexload_bus_answer_t* answer) {
    hexload_bus_status_t status = hexload_frame_check(frame, &estimate_layout);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    struct hexload_dbc_estimate_fd_t m = {0};
    (void)hexload_dbc_estimate_fd_unpack(&m, frame->data, sizeof frame->data);
    const float value[HEXLOAD_PAPER_DIM] = {m.dz, m.ixx, m.iyy, m.izz};
    status = take_numbers(value, HEXLOAD_PAPER_DIM, 1, m.nis, answer->estimate.value, &answer->estimate.nis);
    if (status == HEXLOAD_BUS_OK) {
        answer->tick = m.tick;
        answer->filter = HEXLOAD_FILTER_PAPER;
    }
    return status;
}

static hexload_bus_status_t decode_sigma(const hexload_bus_frame_t* frame, hexload_bus_answer_t* answer) {
    hexload_bus_status_t status = hexload_frame_check(frame, &sigma_layout);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    struct hexload_dbc_sigma_fd_t m = {0};
    (void)hexload_dbc_sigma_fd_unpack(&m, frame->data, sizeof frame->data);
    const float sigma[HEXLOAD_PAPER_DIM] = {m.sigma_dz, m.sigma_ixx, m.sigma_iyy, m.sigma_izz};
    status = take_numbers(sigma, HEXLOAD_PAPER_DIM, 0, m.nis_mean, answer->estimate.sigma,
                          &answer->estimate.nis_mean);
    if (status == HEXLOAD_BUS_OK) {
        answer->tick = m.tick;
        answer->filter = HEXLOAD_FILTER_PAPER;
    }
    return status;
}

static hexload_bus_status_t decode_load(const hexload_bus_frame_t* frame, hexload_bus_answer_t* answer) {
    hexload_bus_status_t status = hexload_frame_check(frame, &load_layout);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    struct hexload_dbc_load_fd_t m = {0};
    (void)hexload_dbc_load_fd_unpack(&m, frame->data, sizeof frame->data);
    const float value[HEXLOAD_LOAD_DIM] = LOAD_ENTRIES(, m);
    status = take_numbers(value, HEXLOAD_LOAD_DIM, HEXLOAD_LOAD_DIM, m.nis, answer->estimate.value,
                          &answer->estimate.nis);
    if (status == HEXLOAD_BUS_OK) {
        answer->tick = m.tick;
        answer->filter = HEXLOAD_FILTER_MOMENTUM;
    }
    return status;
}

static hexload_bus_status_t decode_load_sigma(const hexload_bus_frame_t* frame,
                                              hexload_bus_answer_t* answer) {
    hexload_bus_status_t status = hexload_frame_check(frame, &load_sigma_layout);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    struct hexload_dbc_load_sigma_fd_t m = {0};
    (void)hexload_dbc_load_sigma_fd_unpack(&m, frame->data, sizeof frame->data);
    const float sigma[HEXLOAD_LOAD_DIM] = LOAD_ENTRIES(sigma_, m);
    status = take_numbers(sigma, HEXLOAD_LOAD_DIM, 0, m.nis_mean, answer->estimate.sigma,
                          &answer->estimate.nis_mean);
    if (status == HEXLOAD_BUS_OK) {
        answer->tick = m.tick;
        answer->filter = HEXLOAD_FILTER_MOMENTUM;
    }
    return status;
}

/// The outputs change only when all codes are those of verdicts.
static hexload_bus_status_t take_verdicts(const uint8_t* codes, int count, hexload_estimate_t* estimate) {
    for (int k = 0; k < count; k++) {
        if (codes[k] > HEXLOAD_VERDICT_INCONSISTENT) {
            return HEXLOAD_BUS_ERR_VALUE;
        }
    }
    for (int k = 0; k < count; k++) {
        estimate->parameter_verdict[k] = (hexload_verdict_t)codes[k];
    }
    return HEXLOAD_BUS_OK;
}

static hexload_bus_status_t take_health_verdicts(const struct hexload_dbc_health_fd_t* m,
                                                 hexload_estimate_t* estimate) {
    const uint8_t paper[HEXLOAD_PAPER_DIM] = {m->verdict_dz, m->verdict_ixx, m->verdict_iyy, m->verdict_izz};
    const uint8_t load[HEXLOAD_LOAD_DIM] = LOAD_ENTRIES(verdict_, *m);
    return m->filter == HEXLOAD_FILTER_MOMENTUM ? take_verdicts(load, HEXLOAD_LOAD_DIM, estimate)
                                                : take_verdicts(paper, HEXLOAD_PAPER_DIM, estimate);
}

static hexload_bus_status_t decode_health(const hexload_bus_frame_t* frame, hexload_bus_answer_t* answer) {
    const hexload_bus_status_t status = hexload_frame_check(frame, &health_layout);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    struct hexload_dbc_health_fd_t m = {0};
    (void)hexload_dbc_health_fd_unpack(&m, frame->data, sizeof frame->data);
    if (!hexload_dbc_health_fd_status_is_in_range(m.status) ||
        !hexload_dbc_health_fd_state_is_in_range(m.state) ||
        !hexload_dbc_health_fd_fault_is_in_range(m.fault) ||
        !hexload_dbc_health_fd_filter_is_in_range(m.filter) ||
        !hexload_dbc_health_fd_verdict_is_in_range(m.verdict) ||
        take_health_verdicts(&m, &answer->estimate) != HEXLOAD_BUS_OK) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    answer->tick = m.tick;
    answer->status = m.status;
    answer->state = m.state;
    answer->fault = m.fault;
    answer->missing_legs = m.missing_legs;
    answer->filter = m.filter;
    answer->health = m.health;
    answer->input = (hexload_input_fault_t){.cause = hexload_frame_input_cause(m.input_cause),
                                            .leg = hexload_frame_input_leg(m.input_leg)};
    answer->refused = m.refused;
    answer->estimate.verdict = (hexload_verdict_t)m.verdict;
    return HEXLOAD_BUS_OK;
}

hexload_bus_status_t hexload_answer_decode_fd(const hexload_bus_frame_t* frame, int* part,
                                              hexload_bus_answer_t* answer) {
    static const struct {
        hexload_bus_status_t (*decode)(const hexload_bus_frame_t* frame, hexload_bus_answer_t* answer);
        int part;
    } decoders[] = {{decode_estimate, HEXLOAD_ANSWER_ESTIMATE},
                    {decode_load, HEXLOAD_ANSWER_ESTIMATE},
                    {decode_sigma, HEXLOAD_ANSWER_SIGMA},
                    {decode_load_sigma, HEXLOAD_ANSWER_SIGMA},
                    {decode_health, HEXLOAD_ANSWER_HEALTH}};
    hexload_bus_status_t status = HEXLOAD_BUS_OTHER;
    size_t n = 0;
    while (n < sizeof decoders / sizeof decoders[0] && status == HEXLOAD_BUS_OTHER) {
        status = decoders[n].decode(frame, answer);
        n++;
    }
    if (status == HEXLOAD_BUS_OK) {
        *part = decoders[n - 1].part;
    }
    return status;
}

static hexload_bus_status_t take_number(float number, bool is_signed, hexload_real_t* out) {
    if (!is_number(number, is_signed)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    *out = (hexload_real_t)number;
    return HEXLOAD_BUS_OK;
}

static hexload_bus_status_t take_health_page(const struct hexload_dbc_answer_page_t* m,
                                             hexload_bus_answer_t* answer) {
    if (!hexload_dbc_answer_page_filter_is_in_range(m->filter) ||
        !hexload_dbc_answer_page_state_is_in_range(m->state) ||
        !hexload_dbc_answer_page_verdict_is_in_range(m->verdict) ||
        !hexload_dbc_answer_page_fault_is_in_range(m->fault)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    answer->health = m->health;
    answer->state = m->state;
    answer->estimate.verdict = (hexload_verdict_t)m->verdict;
    answer->fault = m->fault;
    answer->filter = m->filter;
    return HEXLOAD_BUS_OK;
}

/// Its four verdicts are those of the paper's filter, and nobody's in a round of the other.
static hexload_bus_status_t take_verdict_page(const struct hexload_dbc_answer_page_t* m,
                                              hexload_bus_answer_t* answer) {
    const uint8_t verdict[HEXLOAD_PAPER_DIM] = {m->verdict_dz, m->verdict_ixx, m->verdict_iyy,
                                                m->verdict_izz};
    if (!hexload_dbc_answer_page_status_is_in_range(m->status) ||
        take_verdicts(verdict, HEXLOAD_PAPER_DIM, &answer->estimate) != HEXLOAD_BUS_OK) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    answer->status = m->status;
    answer->missing_legs = m->missing_legs;
    return HEXLOAD_BUS_OK;
}

static hexload_bus_status_t take_load_verdict_page(const struct hexload_dbc_answer_page_t* m,
                                                   hexload_bus_answer_t* answer) {
    const uint8_t verdict[HEXLOAD_LOAD_DIM] = LOAD_ENTRIES(verdict_, *m);
    return take_verdicts(verdict, HEXLOAD_LOAD_DIM, &answer->estimate);
}

/// A page with a value or a sigma of one of the filters.
static hexload_bus_status_t take_parameter_page(const struct hexload_dbc_answer_page_t* m,
                                                hexload_estimate_t* estimate) {
    const float value[HEXLOAD_PAPER_DIM] = {m->dz, m->ixx, m->iyy, m->izz};
    const float sigma[HEXLOAD_PAPER_DIM] = {m->sigma_dz, m->sigma_ixx, m->sigma_iyy, m->sigma_izz};
    const float load[HEXLOAD_LOAD_DIM] = LOAD_ENTRIES(, *m);
    const float load_sigma[HEXLOAD_LOAD_DIM] = LOAD_ENTRIES(sigma_, *m);
    const int page = m->page; // the pages between these ranges are not asked for here
    if (page < PAGE_SIGMA) {
        return take_number(value[page - PAGE_VALUE], page == (int)PAGE_VALUE,
                           &estimate->value[page - PAGE_VALUE]);
    }
    if (page < PAGE_NIS) {
        return take_number(sigma[page - PAGE_SIGMA], false, &estimate->sigma[page - PAGE_SIGMA]);
    }
    if (page < PAGE_LOAD_SIGMA) {
        return take_number(load[page - PAGE_LOAD_VALUE], true, &estimate->value[page - PAGE_LOAD_VALUE]);
    }
    if (page < PAGE_LOAD_VERDICTS) {
        return take_number(load_sigma[page - PAGE_LOAD_SIGMA], false,
                           &estimate->sigma[page - PAGE_LOAD_SIGMA]);
    }
    return HEXLOAD_BUS_ERR_VALUE;
}

static hexload_bus_status_t take_page(const struct hexload_dbc_answer_page_t* m,
                                      hexload_bus_answer_t* answer) {
    switch ((int)m->page) {
    case PAGE_HEALTH:
        return take_health_page(m, answer);
    case PAGE_NIS:
        return take_number(m->nis, false, &answer->estimate.nis);
    case PAGE_NIS_MEAN:
        return take_number(m->nis_mean, false, &answer->estimate.nis_mean);
    case PAGE_VERDICTS:
        return take_verdict_page(m, answer);
    case PAGE_REFUSED:
        answer->refused = m->refused;
        return HEXLOAD_BUS_OK;
    case PAGE_LOAD_VERDICTS:
        return take_load_verdict_page(m, answer);
    default:
        return take_parameter_page(m, &answer->estimate);
    }
}

hexload_bus_status_t hexload_answer_decode_page(const hexload_bus_frame_t* frame, int* page,
                                                uint16_t* tick_low, hexload_bus_answer_t* answer) {
    hexload_bus_status_t status = hexload_frame_check(frame, &page_layout);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    struct hexload_dbc_answer_page_t message = {0};
    (void)hexload_dbc_answer_page_unpack(&message, frame->data, sizeof frame->data);
    if (message.counter != page_counter(message.tick_low)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    status = take_page(&message, answer);
    if (status == HEXLOAD_BUS_OK) {
        *page = page_place(answer->filter, message.page);
        *tick_low = message.tick_low;
    }
    return status;
}

hexload_bus_status_t hexload_answer_check_profile(const hexload_bus_frame_t* frame,
                                                  hexload_bus_profile_t own_profile) {
    const hexload_frame_layout_t* const fd[] = {&estimate_layout, &sigma_layout, &health_layout, &load_layout,
                                                &load_sigma_layout};
    const hexload_frame_layout_t* other = own_profile == HEXLOAD_BUS_FD ? &page_layout : NULL;
    for (size_t n = 0; own_profile == HEXLOAD_BUS_CLASSIC && n < sizeof fd / sizeof fd[0]; n++) {
        other = frame->id == fd[n]->id ? fd[n] : other;
    }
    if (other == NULL) {
        return HEXLOAD_BUS_OTHER;
    }
    const hexload_bus_status_t status = hexload_frame_check(frame, other);
    return status == HEXLOAD_BUS_OK ? HEXLOAD_BUS_ERR_PROFILE : status;
}
