/// @file sample_frames.h
/// Single frames of a leg sample. Internal to firmware/bus: hexload_bus_encode_sample() writes them,
/// sample_assembly.h puts them together.
#ifndef HEXLOAD_BUS_SAMPLE_FRAMES_H
#define HEXLOAD_BUS_SAMPLE_FRAMES_H

#include "bus/bus.h"

/// What one classic leg frame says.
typedef struct hexload_leg_frame {
    int leg;          ///< 0..HEXLOAD_LEGS - 1
    uint8_t tick_low; ///< the tick's low four bits
    hexload_real_t displacement_m;
    hexload_real_t velocity_m_s;
    hexload_real_t force_n;
} hexload_leg_frame_t;

/// @return HEXLOAD_BUS_OK, _OTHER, _ERR_LENGTH, _ERR_CRC, _ERR_VALUE; the output changes with OK only.
///         Likewise below.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_sample_decode_fd(const hexload_bus_frame_t* frame,
                                                               hexload_leg_sample_t* sample);
HEXLOAD_MUST_USE hexload_bus_status_t hexload_sample_decode_tick(const hexload_bus_frame_t* frame,
                                                                 uint32_t* tick);
HEXLOAD_MUST_USE hexload_bus_status_t hexload_sample_decode_leg(const hexload_bus_frame_t* frame,
                                                                hexload_leg_frame_t* leg);

/// For a frame that the reader's profile does not have: HEXLOAD_BUS_ERR_PROFILE when it is a well-formed
/// frame of the other profile's leg samples, _ERR_LENGTH when only its identifier is, else _OTHER.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_sample_check_profile(const hexload_bus_frame_t* frame,
                                                                   hexload_bus_profile_t own_profile);

#endif
