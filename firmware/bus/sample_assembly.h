/// @file sample_assembly.h
/// Leg samples from frames, in either profile.
///
/// A leg or sample that comes again with other numbers has another source, and shows that one of the two is
/// false. FD: each frame is a whole sample; hexload_tick() refuses late ones. Classic: six leg
/// frames with the tick's low four bits, in any order. The frame with the whole tick that comes before them
/// at multiples of HEXLOAD_BUS_TICK_PERIOD sets the upper bits, once: from then on it confirms what the legs
/// count. Another one is refused until the next one follows it, with 16 ticks of legs between them when they
/// are ahead, so that false ones move no tick while the source goes on; when the next one goes back, legs of
/// another source have driven the count ahead: a contradiction. A source that
/// restarts begins with START, and so with hexload_sample_assembly_forgive(): then its first whole tick
/// counts. Before the first such frame, and after hexload_sample_assembly_lose_tick(), leg frames are not
/// used. Leg frames up to eight ticks ahead begin a new tick and end the one before: if legs were missing
/// there, that sample is lost and missing_legs says which. The others are late.
#ifndef HEXLOAD_BUS_SAMPLE_ASSEMBLY_H
#define HEXLOAD_BUS_SAMPLE_ASSEMBLY_H

#include "bus/bus.h"

HEXLOAD_DECLS_BEGIN

typedef struct hexload_sample_assembly {
    hexload_bus_profile_t profile;
    hexload_leg_sample_t sample;
    uint8_t legs;         ///< bit n: leg n + 1 of sample.tick has come
    bool has_tick;        ///< the whole tick is known; FD: there is a last sample
    uint8_t missing_legs; ///< of the last incomplete sample; 0: none so far
    bool is_forgiven;     ///< the present tick began before hexload_sample_assembly_forgive()
    bool has_claim;       ///< a whole tick has come that the legs do not count
    uint16_t claim_at;    ///< low half of sample.tick when it came
    uint32_t claim;       ///< that one
    uint32_t crc;         ///< FD: of the last sample
    uint32_t incomplete;  ///< samples given up, saturating
} hexload_sample_assembly_t;

void hexload_sample_assembly_init(hexload_sample_assembly_t* self, hexload_bus_profile_t profile);

/// Takes one frame.
/// @param[out] sample written with HEXLOAD_BUS_OK only.
/// @return HEXLOAD_BUS_OK: sample is whole. HEXLOAD_BUS_PARTIAL, _OTHER: go on. _ERR_LENGTH, _ERR_CRC,
///         _ERR_VALUE, _ERR_TICK, _ERR_PROFILE, _ERR_CONTRADICTION: the frame is refused and what was
///         assembled stays.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_sample_assembly_add(hexload_sample_assembly_t* self,
                                                                  const hexload_bus_frame_t* frame,
                                                                  hexload_leg_sample_t* sample);

/// A new run begins: legs that were missing before it are no longer reported, nor those of the tick that is
/// being assembled, should it stay incomplete.
void hexload_sample_assembly_forgive(hexload_sample_assembly_t* self);

/// Classic: after a silence in which the four-bit tick may have gone round, wait for the next whole tick.
void hexload_sample_assembly_lose_tick(hexload_sample_assembly_t* self);

HEXLOAD_DECLS_END

#endif
