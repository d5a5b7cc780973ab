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

// OC2A, one of the two outputs of timer 2; the other is OC2B.
#ifdef UBRR1H
const uint8_t OUTPUT_A = 10;  // Mega
#else
const uint8_t OUTPUT_A = 11;  // Uno, Nano
#endif

// Where the carrier leaves: the pin's port and bit, and the bits of timer 2 that clear, toggle and force its output.
volatile uint8_t *carrier_port;
uint8_t carrier_bit;
uint8_t clear_output;
uint8_t toggle_output;
uint8_t force_output;

// A pin whose edges come by the interrupt of its port, which belongs to all pins of the port.
struct Listener {
  volatile uint8_t *input;
  uint8_t bit;
  uint8_t level;
  void (*take_edge)();
};

// The echo, the infrared receiver and the voice module.
const uint8_t MOST_LISTENERS = 3;
Listener listeners[MOST_LISTENERS];
uint8_t listener_count;

void take_port_edges() {
  for (uint8_t i = 0; i < listener_count; i++) {
    Listener &listener = listeners[i];
    const uint8_t level = *listener.input & listener.bit;
    if (level == listener.level) continue;
    listener.level = level;
    listener.take_edge();
  }
}

// RGB LEDs with a WS2812, as many as a car of a shop has; data for one that isn't there is lost.
const uint8_t PIXELS = 2;
// Green, red and blue of LED 0 to 3, which are yellow, blue, green and pink, and of none; dim enough for a dark room.
const uint8_t COLOURS[5][3] PROGMEM = {{28, 40, 0}, {0, 0, 48}, {40, 0, 0}, {6, 40, 20}, {0, 0, 0}};
// What a car with a button shows at power-on, for so long.
const uint8_t NO_LED = 4;
const uint8_t LEADER_LED = 0;
const uint8_t FOLLOWER_LED = 1;
const uint16_t ROLE_SHOWN_MS = 1000;

// Send a byte to WS2812s, its highest bit first, while interrupts are off. A bit takes 18 cycles, 1.1 us: its pin is
// high for 5 of them (0.31 us) where the bit is 0, and for 11 (0.69 us) where it is 1.
void send_to_pixels(volatile uint8_t *port, uint8_t high, uint8_t low, uint8_t byte) {
  static_assert(F_CPU == 16000000UL, "the pulses of WS2812 are counted in cycles of 16 MHz");
  uint8_t bits = 8;
  asm volatile(
      "1: st %a[port], %[high]\n\t"
      "   lsl %[byte]\n\t"
      "   brcs 2f\n\t"
      "   nop\n\t"
      "   st %a[port], %[low]\n\t"
      "   rjmp .+0\n\t"
      "   rjmp .+0\n\t"
      "   rjmp 3f\n\t"
      "2: rjmp .+0\n\t"
      "   rjmp .+0\n\t"
      "   rjmp .+0\n\t"
      "   st %a[port], %[low]\n\t"
      "3: rjmp .+0\n\t"
      "   dec %[bits]\n\t"
      "   brne 1b\n\t"
      : [byte] "+r"(byte), [bits] "+r"(bits)
      : [port] "e"(port), [high] "r"(high), [low] "r"(low));
}

// The frame on the air: its bits that are still to come, which of its parts is on, and a unit in ticks of timer 1.
volatile uint32_t frame_bits;
volatile uint8_t frame_part = PARTS;
uint16_t unit_ticks;

void begin_carrier() {
  // Clear the output's latch, so that each mark begins with a pulse.
  TCCR2A = _BV(WGM21) | clear_output;
  TCCR2B = force_output;
  TCNT2 = CARRIER_TOP - 1;
  TCCR2A = _BV(WGM21) | toggle_output;
  TCCR2B = _BV(CS20);
}

void end_carrier() {
  TCCR2A = _BV(WGM21);
  TCCR2B = 0;
  *carrier_port &= ~carrier_bit;
}

