#include "bus/answer_frames.h"

#include "bus/frame.h"

#include <hexload_dbc.h>

#include <stddef.h>

// Codes of the DBC are those of the core. The application checks its own.
#define SAME_VERDICTS(signal)                                                                                \
    _Static_assert((int)HEXLOAD_DBC_##signal##_CONVERGED_CHOICE == HEXLOAD_VERDICT_CONVERGED &&              \
                       (int)HEXLOAD_DBC_##signal##_CONVERGING_CHOICE == HEXLOAD_VERDICT_CONVERGING &&        \
                       (int)HEXLOAD_DBC_##signal##_NOT_EXCITED_CHOICE == HEXLOAD_VERDICT_NOT_EXCITED &&      \
                       (int)HEXLOAD_DBC_##signal##_INCONSISTENT_CHOICE == HEXLOAD_VERDICT_INCONSISTENT,      \
                   "verdicts of the DBC")
SAME_VERDICTS(HEALTH_FD_VERDICT);
SAME_VERDICTS(HEALTH_FD_VERDICT_DZ);
SAME_VERDICTS(HEALTH_FD_VERDICT_IXX);
SAME_VERDICTS(HEALTH_FD_VERDICT_IYY);
SAME_VERDICTS(HEALTH_FD_VERDICT_IZZ);
SAME_VERDICTS(ANSWER_PAGE_VERDICT);
SAME_VERDICTS(ANSWER_PAGE_VERDICT_DZ);
SAME_VERDICTS(ANSWER_PAGE_VERDICT_IXX);
SAME_VERDICTS(ANSWER_PAGE_VERDICT_IYY);
SAME_VERDICTS(ANSWER_PAGE_VERDICT_IZZ);

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

_Static_assert((int)HEXLOAD_HEALTH_BITS == 12,
               "health bits of the DBC: its range and its comments name each");

// This version answers with the paper's filter in every frame.
enum { PAPER = HEXLOAD_FILTER_PAPER };
_Static_assert((int)HEXLOAD_DBC_ESTIMATE_FD_FILTER_PAPER_CHOICE == PAPER, "filters of the DBC");
_Static_assert((int)HEXLOAD_DBC_SIGMA_FD_FILTER_PAPER_CHOICE == PAPER, "filters of the DBC");
_Static_assert((int)HEXLOAD_DBC_ANSWER_PAGE_FILTER_PAPER_CHOICE == PAPER, "filters of the DBC");

static const hexload_frame_layout_t estimate_layout = {HEXLOAD_DBC_ESTIMATE_FD_FRAME_ID,
                                                       HEXLOAD_DBC_ESTIMATE_FD_LENGTH, HEXLOAD_FRAME_CRC32};
static const hexload_frame_layout_t sigma_layout = {HEXLOAD_DBC_SIGMA_FD_FRAME_ID,
                                                    HEXLOAD_DBC_SIGMA_FD_LENGTH, HEXLOAD_FRAME_CRC32};
static const hexload_frame_layout_t health_layout = {HEXLOAD_DBC_HEALTH_FD_FRAME_ID,
                                                     HEXLOAD_DBC_HEALTH_FD_LENGTH, HEXLOAD_FRAME_CRC32};
static const hexload_frame_layout_t page_layout = {HEXLOAD_DBC_ANSWER_PAGE_FRAME_ID,
                                                   HEXLOAD_DBC_ANSWER_PAGE_LENGTH, HEXLOAD_FRAME_CRC8};

