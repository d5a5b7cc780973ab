// Infrared frames in, from the edges of a demodulating receiver (VS1838B, TSOP38238), as
// motorcade/words/infrared.py and motorcade/boards/on_chip/infrared.py have it.
#ifndef MOTORCADE_INFRARED_H
#define MOTORCADE_INFRARED_H

#include <stdint.h>

namespace motorcade {

// Find frames in marks and spaces. After noise it finds the next frame by its header.
class FrameDecoder {
 public:
  explicit FrameDecoder(uint16_t unit_us) : unit_us_(unit_us) {}

  // Take a mark: the carrier was on for `duration_us`. Return true where a frame ended with it.
  bool take_mark(uint32_t duration_us);
  // Take a space between two marks.
  void take_space(uint32_t duration_us);
  // The 32 bits of the last frame.
  uint32_t frame() const { return frame_; }

 private:
  static const uint8_t NO_FRAME = 255;

  void restart();
  bool about(uint32_t duration_us, uint8_t units) const;

  uint16_t unit_us_;
  bool in_header_ = false;
  uint8_t bits_left_ = NO_FRAME;
  uint32_t bits_ = 0;
  uint32_t frame_ = 0;
};

// Turn a receiver's edges into frames; leave out the echo of the car's own frames. The receiver's output is low while
// there is carrier. An interrupt only times the edges.
class InfraredReceiver {
 public:
  explicit InfraredReceiver(uint16_t unit_us) : decoder_(unit_us), free_after_us_(9UL * unit_us) {}

  // Store an edge to `level`; called by an interrupt.
  void take_edge(uint32_t at_us, bool level) {
    times_us_[written_ & (EDGES - 1)] = (at_us & ~1UL) | (level ? 1 : 0);
    written_++;
  }
  // Take edges up to `sent_until_us`, when the car's own frame ends, and shortly after as its echo.
  void ignore_until(uint32_t sent_until_us);
  // Take the edges that came by `now_us` up to the end of a frame; return whether there was one.
  bool next_frame(uint32_t now_us, uint32_t &frame);
  // Whether a frame is on the air: there is carrier, or a space no longer than those within a frame.
  bool senses_carrier(uint32_t now_us);

 private:
  // The edges of 15 ms at least, a power of two.
  static const uint8_t EDGES = 32;

  FrameDecoder decoder_;
  uint32_t free_after_us_;
  volatile uint32_t times_us_[EDGES];
  volatile uint8_t written_ = 0;
  uint8_t read_ = 0;
  uint32_t last_us_ = 0;
  uint32_t echo_until_us_ = 0;
  bool has_echo_ = false;
  bool level_ = true;
  bool free_ = true;
};

// The length of a frame of `bits` in units.
inline uint16_t frame_units(uint32_t frame) {
  uint16_t units = 16 + 8 + 32 * 2 + 1;
  for (; frame; frame &= frame - 1) units += 2;
  return units;
}

}  // namespace motorcade

#endif
