// A car on any Arduino core, by what each core has: millis, micros, digitalWrite, analogWrite, attachInterrupt, Serial.
//
// It receives infrared. To send it a chip needs a timer of its own: MotorcadeAvr.h has it for AVR chips; for another
// chip derive from ArduinoBoard and override send_frame and is_sending.
#ifndef MOTORCADE_ARDUINO_H
#define MOTORCADE_ARDUINO_H

#include <Arduino.h>

#include "MotorcadeBoard.h"
#include "MotorcadeEdges.h"
#include "MotorcadeInfrared.h"
#include "MotorcadeParts.h"
#include "MotorcadeSerial.h"
#include "MotorcadeSettings.h"

namespace motorcade {

// A board of which there is one; the interrupts belong to it. `CAR` is what its car.h says.
template <const CarSettings &CAR>
class ArduinoBoard : public Board {
 public:
  // `is_leader` counts where the car has no button; `number` where the memory holds none. `voice` is the line of a voice
  // module, or nothing.
  ArduinoBoard(bool is_leader, uint32_t number, ByteMemory &memory, Stream *voice = nullptr)
      : is_leader_(is_leader),
        receiver_(CAR.levels[UNIT_US]),
        store_(memory),
        patterns_(CAR.voice_patterns, CAR.voice_pattern_count),
        voice_(voice),
        number_(number) {}

  // Set up the pins and read the stored image; call it in setup(). `most_words` limits an image to what the RAM holds.
  virtual void begin(uint16_t most_words) {
    Wheels<CAR>::begin();
    // No loops, since a table that is indexed takes RAM.
    begin_output(CAR.leds[0]);
    begin_output(CAR.leds[1]);
    begin_output(CAR.leds[2]);
    begin_output(CAR.leds[3]);
    begin_output(CAR.horn);
    // Written by scripts/generate.py from motorcade.devices; don't edit.
    begin_input(CAR.pir[0], false);
    begin_input(CAR.floor[0], false);
    begin_input(CAR.floor[1], false);
    // End of the section.
    begin_input(CAR.button, CAR.button_pressed == LOW);
    // Whoever holds the button while the power comes on chooses a leader.
    if (CAR.button != NO_PIN) is_leader_ = read_input(CAR.button, CAR.button_pressed, CAR.button_threshold);
    Serial.begin(CAR.baud);
    store_.begin(most_words);
    number_ = store_.number(number_);
    if (CAR.trigger != NO_PIN) {
      ultrasonic_.begin();
      watch_echo(CAR.echo, ultrasonic_);
    }
    if (CAR.infrared_receiver != NO_PIN) {
      pinMode(CAR.infrared_receiver, INPUT_PULLUP);
      watch_receiver(CAR.infrared_receiver, receiver_);
    }
  }

  // Sleep until there may be something to do; called between two ticks.
  virtual void rest() {}

  uint32_t number() override { return number_; }
  bool is_leader() override { return is_leader_; }
  const uint32_t *levels() override { return CAR.levels; }
  uint32_t now_ms() override { return millis() & TICKS_MASK; }
  ImageStore &store() override { return store_; }
  uint16_t read_serial(uint8_t *data, uint16_t most) override {
    uint16_t count = 0;
    while (count < most && Serial.available() > 0) data[count++] = Serial.read();
    return count;
  }
  uint16_t serial_room() override { return serial_room_.of(Serial); }
  void write_serial(const uint8_t *data, uint16_t count) override { Serial.write(data, count); }
  bool next_frame(uint32_t &frame) override { return receiver_.next_frame(micros(), frame); }
  bool senses_carrier() override {
    // Nobody fetches the frames that a leader receives; it only waits until the air is free.
    uint32_t frame;
    while (is_leader_ && next_frame(frame)) {
    }
    return receiver_.senses_carrier(micros());
  }
  uint32_t obstacle_mm() override { return CAR.trigger == NO_PIN ? NOTHING_IN_SIGHT_MM : ultrasonic_.obstacle_mm(); }
  // Written by scripts/generate.py from motorcade.devices; don't edit.
  bool sees_person() override {
    return read_input(CAR.pir[0], HIGH, 0);
  }
  uint8_t dark_floor() override {
    return read_input(CAR.floor[0], CAR.floor_dark, CAR.floor_threshold) |
           read_input(CAR.floor[1], CAR.floor_dark, CAR.floor_threshold) << 1;
  }
  // End of the section.
  uint8_t heard_voice() override {
    uint8_t latest = NO_VOICE;
    if (CAR.voice_pattern_count == 0) return latest;
    for (int16_t byte = read_voice(); byte >= 0; byte = read_voice()) {
      const uint8_t voice = patterns_.take(byte);
      // Where both words were heard, the car stops.
      if (voice != NO_VOICE && latest != VOICE_STOP) latest = voice;
    }
    return latest;
  }
  void set_wheels(uint8_t direction, uint8_t speed_level) override { Wheels<CAR>::set(direction, speed_level); }
  void set_led(uint8_t which) override {
    set_output(CAR.leds[0], which == 0);
    set_output(CAR.leds[1], which == 1);
    set_output(CAR.leds[2], which == 2);
    set_output(CAR.leds[3], which == 3);
  }

 protected:
  static const uint8_t UNIT_US = 17;  // of levels

  bool is_leader_;

  // Return the next byte of the voice module, -1 for none.
  virtual int16_t read_voice() { return voice_ ? voice_->read() : -1; }
  // Note that this car sends a frame from now on, for so long.
  void begin_echo(uint32_t frame) {
    receiver_.ignore_until(micros() + static_cast<uint32_t>(frame_units(frame)) * CAR.levels[UNIT_US]);
  }

 private:
  InfraredReceiver receiver_;
  ImageStore store_;
  Ultrasonic<CAR> ultrasonic_;
  VoicePatterns patterns_;
  Stream *voice_;
  SerialRoom serial_room_;
  uint32_t number_;
};

}  // namespace motorcade

#endif