#ifndef UBRR1H
EdgeSerial *edge_serial = nullptr;
uint8_t edge_serial_pin = NO_PIN;

void take_voice_edge() { edge_serial->take_edge(micros(), digitalRead(edge_serial_pin) == HIGH); }
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

ISR(PCINT0_vect) { take_port_edges(); }
ISR(PCINT1_vect, ISR_ALIASOF(PCINT0_vect));
ISR(PCINT2_vect, ISR_ALIASOF(PCINT0_vect));

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
    const uint8_t pin = settings_.infrared_sender;
    const bool is_a = pin == OUTPUT_A;
    carrier_port = portOutputRegister(digitalPinToPort(pin));
    carrier_bit = digitalPinToBitMask(pin);
    clear_output = is_a ? _BV(COM2A1) : _BV(COM2B1);
    toggle_output = is_a ? _BV(COM2A0) : _BV(COM2B0);
    force_output = is_a ? _BV(FOC2A) : _BV(FOC2B);
    pinMode(pin, OUTPUT);
    digitalWrite(pin, LOW);
    unit_ticks = settings_.levels[UNIT_US] * TICKS_PER_US;
    end_carrier();
    OCR2A = CARRIER_TOP;
    OCR2B = CARRIER_TOP;
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
    listen(settings_.voice, take_voice_edge);
#endif
  }
  if (settings_.pixels != NO_PIN) {
    pinMode(settings_.pixels, OUTPUT);
    digitalWrite(settings_.pixels, LOW);
  }
  // A pixel's colour is unknown at power-on.
  shows_role_ = settings_.button != NO_PIN;
  if (!shows_role_) {
    light(NO_LED);
  } else {
    light(is_leader() ? LEADER_LED : FOLLOWER_LED);
  }
  wdt_enable(WDTO_500MS);
}

void AvrBoard::set_led(uint8_t which) {
  led_ = which;
  if (!shows_role_) light(which);
}

void AvrBoard::light(uint8_t which) {
  ArduinoBoard::set_led(which);
  if (settings_.pixels == NO_PIN || which == lit_) return;
  lit_ = which;
  volatile uint8_t *const port = portOutputRegister(digitalPinToPort(settings_.pixels));
  const uint8_t bit = digitalPinToBitMask(settings_.pixels);
  for (uint8_t pixel = 0; pixel < PIXELS; pixel++) {
    // An edge of infrared waits for one pixel at most, 30 us.
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
      const uint8_t high = *port | bit;
      const uint8_t low = high ^ bit;
      for (const uint8_t &colour : COLOURS[which]) send_to_pixels(port, high, low, pgm_read_byte(&colour));
    }
  }
}

void AvrBoard::listen(uint8_t pin, void (*take_edge)()) {
#ifdef UBRR1H
  // Most pins of a Mega have no interrupt of their port.
  if (digitalPinToInterrupt(pin) != NOT_AN_INTERRUPT) {
    ArduinoBoard::listen(pin, take_edge);
    return;
  }
#endif
  Listener &listener = listeners[listener_count];
  listener.input = portInputRegister(digitalPinToPort(pin));
  listener.bit = digitalPinToBitMask(pin);
  listener.level = *listener.input & listener.bit;
  listener.take_edge = take_edge;
  listener_count++;
  *digitalPinToPCMSK(pin) |= _BV(digitalPinToPCMSKbit(pin));
  PCICR |= _BV(digitalPinToPCICRbit(pin));
}

bool AvrBoard::is_held(uint8_t pin) {
  // A Nano's A6 and A7 have no digital input.
  if (pin >= NUM_DIGITAL_PINS) return analogRead(pin) < 512;
  return ArduinoBoard::is_held(pin);
}

void AvrBoard::rest() {
  wdt_reset();
  if (shows_role_ && millis() >= ROLE_SHOWN_MS) {
    shows_role_ = false;
    light(led_);
  }
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
