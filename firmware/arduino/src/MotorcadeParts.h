// The parts of a car on any Arduino core: motors, lamps, inputs, an ultrasonic sensor and a voice module.
#ifndef MOTORCADE_PARTS_H
#define MOTORCADE_PARTS_H

#include <Arduino.h>
#include <stdint.h>

#include "MotorcadeBoard.h"
#include "MotorcadeSettings.h"

namespace motorcade {

// What analogRead gives for a pin at the supply's voltage.
#ifdef ARDUINO_ARCH_ESP32
const uint16_t ANALOG_MOST = 4095;
#else
const uint16_t ANALOG_MOST = 1023;
#endif

inline void begin_output(uint8_t pin, uint8_t level = LOW) {
  if (pin == NO_PIN) return;
  pinMode(pin, OUTPUT);
  digitalWrite(pin, level);
}

inline void set_output(uint8_t pin, bool is_high) {
  if (pin != NO_PIN) digitalWrite(pin, is_high ? HIGH : LOW);
}

// The motors of a car: one on each side, or two.
template <const CarSettings &CAR>
class Wheels {
 public:
  static void begin() {
    begin_motor(CAR.left_motor);
    begin_motor(CAR.right_motor);
    begin_motor(CAR.left_rear_motor);
    begin_motor(CAR.right_rear_motor);
    begin_output(CAR.standby, HIGH);
  }

  // Arguments as of Board::set_wheels.
  static void set(uint8_t direction, uint8_t speed_level) {
    const int16_t duty = duty_of(direction != FORWARD, speed_level);
    const int16_t left = shared(direction == LEFT ? -duty : duty, CAR.left_duty_percent);
    const int16_t right = shared(direction == RIGHT ? -duty : duty, CAR.right_duty_percent);
    drive_motor(CAR.left_motor, left);
    drive_motor(CAR.right_motor, right);
    drive_motor(CAR.left_rear_motor, left);
    drive_motor(CAR.right_rear_motor, right);
  }

 private:
  static const uint8_t FORWARD = 0;
  static const uint8_t LEFT = 1;
  static const uint8_t RIGHT = 2;

  // Constants alone, so that no table takes RAM.
  static uint8_t duty_of(bool turns, uint8_t speed_level) {
    switch (speed_level) {
      case 1: return turns ? CAR.turn_duties[1] : CAR.drive_duties[1];
      case 2: return turns ? CAR.turn_duties[2] : CAR.drive_duties[2];
      case 3: return turns ? CAR.turn_duties[3] : CAR.drive_duties[3];
      default: return 0;
    }
  }

  static inline __attribute__((always_inline)) int16_t shared(int16_t duty, uint8_t percent) {
    return percent == 100 ? duty : duty * percent / 100;
  }

  static inline __attribute__((always_inline)) void begin_motor(const MotorPins pins) {
    begin_output(pins.forward);
    begin_output(pins.backward);
    begin_output(pins.direction);
    begin_output(pins.enable);
  }

  // Turn forward with `duty` 1 to 255 of full power, backward with -1 to -255; with 0 the motor coasts.
  static inline __attribute__((always_inline)) void drive_motor(const MotorPins pins, int16_t duty) {
    const uint8_t share = duty < 0 ? -duty : duty;
    if (pins.direction != NO_PIN) {
      // No power while the direction changes.
      analogWrite(pins.enable, 0);
      digitalWrite(pins.direction, (duty < 0) == (pins.forward_level == LOW) ? HIGH : LOW);
      analogWrite(pins.enable, share);
    } else if (pins.forward == NO_PIN) {
      return;
    } else if (pins.enable == NO_PIN) {
      analogWrite(pins.forward, duty > 0 ? share : 0);
      analogWrite(pins.backward, duty < 0 ? share : 0);
    } else {
      // Never both at once, and no power while they change.
      analogWrite(pins.enable, 0);
      digitalWrite(pins.forward, LOW);
      digitalWrite(pins.backward, LOW);
      if (duty > 0) digitalWrite(pins.forward, HIGH);
      if (duty < 0) digitalWrite(pins.backward, HIGH);
      analogWrite(pins.enable, share);
    }
  }
};

// Begin an input; a button that is pressed while its pin is low needs the pull-up.
inline void begin_input(uint8_t pin, bool pulled_up) {
  if (pin != NO_PIN) pinMode(pin, pulled_up ? INPUT_PULLUP : INPUT);
}

// Return 1 where an input has `level`, or where its voltage is on that side of so many percent of the supply; an input
// without a pin gives 0.
inline uint8_t read_input(uint8_t pin, uint8_t level, uint8_t threshold_percent) {
  if (pin == NO_PIN) return 0;
  const bool is_high = threshold_percent == 0 ? digitalRead(pin) == HIGH
                                              : analogRead(pin) > static_cast<int>(threshold_percent * ANALOG_MOST / 100);
  return is_high == (level == HIGH);
}

// Times the echo of an ultrasonic sensor.
class EchoTimer {
 public:
  // Store an edge to `level`; called by an interrupt.
  void take_edge(uint32_t at_us, bool level);
  // Return the last distance to an obstacle; NOTHING_IN_SIGHT_MM where none was measured lately, or beyond `range_mm`.
  // `is_due` tells whether to ping now.
  uint32_t distance_mm(uint32_t now_ms, uint16_t range_mm, bool &is_due);

 private:
  uint32_t rose_us_ = 0;
  bool is_rising_ = false;
  volatile uint16_t width_us_ = 0;
  bool has_pinged_ = false;
  bool has_answer_ = false;
  uint32_t pinged_ms_ = 0;
  uint32_t distance_mm_ = NOTHING_IN_SIGHT_MM;
};

// An ultrasonic sensor such as an HC-SR04 that is read without waiting: an interrupt times the echo, and the last
// distance measured is the answer.
template <const CarSettings &CAR>
class Ultrasonic : public EchoTimer {
 public:
  static void begin() {
    begin_output(CAR.trigger);
    pinMode(CAR.echo, INPUT);
  }

  // Return the last distance, and ping where that is due.
  uint32_t obstacle_mm() {
    bool is_due;
    const uint32_t distance_mm = EchoTimer::distance_mm(millis(), CAR.range_mm, is_due);
    if (is_due) ping();
    return distance_mm;
  }

 private:
  static void ping() {
    const bool has_one_wire = CAR.trigger == CAR.echo;
    if (has_one_wire) pinMode(CAR.trigger, OUTPUT);
    digitalWrite(CAR.trigger, HIGH);
    delayMicroseconds(10);
    digitalWrite(CAR.trigger, LOW);
    if (has_one_wire) pinMode(CAR.echo, INPUT);
  }
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
