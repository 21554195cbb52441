/// @file loose_plug.h
/// A displacement that jumps, alone, by more than its leg can have moved, as that of a loose plug does, is
/// taken for missing: it goes on with its leg's velocity, as in lost_channels.h. Internal.
#ifndef HEXLOAD_LOOSE_PLUG_H
#define HEXLOAD_LOOSE_PLUG_H

#include "hexload/state.h"

/// What the leg's velocity and 1 m/s more explain is no jump: a velocity sensor may fail, too. After 0.1 s
/// the displacement counts as it is shown, as a zero that has moved. Not without velocity sensors, nor where
/// another displacement is missing.
/// @param[in] gate the last accepted sample, from which the displacement goes on.
/// @param[in] sample as hexload_lost_channels_mend() returns it.
/// @param[out] bridged the sample with the displacement by its velocity; may be `sample`.
/// @param[in,out] next what *lost is once the sample has been accepted: the displacement is missing.
/// @param[in,out] health sets CHANNEL_LOST.
/// @return bridged, or the sample itself, where nothing or more than one has jumped. Some 80 instructions,
/// reentrant.
HEXLOAD_MUST_USE const hexload_leg_sample_t*
hexload_loose_plug_bridge(const hexload_lost_channels_t* lost, const hexload_config_t* config,
                          const hexload_leg_gate_t* gate, const hexload_leg_sample_t* sample,
                          hexload_leg_sample_t* bridged, hexload_lost_channels_t* next, uint32_t* health);

#endif
