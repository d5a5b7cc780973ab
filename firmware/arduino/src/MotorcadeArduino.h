// A car on any Arduino core, by what each core has: millis, micros, digitalWrite, analogWrite, attachInterrupt, Serial.
//
// It receives infrared. To send it a chip needs a timer of its own: MotorcadeAvr.h has it for AVR chips; for another
// chip derive from ArduinoBoard and override send_frame and is_sending.
#ifndef MOTORCADE_ARDUINO_H
#define MOTORCADE_ARDUINO_H

#include <Arduino.h>

#include "MotorcadeBoard.h"
#include "MotorcadeInfrared.h"
#include "MotorcadeParts.h"
#include "MotorcadeSerial.h"
#include "MotorcadeSettings.h"

namespace motorcade {

// A board of which there is one; the interrupts belong to it.
class ArduinoBoard : public Board {
 public:
  // `number` counts where the memory holds none; `voice` is the line of a voice module, or nothing.
  ArduinoBoard(const CarSettings &settings, bool is_leader, uint32_t number, ByteMemory &memory,
               Stream *voice = nullptr);
  // Set up the pins and read the stored image; call it in setup(). `most_words` limits an image to what the RAM holds.
  virtual void begin(uint16_t most_words);
  // Sleep until there may be something to do; called between two ticks.
  virtual void rest() {}

  uint32_t number() override { return number_; }
  bool is_leader() override { return is_leader_; }
  const uint32_t *levels() override { return settings_.levels; }
  uint32_t now_ms() override { return millis() & TICKS_MASK; }
  ImageStore &store() override { return store_; }
  uint16_t read_serial(uint8_t *data, uint16_t most) override;
  uint16_t serial_room() override { return serial_room_.of(Serial); }
  void write_serial(const uint8_t *data, uint16_t count) override { Serial.write(data, count); }
  bool next_frame(uint32_t &frame) override { return receiver_.next_frame(micros(), frame); }
  bool senses_carrier() override;
  uint32_t obstacle_mm() override { return ultrasonic_.distance_mm(); }
  // Written by scripts/generate.py from motorcade.devices; don't edit.
  bool sees_person() override { return read_inputs(settings_.pir, 1); }
  uint8_t dark_floor() override { return read_inputs(settings_.floor, 2); }
  // End of the section.
  uint8_t heard_voice() override;
  void set_wheels(uint8_t direction, uint8_t speed_level) override { wheels_.set(direction, speed_level); }
  void set_led(uint8_t which) override;

 protected:
  // Return the next byte of the voice module, -1 for none.
  virtual int16_t read_voice() { return voice_ ? voice_->read() : -1; }
  // Return which of `count` digital inputs are high, as bits, the first one the lowest; an input without a pin is low.
  static uint8_t read_inputs(const uint8_t *pins, uint8_t count);
  // Note that this car sends a frame from now on, for so long.
  void begin_echo(uint32_t frame);

  const CarSettings &settings_;
  InfraredReceiver receiver_;

 private:
  static void take_infrared_edge();
  static void take_echo_edge();

  static ArduinoBoard *the_board_;

  ImageStore store_;
  Wheels wheels_;
  Ultrasonic ultrasonic_;
  VoicePatterns patterns_;
  Stream *voice_;
  SerialRoom serial_room_;
  uint32_t number_;
  bool is_leader_;
};

}  // namespace motorcade

#endif
