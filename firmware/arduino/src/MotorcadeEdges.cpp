#include "MotorcadeEdges.h"

#include <Arduino.h>

namespace motorcade {

namespace {

InfraredReceiver *the_receiver = nullptr;
EchoTimer *the_timer = nullptr;

}  // namespace

#if defined(__AVR_ATmega328P__) || defined(__AVR_ATmega328__)

namespace {

// A pin whose edges are watched.
struct WatchedPin {
  volatile uint8_t *port;
  uint8_t mask;
  uint8_t level;

  void begin(uint8_t pin) {
    port = portInputRegister(digitalPinToPort(pin));
    mask = digitalPinToBitMask(pin);
    level = *port & mask;
    *digitalPinToPCMSK(pin) |= _BV(digitalPinToPCMSKbit(pin));
    PCICR |= _BV(digitalPinToPCICRbit(pin));
  }

  // Return whether it has another level than before.
  bool has_changed() {
    const uint8_t before = level;
    level = *port & mask;
    return level != before;
  }
};

WatchedPin receiver_pin;
WatchedPin echo_pin;
WatchedPin voice_pin;
EdgeSerial *the_line = nullptr;

}  // namespace

// The chip tells in which group of eight pins one has changed, but not which.
ISR(PCINT0_vect) {
  const uint32_t now_us = micros();
  if (the_receiver && receiver_pin.has_changed()) the_receiver->take_edge(now_us, receiver_pin.level);
  if (the_timer && echo_pin.has_changed()) the_timer->take_edge(now_us, echo_pin.level);
  if (the_line && voice_pin.has_changed()) the_line->take_edge(now_us, voice_pin.level);
}
ISR(PCINT1_vect, ISR_ALIASOF(PCINT0_vect));
ISR(PCINT2_vect, ISR_ALIASOF(PCINT0_vect));

void watch_receiver(uint8_t pin, InfraredReceiver &receiver) {
  the_receiver = &receiver;
  receiver_pin.begin(pin);
}

void watch_echo(uint8_t pin, EchoTimer &timer) {
  the_timer = &timer;
  echo_pin.begin(pin);
}

void watch_voice(uint8_t pin, EdgeSerial &line) {
  the_line = &line;
  voice_pin.begin(pin);
}

#else

// Where a chip runs interrupts from RAM alone, its core marks them so.
#ifndef IRAM_ATTR
#define IRAM_ATTR
#endif

namespace {

uint8_t receiver_pin;
uint8_t echo_pin;

void IRAM_ATTR take_receiver_edge() { the_receiver->take_edge(micros(), digitalRead(receiver_pin) == HIGH); }

void IRAM_ATTR take_echo_edge() { the_timer->take_edge(micros(), digitalRead(echo_pin) == HIGH); }

}  // namespace

void watch_receiver(uint8_t pin, InfraredReceiver &receiver) {
  the_receiver = &receiver;
  receiver_pin = pin;
  attachInterrupt(digitalPinToInterrupt(pin), take_receiver_edge, CHANGE);
}

void watch_echo(uint8_t pin, EchoTimer &timer) {
  the_timer = &timer;
  echo_pin = pin;
  attachInterrupt(digitalPinToInterrupt(pin), take_echo_edge, CHANGE);
}

#endif

}  // namespace motorcade
