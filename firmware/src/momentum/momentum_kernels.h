/// @file momentum_kernels.h
/// As algebra/linalg_kernels.h, for momentum_model.h and momentum_model.c alone.
#ifndef HEXLOAD_MOMENTUM_KERNELS_H
#define HEXLOAD_MOMENTUM_KERNELS_H

/// Y's rows `from` to `to` - 1 times ten numbers x and ten numbers y, which share what is read of Y; of the
/// linear momentum's, the first three, only m and h count.
HEXLOAD_KERNEL void hexload_momentum_rows(hexload_real_t Y[6][HEXLOAD_LOAD_DIM],
                                          const hexload_real_t x[HEXLOAD_LOAD_DIM],
                                          const hexload_real_t y[HEXLOAD_LOAD_DIM], int from, int to,
                                          hexload_real_t product[2][6]) {
    // Copies: as x and y might be part of the product they would be read for each row.
    const hexload_real_t body[2][4] = {{x[0], x[1], x[2], x[3]}, {y[0], y[1], y[2], y[3]}};
    int a = from;
    for (; a < to && a < 3; a++) {
        product[0][a] = dot4(Y[a], body[0]);
        product[1][a] = dot4(Y[a], body[1]);
    }
    if (a == to) {
        return;
    }
    const hexload_real_t inertia[2][HEXLOAD_I_DIM] = {{x[4], x[5], x[6], x[7], x[8], x[9]},
                                                      {y[4], y[5], y[6], y[7], y[8], y[9]}};
    for (; a < to; a++) {
        const hexload_real_t* of_inertia = &Y[a][HEXLOAD_LOAD_IXX];
        const hexload_real_t first = dot4(Y[a], body[0]) + dot6(of_inertia, inertia[0]);
        const hexload_real_t second = dot4(Y[a], body[1]) + dot6(of_inertia, inertia[1]);
        product[0][a] = first;
        product[1][a] = second;
    }
}

#endif
