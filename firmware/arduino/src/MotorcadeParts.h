// The parts of a car on any Arduino core: motors, an ultrasonic sensor and a voice module.
#ifndef MOTORCADE_PARTS_H
#define MOTORCADE_PARTS_H

#include <stdint.h>

#include "MotorcadeSettings.h"

namespace motorcade {

// Two motors behind an L298-style driver.
class Wheels {
 public:
  explicit Wheels(const CarSettings &settings) : settings_(settings) {}
  void begin();
  // Arguments as of Board::set_wheels.
  void set(uint8_t direction, uint8_t speed_level);

 private:
  const CarSettings &settings_;
};

// An HC-SR04 that is read without waiting: an interrupt times the echo, and the last distance measured is the answer.
class Ultrasonic {
 public:
  Ultrasonic(uint8_t trigger, uint8_t echo, uint16_t range_mm) : trigger_(trigger), echo_(echo), range_mm_(range_mm) {}
  void begin();
  // Store an edge to `level`; called by an interrupt.
  void take_edge(uint32_t at_us, bool level);
  // Return the last distance to an obstacle; NOTHING_IN_SIGHT_MM where none was measured lately. Ping where that is due.
  uint32_t distance_mm();

 private:
  void ping(uint32_t now_ms);

  uint8_t trigger_;
  uint8_t echo_;
  uint16_t range_mm_;
  uint32_t rose_us_ = 0;
  bool is_rising_ = false;
  volatile uint16_t width_us_ = 0;
  bool has_pinged_ = false;
  bool has_answer_ = false;
  uint32_t pinged_ms_ = 0;
  uint32_t distance_mm_ = 1UL << 20;
};

// A module that recognises words by itself, such as one with an LD3320, and reports them over a serial line.
class VoicePatterns {
 public:
  VoicePatterns(const VoicePattern *patterns, uint8_t count) : patterns_(patterns), count_(count) {}
  // Take a byte that came; return what it completes: NO_VOICE, VOICE_STOP or VOICE_GO.
  uint8_t take(uint8_t byte);

 private:
  static const uint8_t LONGEST = 16;

  const VoicePattern *patterns_;
  uint8_t count_;
  uint8_t recent_[LONGEST];
  uint8_t recent_count_ = 0;
};

// Bytes of a slow serial line (8N1) from the edges at a pin, for chips whose only UART takes the uploads.
class EdgeSerial {
 public:
  explicit EdgeSerial(uint16_t baud) : bit_us_((1000000UL + baud / 2) / baud) {}
  // Take an edge to `level`; called by an interrupt.
  void take_edge(uint32_t at_us, bool level);
  // Return the next byte, -1 for none. Call it with interrupts off.
  int16_t read(uint32_t now_us);

 private:
  static const uint8_t BYTES = 8;

  void take_bits(uint8_t count, bool level);

  uint16_t bit_us_;
  uint32_t last_us_ = 0;
  bool level_ = true;
  // 0 between two bytes, else how many bits of a byte came, its start bit included.
  uint8_t bits_ = 0;
  uint8_t byte_ = 0;
  uint8_t bytes_[BYTES];
  uint8_t written_ = 0;
  uint8_t read_ = 0;
};

}  // namespace motorcade

#endif
