#include "MotorcadeParts.h"

namespace motorcade {

namespace {

// All echoes of a ping have faded after this time, also where no obstacle is near.
const uint8_t PING_EVERY_MS = 60;
// An older distance is no longer true for a moving car.
const uint8_t STALE_MS = 3 * PING_EVERY_MS;
// Sound travels 343 m/s at 20 °C, there and back.
const uint16_t MM_PER_2000_US = 343;
// No sensor measures less; a shorter pulse is the ping itself, where trigger and echo are one wire.
const uint8_t SHORTEST_ECHO_US = 100;

}  // namespace

void EchoTimer::take_edge(uint32_t at_us, bool level) {
  if (level) {
    rose_us_ = at_us;
    is_rising_ = true;
  } else if (is_rising_) {
    is_rising_ = false;
    const uint32_t width_us = at_us - rose_us_;
    // The sensor holds the line for 38 ms where it finds nothing.
    if (width_us >= SHORTEST_ECHO_US) width_us_ = width_us > 0xFFFF ? 0xFFFF : width_us;
  }
}

uint32_t EchoTimer::distance_mm(uint32_t now_ms, uint16_t range_mm, bool &is_due) {
  const uint32_t waited_ms = now_ms - pinged_ms_;
  noInterrupts();
  const uint16_t width_us = width_us_;
  width_us_ = 0;
  interrupts();
  if (width_us) {
    const uint32_t distance_mm = static_cast<uint32_t>(width_us) * MM_PER_2000_US / 2000;
    distance_mm_ = distance_mm <= range_mm ? distance_mm : NOTHING_IN_SIGHT_MM;
    has_answer_ = true;
  }
  is_due = !has_pinged_ || waited_ms >= PING_EVERY_MS;
  if (is_due) {
    if (!has_answer_ || waited_ms >= STALE_MS) distance_mm_ = NOTHING_IN_SIGHT_MM;
    has_pinged_ = true;
    pinged_ms_ = now_ms;
    has_answer_ = false;
  }
  return distance_mm_;
}

uint8_t VoicePatterns::take(uint8_t byte) {
  if (recent_count_ == LONGEST) {
    for (uint8_t i = 1; i < LONGEST; i++) recent_[i - 1] = recent_[i];
    recent_count_--;
  }
  recent_[recent_count_++] = byte;
  for (uint8_t i = 0; i < count_; i++) {
    const VoicePattern &pattern = patterns_[i];
    if (pattern.length > recent_count_) continue;
    uint8_t same = 0;
    while (same < pattern.length &&
           recent_[recent_count_ - pattern.length + same] == static_cast<uint8_t>(pattern.bytes[same])) {
      same++;
    }
    if (same == pattern.length) {
      recent_count_ = 0;
      return pattern.voice;
    }
  }
  return NO_VOICE;
}

void EdgeSerial::take_edge(uint32_t at_us, bool level) {
  const uint32_t bits = (at_us - last_us_ + bit_us_ / 2) / bit_us_;
  // More than a byte's bits of one level are a pause or a break.
  take_bits(bits > 10 ? 10 : bits, level_);
  last_us_ = at_us;
  level_ = level;
}

int16_t EdgeSerial::read(uint32_t now_us) {
  // The last bits of a byte may be ones, which end without an edge.
  if (bits_ != 0 && level_ && now_us - last_us_ > 10UL * bit_us_) take_bits(10, true);
  if (read_ == written_) return -1;
  return bytes_[read_++ & (BYTES - 1)];
}

void EdgeSerial::take_bits(uint8_t count, bool level) {
  for (; count > 0; count--) {
    if (bits_ == 0) {
      if (!level) bits_ = 1;
    } else if (bits_ <= 8) {
      byte_ = byte_ >> 1 | (level ? 128 : 0);
      bits_++;
    } else {
      // A byte without its stop bit is noise.
      if (level && static_cast<uint8_t>(written_ - read_) < BYTES) bytes_[written_++ & (BYTES - 1)] = byte_;
      bits_ = 0;
    }
  }
}

}  // namespace motorcade
