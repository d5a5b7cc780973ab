#include "MotorcadeArduino.h"

// Where a chip runs interrupts from RAM alone, its core marks them so.
#ifndef IRAM_ATTR
#define IRAM_ATTR
#endif

namespace motorcade {

namespace {

const uint8_t UNIT_US = 17;  // of levels

}  // namespace

ArduinoBoard *ArduinoBoard::the_board_ = nullptr;

namespace {

void begin_inputs(const uint8_t *pins, uint8_t count) {
  for (uint8_t place = 0; place < count; place++) {
    if (pins[place] != NO_PIN) pinMode(pins[place], INPUT);
  }
}

}  // namespace

ArduinoBoard::ArduinoBoard(const CarSettings &settings, bool is_leader, uint32_t number, ByteMemory &memory,
                           Stream *voice)
    : settings_(settings),
      receiver_(settings.levels[UNIT_US]),
      store_(memory),
      wheels_(settings),
      ultrasonic_(settings.trigger, settings.echo, settings.range_mm),
      patterns_(settings.voice_patterns, settings.voice_pattern_count),
      voice_(voice),
      number_(number),
      is_leader_(is_leader) {}

void ArduinoBoard::begin(uint16_t most_words) {
  the_board_ = this;
  wheels_.begin();
  for (uint8_t pin : settings_.leds) {
    if (pin == NO_PIN) continue;
    pinMode(pin, OUTPUT);
    digitalWrite(pin, LOW);
  }
  // Written by scripts/generate.py from motorcade.devices; don't edit.
  begin_inputs(settings_.pir, 1);
  begin_inputs(settings_.floor, 2);
  // End of the section.
  Serial.begin(settings_.baud);
  store_.begin(most_words);
  number_ = store_.number(number_);
  ultrasonic_.begin();
  if (settings_.echo != NO_PIN) {
    attachInterrupt(digitalPinToInterrupt(settings_.echo), take_echo_edge, CHANGE);
  }
  if (settings_.infrared_receiver != NO_PIN) {
    pinMode(settings_.infrared_receiver, INPUT_PULLUP);
    attachInterrupt(digitalPinToInterrupt(settings_.infrared_receiver), take_infrared_edge, CHANGE);
  }
}

uint8_t ArduinoBoard::read_inputs(const uint8_t *pins, uint8_t count) {
  uint8_t bits = 0;
  for (uint8_t place = 0; place < count; place++) {
    if (pins[place] != NO_PIN && digitalRead(pins[place]) == HIGH) bits |= 1 << place;
  }
  return bits;
}

uint16_t ArduinoBoard::read_serial(uint8_t *data, uint16_t most) {
  uint16_t count = 0;
  while (count < most && Serial.available() > 0) data[count++] = Serial.read();
  return count;
}

bool ArduinoBoard::senses_carrier() {
  // Nobody fetches the frames that a leader receives; it only waits until the air is free.
  uint32_t frame;
  while (is_leader_ && next_frame(frame)) {
  }
  return receiver_.senses_carrier(micros());
}

uint8_t ArduinoBoard::heard_voice() {
  uint8_t latest = NO_VOICE;
  for (int16_t byte = read_voice(); byte >= 0; byte = read_voice()) {
    const uint8_t voice = patterns_.take(byte);
    // Where both words were heard, the car stops.
    if (voice != NO_VOICE && latest != VOICE_STOP) latest = voice;
  }
  return latest;
}

void ArduinoBoard::set_led(uint8_t which) {
  for (uint8_t led = 0; led < 4; led++) {
    if (settings_.leds[led] != NO_PIN) digitalWrite(settings_.leds[led], led == which ? HIGH : LOW);
  }
}

void ArduinoBoard::begin_echo(uint32_t frame) {
  receiver_.ignore_until(micros() + static_cast<uint32_t>(frame_units(frame)) * settings_.levels[UNIT_US]);
}

void IRAM_ATTR ArduinoBoard::take_infrared_edge() {
  the_board_->receiver_.take_edge(micros(), digitalRead(the_board_->settings_.infrared_receiver) == HIGH);
}

void IRAM_ATTR ArduinoBoard::take_echo_edge() {
  the_board_->ultrasonic_.take_edge(micros(), digitalRead(the_board_->settings_.echo) == HIGH);
}

}  // namespace motorcade
