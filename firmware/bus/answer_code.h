/// @file answer_code.h
/// Answers of who has the key: one code, in a frame AnswerMac, for the answer frames of 16 ticks in the FD
/// profile and of 64 in the classic one, which has no room for more. The controller sends it behind the
/// answer to the last of the ticks, and behind the last answer of a run that is stopped. Both sides compute
/// it as the frames go by.
///
/// The nonce is that of START's code, as for samples. A code goes over whatever the controller has answered
/// of its ticks: a sample that is lost costs nothing. A reader that has lost a frame cannot tell by the code;
/// one that has the whole answers of all ticks can.
#ifndef HEXLOAD_BUS_ANSWER_CODE_H
#define HEXLOAD_BUS_ANSWER_CODE_H

#include "bus/authentication.h"

HEXLOAD_DECLS_BEGIN

typedef struct hexload_answer_code {
    hexload_cmac_blocks_t blocks;
    hexload_nonce_t nonce;
    hexload_bus_profile_t profile;
    uint32_t first_tick; ///< of those that have one code together
    uint32_t next_tick;  ///< that is to be answered
    uint32_t unproven;   ///< times 16 or 64 ticks that have begun since the last code, saturating
    bool has_frames;     ///< since that
    bool is_whole;       ///< all ticks so far have whole answers
} hexload_answer_code_t;

void hexload_answer_code_init(hexload_answer_code_t* self, hexload_bus_profile_t profile,
                              const hexload_nonce_t* nonce);

/// A frame of an answer that was sent, or received and taken. Encrypts four blocks at most.
/// @param ends_answer whether the answer is whole with it: in the classic profile, each page.
/// @param tick that is answered.
void hexload_answer_code_add(hexload_answer_code_t* self, const hexload_cipher_t* cipher,
                             const hexload_bus_frame_t* frame, bool ends_answer, uint32_t tick);

/// Whether the last of the ticks is answered, and their code is due.
bool hexload_answer_code_is_due(const hexload_answer_code_t* self);

/// The code of what there is, which need not be due. Two blocks to encrypt.
void hexload_answer_code_encode(hexload_answer_code_t* self, const hexload_cipher_t* cipher,
                                hexload_bus_frame_t* frame);

/// Whether a received frame is the code of what there is. Two blocks to encrypt when it is one.
/// @return HEXLOAD_BUS_OK: it is. _OTHER: no such frame. _PARTIAL: it is not, or there is nothing; frames
/// were
///         lost, so that this tells nothing. _ERR_AUTHENTICATION: it is not, although the answers to all
///         ticks have come: some of them are another's. _ERR_LENGTH.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_answer_code_check(hexload_answer_code_t* self,
                                                                const hexload_cipher_t* cipher,
                                                                const hexload_bus_frame_t* frame);

HEXLOAD_DECLS_END

#endif
