#include "hexload/types.h"

const char* hexload_status_name(hexload_status_t status) {
    switch (status) {
    case HEXLOAD_OK:
        return "ok";
    case HEXLOAD_ERR_CONFIG:
        return "configuration refused";
    case HEXLOAD_ERR_SAMPLE:
        return "sample not usable";
    case HEXLOAD_ERR_TICK:
        return "tick not later than the last";
    case HEXLOAD_ERR_POSE:
        return "pose not found";
    case HEXLOAD_ERR_SINGULAR:
        return "singular pose";
    default:
        return "unknown status";
    }
}

const char* hexload_health_name(hexload_health_bit_t bit) {
    switch (bit) {
    case HEXLOAD_HEALTH_LEG_OUT_OF_STROKE:
        return "leg out of stroke";
    case HEXLOAD_HEALTH_SAMPLE_MISSING:
        return "sample missing";
    case HEXLOAD_HEALTH_RATE_RESEEDED:
        return "rate reseeded";
    case HEXLOAD_HEALTH_MEASUREMENT_GATED:
        return "measurement gated";
    case HEXLOAD_HEALTH_INERTIA_BOUNDED:
        return "inertia bounded";
    case HEXLOAD_HEALTH_COVARIANCE_BOUNDED:
        return "covariance bounded";
    case HEXLOAD_HEALTH_NOT_EXCITED:
        return "not excited";
    case HEXLOAD_HEALTH_INCONSISTENT:
        return "inconsistent";
    case HEXLOAD_HEALTH_FILTER_RESTARTED:
        return "filter restarted";
    case HEXLOAD_HEALTH_NOISE_BOUNDED:
        return "noise removal bounded";
    case HEXLOAD_HEALTH_LOAD_CHANGED:
        return "load changed";
    case HEXLOAD_HEALTH_NOISE_MISSTATED:
        return "noise misstated";
    case HEXLOAD_HEALTH_MODEL_MISFIT:
        return "model misfit";
    case HEXLOAD_HEALTH_INPUT_IMPLAUSIBLE:
        return "input implausible";
    case HEXLOAD_HEALTH_CHANNEL_LOST:
        return "channel lost";
    case HEXLOAD_HEALTH_FRAMES_REFUSED:
        return "frames refused";
    case HEXLOAD_HEALTH_BITS:
    default:
        return "unknown health bit";
    }
}