// Pages of a classic answer. The four values and the four sigmas follow one another.
enum {
    PAGE_HEALTH = HEXLOAD_DBC_ANSWER_PAGE_PAGE_HEALTH_CHOICE,
    PAGE_VALUE = HEXLOAD_DBC_ANSWER_PAGE_PAGE_DZ_CHOICE,
    PAGE_SIGMA = HEXLOAD_DBC_ANSWER_PAGE_PAGE_SIGMA_DZ_CHOICE,
    PAGE_NIS = HEXLOAD_DBC_ANSWER_PAGE_PAGE_NIS_CHOICE,
    PAGE_NIS_MEAN = HEXLOAD_DBC_ANSWER_PAGE_PAGE_NIS_MEAN_CHOICE,
    PAGE_VERDICTS = HEXLOAD_DBC_ANSWER_PAGE_PAGE_VERDICTS_CHOICE,
    PAGE_REFUSED = HEXLOAD_DBC_ANSWER_PAGE_PAGE_REFUSED_CHOICE,
};
_Static_assert((int)HEXLOAD_DBC_ANSWER_PAGE_PAGE_IZZ_CHOICE == PAGE_VALUE + HEXLOAD_PAPER_DIM - 1 &&
                   (int)HEXLOAD_DBC_ANSWER_PAGE_PAGE_SIGMA_IZZ_CHOICE == PAGE_SIGMA + HEXLOAD_PAPER_DIM - 1 &&
                   PAGE_HEALTH == 0 && PAGE_REFUSED == HEXLOAD_BUS_ANSWER_PAGES - 1,
               "pages of the DBC");

/// Checks a number that goes on the bus as float32 or came from there.
static bool is_float32(hexload_real_t value) {
    return isfinite((float)value);
}

static bool is_finite(const hexload_estimate_t* estimate) {
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
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
        .filter = PAPER,
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
        .filter = PAPER,
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
        .missing_legs = answer->missing_legs,
        .health = answer->health,
        .refused = answer->refused,
    };
    hexload_frame_begin(frame, &health_layout);
    (void)hexload_dbc_health_fd_pack(frame->data, &message, sizeof frame->data);
    hexload_frame_seal(frame, &health_layout);
}

/// The codec writes the signals of the page alone.
static void encode_page(const hexload_bus_answer_t* answer, int page, hexload_bus_frame_t* frame) {
    const hexload_estimate_t* estimate = &answer->estimate;
    const hexload_verdict_t* verdict = estimate->parameter_verdict;
    const struct hexload_dbc_answer_page_t message = {
        .page = (uint8_t)page,
        .tick_low = (uint16_t)(answer->tick & 0xFFFFu),
        .health = answer->health,
        .state = answer->state,
        .verdict = (uint8_t)estimate->verdict,
        .fault = answer->fault,
        .filter = PAPER,
        .dz = (float)estimate->value[HEXLOAD_PAPER_DZ],
        .ixx = (float)estimate->value[HEXLOAD_PAPER_IXX],
        .iyy = (float)estimate->value[HEXLOAD_PAPER_IYY],
        .izz = (float)estimate->value[HEXLOAD_PAPER_IZZ],
        .sigma_dz = (float)estimate->sigma[HEXLOAD_PAPER_DZ],
        .sigma_ixx = (float)estimate->sigma[HEXLOAD_PAPER_IXX],
        .sigma_iyy = (float)estimate->sigma[HEXLOAD_PAPER_IYY],
        .sigma_izz = (float)estimate->sigma[HEXLOAD_PAPER_IZZ],
        .nis = (float)estimate->nis,
        .nis_mean = (float)estimate->nis_mean,
        .verdict_dz = (uint8_t)verdict[HEXLOAD_PAPER_DZ],
        .verdict_ixx = (uint8_t)verdict[HEXLOAD_PAPER_IXX],
        .verdict_iyy = (uint8_t)verdict[HEXLOAD_PAPER_IYY],
        .verdict_izz = (uint8_t)verdict[HEXLOAD_PAPER_IZZ],
        .status = answer->status,
        .missing_legs = answer->missing_legs,
        .refused = answer->refused,
    };
    hexload_frame_begin(frame, &page_layout);
    (void)hexload_dbc_answer_page_pack(frame->data, &message, sizeof frame->data);
    hexload_frame_seal(frame, &page_layout);
}

