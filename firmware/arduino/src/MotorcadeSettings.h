// What differs between cars: `motorcade arduino-library` writes a CarSettings into the sketch's car.h from a pin file,
// a profile and a voice map.
#ifndef MOTORCADE_SETTINGS_H
#define MOTORCADE_SETTINGS_H

#include <stdint.h>

namespace motorcade {

const uint8_t NO_PIN = 255;

// A motor. An L298-style driver has `forward` and `backward`; without `enable` the PWM is on these two. Other drivers
// have one pin for the direction, whose level is `forward_level` while the motor turns forward, and `enable` for the PWM.
struct MotorPins {
  uint8_t forward;
  uint8_t backward;
  uint8_t enable;
  uint8_t direction;
  uint8_t forward_level;
};

// Bytes that a voice module sends, and the command that they mean.
struct VoicePattern {
  const char *bytes;
  uint8_t length;
  uint8_t voice;
};

// A constant of the compiler: what a car lacks takes no place in its program, and no pin's number takes RAM.
struct CarSettings {
  // The profile's 25 integers, in the order of motorcade/car/brain.py.
  const uint32_t *levels;
  uint32_t baud;
  uint16_t range_mm;
  MotorPins left_motor;
  MotorPins right_motor;
  MotorPins left_rear_motor;
  MotorPins right_rear_motor;
  // High while the motors' driver may drive.
  uint8_t standby;
  // PWM for speed levels 0 to 3, straight on and turning on the spot.
  uint8_t drive_duties[4];
  uint8_t turn_duties[4];
  // The share of its duty that each motor gets.
  uint8_t left_duty_percent;
  uint8_t right_duty_percent;
  uint8_t leds[4];
  // WS2812, which show the four LEDs by their colours.
  uint8_t pixels;
  uint8_t pixel_count;
  // Of an ultrasonic sensor with one wire both are the same.
  uint8_t trigger;
  uint8_t echo;
  // The pins of inputs; the level that counts as 1; 1 to 99% of the supply as the threshold of an analog input, else 0.
  // Written by scripts/generate.py from motorcade.devices; don't edit.
  uint8_t pir[1];
  uint8_t floor[2];
  uint8_t floor_dark;
  uint8_t floor_threshold;
  // End of the section.
  // Whoever holds it while the power comes on chooses a leader. Its level, and its threshold, as those of an input.
  uint8_t button;
  uint8_t button_pressed;
  uint8_t button_threshold;
  uint8_t infrared_receiver;
  uint8_t infrared_sender;
  uint8_t horn;
  uint8_t voice;
  uint16_t voice_baud;
  const VoicePattern *voice_patterns;
  uint8_t voice_pattern_count;
};

}  // namespace motorcade

#endif
