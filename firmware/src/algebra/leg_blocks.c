#include "algebra/leg_blocks.h"

#include "algebra/linalg.h"

/// The carriers stay until another leg in the place of one would double the volume of their directions.
static const hexload_real_t WORTH_EXCHANGING = HEXLOAD_REAL(2.0);

/// Puts three legs first whose directions span space well in every pose: the first leg, the one most across
/// it, and the one most out of the plane of both. Then no entry of K is large, and no digits are lost.
static void choose_carriers(hexload_real_t J[HEXLOAD_LEGS][6], uint8_t leg[HEXLOAD_LEGS]) {
    hexload_real_t normal[3];
    hexload_real_t largest = HEXLOAD_REAL(0.0);
    int second = 1;
    for (int i = 1; i < HEXLOAD_LEGS; i++) {
        cross3(J[0], J[i], normal);
        const hexload_real_t size = dot3(normal, normal);
        if (size > largest) {
            largest = size;
            second = i;
        }
    }
    cross3(J[0], J[second], normal);
    largest = HEXLOAD_REAL(0.0);
    int third = 1;
    if (second == 1) {
        third = 2;
    }
    for (int i = 1; i < HEXLOAD_LEGS; i++) {
        const hexload_real_t size = hexload_abs(dot3(normal, J[i]));
        if (size > largest && i != second) {
            largest = size;
            third = i;
        }
    }
    leg[0] = 0;
    leg[1] = (uint8_t)second;
    leg[2] = (uint8_t)third;
    uint32_t others = 3;
    for (int i = 1; i < HEXLOAD_LEGS; i++) {
        if (i != second && i != third) {
            leg[others] = (uint8_t)i;
            others++;
        }
    }
}

/// A row times a matrix of three rows of three.
static void times_rows(const hexload_real_t row[3], const hexload_real_t* A, hexload_real_t out[3]) {
    HEXLOAD_UNROLL
    for (int k = 0; k < 3; k++) {
        out[k] = hexload_fma(row[2], A[6 + k], hexload_fma(row[1], A[3 + k], row[0] * A[k]));
    }
}

/// E1, M1 and K: the other legs' directions in terms of the carriers'.
static bool express_by_carriers(hexload_real_t J[HEXLOAD_LEGS][6], hexload_leg_blocks_t* blocks) {
    hexload_real_t E1[3][3];
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        const hexload_real_t* row = J[blocks->leg[i]];
        memcpy(E1[i], &row[0], sizeof E1[i]);
        memcpy(blocks->M1[i], &row[3], sizeof blocks->M1[i]);
    }
    if (!hexload_invert3(E1, blocks->E1_inverse)) {
        return false;
    }
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        times_rows(J[blocks->leg[3 + i]], blocks->E1_inverse[0], blocks->K[i]);
    }
    return true;
}

/// Entry (i, k) of K is the factor by which the volume of the carriers' directions grows when other leg i
/// takes the place of carrier k.
static bool spans_well(const hexload_leg_blocks_t* blocks) {
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            if (hexload_abs(blocks->K[i][k]) > WORTH_EXCHANGING) {
                return false;
            }
        }
    }
    return true;
}

/// S: what is left of the other legs' moments.
static bool take_carriers_out(hexload_real_t J[HEXLOAD_LEGS][6], hexload_leg_blocks_t* blocks) {
    hexload_real_t S[3][3];
    for (int i = 0; i < 3; i++) {
        const hexload_real_t* row = J[blocks->leg[3 + i]];
        hexload_real_t share[3];
        times_rows(blocks->K[i], blocks->M1[0], share);
        for (int k = 0; k < 3; k++) {
            S[i][k] = row[3 + k] - share[k];
        }
    }
    return hexload_invert3(S, blocks->S_inverse);
}

bool hexload_leg_blocks_make(hexload_real_t J[HEXLOAD_LEGS][6], hexload_leg_blocks_t* blocks) {
    choose_carriers(J, blocks->leg);
    return express_by_carriers(J, blocks) && take_carriers_out(J, blocks);
}

bool hexload_leg_blocks_update(hexload_real_t J[HEXLOAD_LEGS][6], hexload_leg_blocks_t* blocks) {
    if (!express_by_carriers(J, blocks) || !spans_well(blocks)) {
        return hexload_leg_blocks_make(J, blocks);
    }
    return take_carriers_out(J, blocks);
}

void hexload_leg_blocks_solve(const hexload_leg_blocks_t* blocks, const hexload_real_t y[HEXLOAD_LEGS],
                              hexload_real_t x[6]) {
    const uint8_t* leg = blocks->leg;
    const hexload_real_t y1[3] = {y[leg[0]], y[leg[1]], y[leg[2]]};
    hexload_real_t y2[3];
    hexload_real_t left[3];
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        y2[i] = y[leg[3 + i]] - dot3(blocks->K[i], y1);
    }
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        x[3 + i] = dot3(blocks->S_inverse[i], y2);
    }
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        left[i] = y1[i] - dot3(blocks->M1[i], &x[3]);
    }
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        x[i] = dot3(blocks->E1_inverse[i], left);
    }
}

void hexload_leg_blocks_invert(const hexload_leg_blocks_t* blocks, hexload_real_t columns[HEXLOAD_LEGS][6]) {
    hexload_real_t share[3][3];   // S^-1 [-K, E] is the lower half, columns in the order of blocks->leg
    hexload_real_t carried[3][3]; // v = E1^-1 y1 - (E1^-1 M1) omega
    for (int i = 0; i < 3; i++) {
        times_rows(blocks->S_inverse[i], blocks->K[0], share[i]);
        times_rows(blocks->E1_inverse[i], blocks->M1[0], carried[i]);
    }
    for (int n = 0; n < HEXLOAD_LEGS; n++) {
        hexload_real_t* twist = columns[blocks->leg[n]];
        hexload_real_t turned[3];
        for (int i = 0; i < 3; i++) {
            twist[3 + i] = n < 3 ? -share[i][n] : blocks->S_inverse[i][n - 3];
        }
        hexload_times3(carried[0], &twist[3], turned);
        for (int i = 0; i < 3; i++) {
            twist[i] = n < 3 ? blocks->E1_inverse[i][n] - turned[i] : -turned[i];
        }
    }
}
