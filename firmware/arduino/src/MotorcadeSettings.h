// What differs between cars: `motorcade arduino-library` writes a CarSettings into the sketch's car.h from a pin file,
// a profile and a voice map.
#ifndef MOTORCADE_SETTINGS_H
#define MOTORCADE_SETTINGS_H

#include <stdint.h>

namespace motorcade {

const uint8_t NO_PIN = 255;

// A motor behind an L298-style driver. Without `enable` the PWM is on the direction pins.
struct MotorPins {
  uint8_t forward;
  uint8_t backward;
  uint8_t enable;
};

// Bytes that a voice module sends, and the command that they mean.
struct VoicePattern {
  const char *bytes;
  uint8_t length;
  uint8_t voice;
};

struct CarSettings {
  // The profile's integers, in the order of motorcade/car/brain.py.
  uint32_t levels[25];
  uint32_t baud;
  uint16_t range_mm;
  MotorPins left_motor;
  MotorPins right_motor;
  // PWM for speed levels 0 to 3, straight on and turning on the spot.
  uint8_t drive_duties[4];
  uint8_t turn_duties[4];
  uint8_t leds[4];
  uint8_t trigger;
  uint8_t echo;
  // The pins of digital inputs.
  // Written by scripts/generate.py from motorcade.devices; don't edit.
  uint8_t pir[1];
  uint8_t floor[2];
  // End of the section.
  uint8_t infrared_receiver;
  uint8_t infrared_sender;
  uint8_t voice;
  uint16_t voice_baud;
  const VoicePattern *voice_patterns;
  uint8_t voice_pattern_count;
};

}  // namespace motorcade

#endif
