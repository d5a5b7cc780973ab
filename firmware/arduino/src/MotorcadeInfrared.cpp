#include "MotorcadeInfrared.h"

namespace motorcade {

namespace {

const uint8_t TOLERANCE_PERCENT = 25;
const uint8_t HEADER_MARK_UNITS = 16;
const uint8_t HEADER_SPACE_UNITS = 8;
// The receiver reports a mark's end late, by up to about ten periods of the carrier.
const uint16_t ECHO_US = 1000;

// Whether `due_us` is now or past, also where the clock wraps.
bool has_come(uint32_t now_us, uint32_t due_us) { return now_us - due_us < 0x80000000UL; }

}  // namespace

bool FrameDecoder::take_mark(uint32_t duration_us) {
  if (about(duration_us, HEADER_MARK_UNITS)) {
    restart();
    in_header_ = true;
  } else if (unit_us_ >= 2 * duration_us || 2 * duration_us >= 4UL * unit_us_ || bits_left_ == NO_FRAME) {
    restart();
  } else if (bits_left_ == 0) {
    frame_ = bits_;
    restart();
    return true;
  }
  return false;
}

void FrameDecoder::take_space(uint32_t duration_us) {
  if (in_header_) {
    in_header_ = false;
    bits_left_ = about(duration_us, HEADER_SPACE_UNITS) ? 32 : NO_FRAME;
  } else if (bits_left_ != NO_FRAME && bits_left_ > 0) {
    if (unit_us_ >= 2 * duration_us || 2 * duration_us >= 10UL * unit_us_) {
      restart();
      return;
    }
    bits_ = bits_ << 1 | (2 * duration_us > 4UL * unit_us_ ? 1 : 0);
    bits_left_--;
  }
}

void FrameDecoder::restart() {
  in_header_ = false;
  bits_left_ = NO_FRAME;
  bits_ = 0;
}

bool FrameDecoder::about(uint32_t duration_us, uint8_t units) const {
  // Longer than any mark or space in a frame; the product below would be too large.
  if (duration_us > 0xFFFFFUL) return false;
  const uint32_t nominal_us = static_cast<uint32_t>(units) * unit_us_;
  const uint32_t off_us = duration_us > nominal_us ? duration_us - nominal_us : nominal_us - duration_us;
  return off_us * 100 <= TOLERANCE_PERCENT * nominal_us;
}

void InfraredReceiver::ignore_until(uint32_t sent_until_us) {
  has_echo_ = true;
  echo_until_us_ = sent_until_us + ECHO_US;
}

bool InfraredReceiver::next_frame(uint32_t now_us, uint32_t &frame) {
  // All edges of an echo that is past now are stored already.
  const bool echo_is_past = has_come(now_us, echo_until_us_);
  if (static_cast<uint8_t>(written_ - read_) > EDGES) {
    // The oldest edges were overwritten: the frame that they belong to is lost.
    read_ = written_ - EDGES;
    decoder_.take_mark(0);
  }
  while (read_ != written_) {
    const uint32_t edge = times_us_[read_ & (EDGES - 1)];
    read_++;
    const bool level = edge & 1;
    const uint32_t at_us = edge & ~1UL;
    const bool is_echo = has_echo_ && has_come(echo_until_us_, at_us);
    bool ended = false;
    if (is_echo || level == level_) {
      // An echo; or an edge was missed, and the pulse was longer than it seems. No frame has a mark of length 0.
      decoder_.take_mark(0);
    } else if (level) {
      ended = decoder_.take_mark(at_us - last_us_);
    } else {
      decoder_.take_space(at_us - last_us_);
    }
    last_us_ = at_us;
    level_ = level;
    free_ = is_echo || ended;
    if (ended) {
      frame = decoder_.frame();
      return true;
    }
  }
  if (echo_is_past) has_echo_ = false;
  return false;
}

bool InfraredReceiver::senses_carrier(uint32_t now_us) {
  if (!level_) return true;
  if (!free_ && now_us - last_us_ > free_after_us_) free_ = true;
  return !free_;
}

}  // namespace motorcade
