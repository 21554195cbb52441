/// @file rivals.h
/// Filters as one would otherwise take them, for `hexload bench`, on the paper's problem with its model
/// given: seven states x = [omega; theta], F = [E, N; 0, E], H = [E, 0].
#ifndef HEXLOAD_TARGET_RIVALS_H
#define HEXLOAD_TARGET_RIVALS_H

#ifdef __cplusplus
extern "C" {
#endif

enum { RATES = 3, PARAMETERS = 4, RIVAL_STATES = RATES + PARAMETERS };

typedef struct rival_input {
    float N[RATES][PARAMETERS];
    float Q[RATES][RATES];
    float R[RATES][RATES];
    float measured[RATES];
} rival_input_t;

typedef struct rival_filter {
    float x[RIVAL_STATES];
    float P[RIVAL_STATES][RIVAL_STATES];
} rival_filter_t;

/// What a filter that knows nothing of F and H is given besides.
typedef struct dense_input {
    float F[RIVAL_STATES][RIVAL_STATES];
    float H[RATES][RIVAL_STATES];
} dense_input_t;

/// Textbook: dense 7 x 7 matrices, loops of general size, as small filter libraries do it.
void dense_filter_step(rival_filter_t* self, const dense_input_t* dense, const rival_input_t* input);

/// Eigen's fixed-size matrices, with the zeros and ones of F and H used by blocks, P kept symmetric.
void eigen_filter_step(rival_filter_t* self, const rival_input_t* input);

/// This project's filter without the model of the machine: time update, and measurement update with gate,
/// bounds and removal of noise effects. Of N it takes the paper's five entries, which prepare() puts where
/// the model's stage leaves them.
void own_filter_start(const rival_filter_t* start);
void own_filter_prepare(const rival_input_t* input);
void own_filter_step(rival_input_t* input);

/// The same without gate, bounds and removal of noise effects: what the rivals do.
void kalman_filter_step(rival_input_t* input);
void kalman_filter_read(float parameters[PARAMETERS]);
void own_filter_read(float parameters[PARAMETERS]);

#ifdef __cplusplus
}
#endif

#endif
