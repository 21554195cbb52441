/// Ticks that hand out their measurement update. In a file of their own: who wants no trace links none.
#include "momentum_tick.h"
#include "paper_tick.h"

/// With S = L L^T the innovation is L times the whitened one, and its variances are the rows of L squared.
static void write_trace(const hexload_momentum_t* self, const hexload_momentum_update_t* update,
                        hexload_trace_t* trace) {
    trace->nis = self->filter.nis;
    trace->gate = HEXLOAD_GATE_ACCEPTED; // an outlier is left out before: then there is no measurement
    for (int i = 0; i < 6; i++) {
        const hexload_real_t diagonal = HEXLOAD_REAL(1.0) / update->L[i][i];
        hexload_real_t innovation = diagonal * update->innovation[i];
        hexload_real_t variance = diagonal * diagonal;
        for (int k = 0; k < i; k++) {
            innovation = hexload_fma(update->L[i][k], update->innovation[k], innovation);
            variance = hexload_fma(update->L[i][k], update->L[i][k], variance);
        }
        trace->innovation[i] = innovation;
        trace->variance[i] = variance;
    }
}

/// A diagonal that the filter has not written says that there was no measurement.
static hexload_status_t run(hexload_momentum_t* self, const hexload_config_t* config,
                            hexload_effects_stage_t* effects, const hexload_leg_sample_t* sample,
                            hexload_estimate_t* estimate, hexload_trace_t* trace) {
    hexload_momentum_update_t update = {.L = {{HEXLOAD_REAL(0.0)}}};
    const hexload_status_t status = hexload_momentum_run(self, config, effects, sample, estimate, &update);
    if (status != HEXLOAD_OK) {
        return status;
    }
    *trace = (hexload_trace_t){.tick = self->smoother.middle_tick, .dimension = 6};
    trace->sum_nis = self->residual_test.nis;
    trace->sum_nis_mean = self->residual_test.nis_mean;
    if (update.L[0][0] > HEXLOAD_REAL(0.0)) {
        write_trace(self, &update, trace);
    }
    return HEXLOAD_OK;
}

hexload_status_t hexload_momentum_trace(hexload_momentum_t* self, const hexload_config_t* config,
                                        const hexload_leg_sample_t* sample, hexload_estimate_t* estimate,
                                        hexload_trace_t* trace) {
    return run(self, config, NULL, sample, estimate, trace);
}

hexload_status_t hexload_momentum_effects_trace(hexload_momentum_effects_t* self,
                                                const hexload_config_t* config,
                                                const hexload_leg_sample_t* sample,
                                                hexload_estimate_t* estimate, hexload_trace_t* trace) {
    return run(&self->momentum, config, &self->effects, sample, estimate, trace);
}

hexload_status_t hexload_paper_trace(hexload_paper_t* self, const hexload_config_t* config,
                                     const hexload_leg_sample_t* sample, hexload_estimate_t* estimate,
                                     hexload_trace_t* trace) {
    const uint32_t gated = (uint32_t)1 << HEXLOAD_HEALTH_MEASUREMENT_GATED;
    hexload_trace_t written = {.tick = sample->tick, .dimension = 3};
    const hexload_status_t status = hexload_paper_run(self, config, sample, estimate, &written);
    if (status != HEXLOAD_OK) {
        return status;
    }
    written.nis = self->filter.nis;
    written.sum_nis = self->residual_test.nis;
    written.sum_nis_mean = self->residual_test.nis_mean;
    written.gate = (self->health.bits & gated) != 0 ? HEXLOAD_GATE_REJECTED : written.gate;
    *trace = written;
    return HEXLOAD_OK;
}
