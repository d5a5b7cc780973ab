#include "MotorcadeAvr.h"

#ifdef MOTORCADE_HAS_AVR_BOARD

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/atomic.h>

namespace motorcade {

namespace {

const uint16_t CARRIER_HZ = 38000;
const uint16_t CARRIER_TOP = F_CPU / 2 / CARRIER_HZ - 1;
static_assert(CARRIER_TOP <= 255, "timer 2 is too short for 38 kHz at this clock");
const uint8_t TICKS_PER_US = F_CPU / 8 / 1000000UL;
const uint8_t HEADER_MARK_UNITS = 16;
const uint8_t HEADER_SPACE_UNITS = 8;
// Marks and spaces of a frame.
const uint8_t PARTS = 67;
const uint8_t UNIT_US = 17;  // of levels

// OC2A, the output of timer 2.
#ifdef UBRR1H
const uint8_t CARRIER_PIN = 10;  // Mega
const uint8_t CARRIER_BIT = PB4;
#else
const uint8_t CARRIER_PIN = 11;  // Uno, Nano
const uint8_t CARRIER_BIT = PB3;
#endif

// The frame on the air: its bits that are still to come, which of its parts is on, and a unit in ticks of timer 1.
volatile uint32_t frame_bits;
volatile uint8_t frame_part = PARTS;
uint16_t unit_ticks;

void begin_carrier() {
  // Clear the output's latch, so that each mark begins with a pulse.
  TCCR2A = _BV(WGM21) | _BV(COM2A1);
  TCCR2B = _BV(FOC2A);
  TCNT2 = CARRIER_TOP - 1;
  TCCR2A = _BV(WGM21) | _BV(COM2A0);
  TCCR2B = _BV(CS20);
}

void end_carrier() {
  TCCR2A = _BV(WGM21);
  TCCR2B = 0;
  PORTB &= ~_BV(CARRIER_BIT);
}

#ifndef UBRR1H
EdgeSerial *edge_serial = nullptr;
uint8_t edge_serial_pin = NO_PIN;
#endif

}  // namespace

// A mark or a space is over.
ISR(TIMER1_COMPA_vect) {
  const uint8_t part = frame_part + 1;
  frame_part = part;
  if (part == PARTS) {
    end_carrier();
    TIMSK1 &= ~_BV(OCIE1A);
    return;
  }
  if (part % 2 == 0) {
    begin_carrier();
    OCR1A += unit_ticks;
    return;
  }
  end_carrier();
  if (part == 1) {
    OCR1A += HEADER_SPACE_UNITS * unit_ticks;
    return;
  }
  OCR1A += frame_bits >> 31 ? 3 * unit_ticks : unit_ticks;
  frame_bits <<= 1;
}

#ifndef UBRR1H
ISR(PCINT1_vect) { edge_serial->take_edge(micros(), digitalRead(edge_serial_pin) == HIGH); }
#endif

uint16_t AvrEeprom::size() { return E2END + 1; }

uint8_t AvrEeprom::read(uint16_t at) {
  while (EECR & _BV(EEPE)) {
  }
  EEAR = at;
  EECR |= _BV(EERE);
  return EEDR;
}

uint32_t AvrEeprom::read_u32(uint16_t at) {
  // The brain reads words; to put four bytes together by shifts would take several times as long.
  union {
    uint8_t bytes[4];
    uint32_t value;
  } word;
  while (EECR & _BV(EEPE)) {
  }
  for (uint8_t i = 4; i-- > 0; at++) {
    EEAR = at;
    EECR |= _BV(EERE);
    word.bytes[i] = EEDR;
  }
  return word.value;
}

void AvrEeprom::write(uint16_t at, uint8_t byte) {
  const uint8_t old = read(at);
  // Erasing sets all bits and writing clears bits. One of them alone takes half the time.
  uint8_t mode = 0;
  if (byte == 0xFF) {
    mode = _BV(EEPM0);
  } else if ((old & byte) == byte) {
    mode = _BV(EEPM1);
  }
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    EEAR = at;
    EEDR = byte;
    EECR = mode;
    EECR |= _BV(EEMPE);
    EECR |= _BV(EEPE);
  }
}

bool AvrEeprom::is_ready() { return !(EECR & _BV(EEPE)); }

#ifdef UBRR1H
AvrBoard::AvrBoard(const CarSettings &settings, bool is_leader, uint32_t number)
    : ArduinoBoard(settings, is_leader, number, eeprom_, settings.voice == NO_PIN ? nullptr : &Serial1) {}
#else
AvrBoard::AvrBoard(const CarSettings &settings, bool is_leader, uint32_t number) : ArduinoBoard(settings, is_leader, number, eeprom_) {}
#endif

void AvrBoard::begin(uint16_t most_words) {
  ArduinoBoard::begin(most_words);
  if (settings_.infrared_sender != NO_PIN) {
    pinMode(CARRIER_PIN, OUTPUT);
    digitalWrite(CARRIER_PIN, LOW);
    unit_ticks = settings_.levels[UNIT_US] * TICKS_PER_US;
    end_carrier();
    OCR2A = CARRIER_TOP;
    TCCR1A = 0;
    TCCR1B = _BV(CS11);
  }
  if (settings_.voice != NO_PIN) {
#ifdef UBRR1H
    Serial1.begin(settings_.voice_baud);
#else
    static EdgeSerial line(settings_.voice_baud);
    edge_serial = &line;
    edge_serial_pin = settings_.voice;
    pinMode(settings_.voice, INPUT_PULLUP);
    *digitalPinToPCMSK(settings_.voice) |= _BV(digitalPinToPCMSKbit(settings_.voice));
    PCICR |= _BV(PCIE1);
#endif
  }
  wdt_enable(WDTO_500MS);
}

void AvrBoard::rest() {
  wdt_reset();
  set_sleep_mode(SLEEP_MODE_IDLE);
  // Edges and bytes wake the chip, too; the brain needs no more than one tick a millisecond.
  const uint8_t now_ms = millis();
  do {
    sleep_mode();
  } while (static_cast<uint8_t>(millis()) == now_ms);
}

bool AvrBoard::is_sending() { return frame_part != PARTS; }

void AvrBoard::send_frame(uint32_t frame) {
  if (settings_.infrared_sender == NO_PIN) return;
  begin_echo(frame);
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    frame_bits = frame;
    frame_part = 0;
    begin_carrier();
    OCR1A = TCNT1 + HEADER_MARK_UNITS * unit_ticks;
    TIFR1 = _BV(OCF1A);
    TIMSK1 |= _BV(OCIE1A);
  }
}

int16_t AvrBoard::read_voice() {
#ifdef UBRR1H
  return ArduinoBoard::read_voice();
#else
  if (edge_serial == nullptr) return -1;
  int16_t byte = -1;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { byte = edge_serial->read(micros()); }
  return byte;
#endif
}

}  // namespace motorcade

// After a reset by the watchdog it goes on counting, 16 ms at a time, until a program stops it.
extern "C" void motorcade_stop_watchdog(void) __attribute__((naked, used, section(".init3")));
void motorcade_stop_watchdog(void) {
  MCUSR = 0;
  wdt_disable();
}

#endif