int hexload_bus_encode_answer(hexload_bus_profile_t profile, const hexload_bus_answer_t* answer, int page,
                              hexload_bus_frame_t frames[HEXLOAD_BUS_ANSWER_FRAMES]) {
    if (!is_finite(&answer->estimate)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    if (profile == HEXLOAD_BUS_CLASSIC) {
        encode_page(answer, page, &frames[0]);
        return 1;
    }
    encode_estimate(answer, &frames[HEXLOAD_ANSWER_ESTIMATE]);
    encode_sigma(answer, &frames[HEXLOAD_ANSWER_SIGMA]);
    encode_health(answer, &frames[HEXLOAD_ANSWER_HEALTH]);
    return HEXLOAD_BUS_ANSWER_FRAMES;
}

/// Four parameters and one more number; the outputs change only when all are finite.
static hexload_bus_status_t take_numbers(const float numbers[HEXLOAD_PAPER_DIM], float last,
                                         hexload_real_t out[HEXLOAD_PAPER_DIM], hexload_real_t* last_out) {
    bool all_finite = isfinite(last);
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        all_finite = all_finite && isfinite(numbers[k]);
    }
    if (!all_finite) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
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
    if (m.filter != PAPER) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    const float value[HEXLOAD_PAPER_DIM] = {m.dz, m.ixx, m.iyy, m.izz};
    status = take_numbers(value, m.nis, answer->estimate.value, &answer->estimate.nis);
    if (status == HEXLOAD_BUS_OK) {
        answer->tick = m.tick;
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
    if (m.filter != PAPER) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    const float sigma[HEXLOAD_PAPER_DIM] = {m.sigma_dz, m.sigma_ixx, m.sigma_iyy, m.sigma_izz};
    status = take_numbers(sigma, m.nis_mean, answer->estimate.sigma, &answer->estimate.nis_mean);
    if (status == HEXLOAD_BUS_OK) {
        answer->tick = m.tick;
    }
    return status;
}

static void take_verdicts(uint8_t dz, uint8_t ixx, uint8_t iyy, uint8_t izz, hexload_estimate_t* estimate) {
    estimate->parameter_verdict[HEXLOAD_PAPER_DZ] = (hexload_verdict_t)dz;
    estimate->parameter_verdict[HEXLOAD_PAPER_IXX] = (hexload_verdict_t)ixx;
    estimate->parameter_verdict[HEXLOAD_PAPER_IYY] = (hexload_verdict_t)iyy;
    estimate->parameter_verdict[HEXLOAD_PAPER_IZZ] = (hexload_verdict_t)izz;
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
        !hexload_dbc_health_fd_verdict_is_in_range(m.verdict) ||
        !hexload_dbc_health_fd_verdict_dz_is_in_range(m.verdict_dz) ||
        !hexload_dbc_health_fd_verdict_ixx_is_in_range(m.verdict_ixx) ||
        !hexload_dbc_health_fd_verdict_iyy_is_in_range(m.verdict_iyy) ||
        !hexload_dbc_health_fd_verdict_izz_is_in_range(m.verdict_izz)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    answer->tick = m.tick;
    answer->status = m.status;
    answer->state = m.state;
    answer->fault = m.fault;
    answer->missing_legs = m.missing_legs;
    answer->health = m.health;
    answer->refused = m.refused;
    answer->estimate.verdict = (hexload_verdict_t)m.verdict;
    take_verdicts(m.verdict_dz, m.verdict_ixx, m.verdict_iyy, m.verdict_izz, &answer->estimate);
    return HEXLOAD_BUS_OK;
}

hexload_bus_status_t hexload_answer_decode_fd(const hexload_bus_frame_t* frame, int* part,
                                              hexload_bus_answer_t* answer) {
    hexload_bus_status_t status = decode_estimate(frame, answer);
    int found = HEXLOAD_ANSWER_ESTIMATE;
    if (status == HEXLOAD_BUS_OTHER) {
        status = decode_sigma(frame, answer);
        found = HEXLOAD_ANSWER_SIGMA;
    }
    if (status == HEXLOAD_BUS_OTHER) {
        status = decode_health(frame, answer);
        found = HEXLOAD_ANSWER_HEALTH;
    }
    if (status == HEXLOAD_BUS_OK) {
        *part = found;
    }
    return status;
}

static hexload_bus_status_t take_number(float number, hexload_real_t* out) {
    if (!isfinite(number)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    *out = (hexload_real_t)number;
    return HEXLOAD_BUS_OK;
}

static hexload_bus_status_t take_health_page(const struct hexload_dbc_answer_page_t* m,
                                             hexload_bus_answer_t* answer) {
    if (m->filter != PAPER || !hexload_dbc_answer_page_state_is_in_range(m->state) ||
        !hexload_dbc_answer_page_verdict_is_in_range(m->verdict) ||
        !hexload_dbc_answer_page_fault_is_in_range(m->fault)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    answer->health = m->health;
    answer->state = m->state;
    answer->estimate.verdict = (hexload_verdict_t)m->verdict;
    answer->fault = m->fault;
    return HEXLOAD_BUS_OK;
}

static hexload_bus_status_t take_verdict_page(const struct hexload_dbc_answer_page_t* m,
                                              hexload_bus_answer_t* answer) {
    if (!hexload_dbc_answer_page_verdict_dz_is_in_range(m->verdict_dz) ||
        !hexload_dbc_answer_page_verdict_ixx_is_in_range(m->verdict_ixx) ||
        !hexload_dbc_answer_page_verdict_iyy_is_in_range(m->verdict_iyy) ||
        !hexload_dbc_answer_page_verdict_izz_is_in_range(m->verdict_izz) ||
        !hexload_dbc_answer_page_status_is_in_range(m->status)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    take_verdicts(m->verdict_dz, m->verdict_ixx, m->verdict_iyy, m->verdict_izz, &answer->estimate);
    answer->status = m->status;
    answer->missing_legs = m->missing_legs;
    return HEXLOAD_BUS_OK;
}

static hexload_bus_status_t take_page(const struct hexload_dbc_answer_page_t* m,
                                      hexload_bus_answer_t* answer) {
    const float value[HEXLOAD_PAPER_DIM] = {m->dz, m->ixx, m->iyy, m->izz};
    const float sigma[HEXLOAD_PAPER_DIM] = {m->sigma_dz, m->sigma_ixx, m->sigma_iyy, m->sigma_izz};
    hexload_estimate_t* estimate = &answer->estimate;
    const int page = m->page;
    switch (page) {
    case PAGE_HEALTH:
        return take_health_page(m, answer);
    case PAGE_NIS:
        return take_number(m->nis, &estimate->nis);
    case PAGE_NIS_MEAN:
        return take_number(m->nis_mean, &estimate->nis_mean);
    case PAGE_VERDICTS:
        return take_verdict_page(m, answer);
    case PAGE_REFUSED:
        answer->refused = m->refused;
        return HEXLOAD_BUS_OK;
    default:
        break;
    }
    if (page >= PAGE_VALUE && page < PAGE_VALUE + HEXLOAD_PAPER_DIM) {
        return take_number(value[page - PAGE_VALUE], &estimate->value[page - PAGE_VALUE]);
    }
    if (page >= PAGE_SIGMA && page < PAGE_SIGMA + HEXLOAD_PAPER_DIM) {
        return take_number(sigma[page - PAGE_SIGMA], &estimate->sigma[page - PAGE_SIGMA]);
    }
    return HEXLOAD_BUS_ERR_VALUE;
}

hexload_bus_status_t hexload_answer_decode_page(const hexload_bus_frame_t* frame, int* page,
                                                uint16_t* tick_low, hexload_bus_answer_t* answer) {
    hexload_bus_status_t status = hexload_frame_check(frame, &page_layout);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    struct hexload_dbc_answer_page_t message = {0};
    (void)hexload_dbc_answer_page_unpack(&message, frame->data, sizeof frame->data);
    status = take_page(&message, answer);
    if (status == HEXLOAD_BUS_OK) {
        *page = message.page;
        *tick_low = message.tick_low;
    }
    return status;
}

hexload_bus_status_t hexload_answer_check_profile(const hexload_bus_frame_t* frame,
                                                  hexload_bus_profile_t own_profile) {
    const hexload_frame_layout_t* const fd[] = {&estimate_layout, &sigma_layout, &health_layout};
    const hexload_frame_layout_t* other = NULL;
    for (int part = 0; own_profile == HEXLOAD_BUS_CLASSIC && part < HEXLOAD_BUS_ANSWER_FRAMES; part++) {
        other = frame->id == fd[part]->id ? fd[part] : other;
    }
    if (own_profile == HEXLOAD_BUS_FD && frame->id == page_layout.id) {
        other = &page_layout;
    }
    if (other == NULL) {
        return HEXLOAD_BUS_OTHER;
    }
    return hexload_frame_fits(frame, other) ? HEXLOAD_BUS_ERR_PROFILE : HEXLOAD_BUS_ERR_LENGTH;
}
