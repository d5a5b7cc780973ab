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

// The pin of OC2B, timer 2's other output; each other pin is taken for OC2A (D11, Mega D10).
#ifdef UBRR1H
const uint8_t OTHER_OUTPUT = 9;
#else
const uint8_t OTHER_OUTPUT = 3;
#endif

// The frame on the air: its bits that are still to come, which of its parts is on, and a unit in ticks of timer 1.
volatile uint32_t frame_bits;
volatile uint8_t frame_part = PARTS;
uint16_t unit_ticks;
// The bit that lets the timer toggle the output, and the output's place.
uint8_t toggles;
volatile uint8_t *carrier_port;
uint8_t carrier_mask;

void begin_carrier() {
  // Clear the output's latch, so that each mark begins with a pulse.
  TCCR2A = _BV(WGM21) | toggles << 1;
  TCCR2B = _BV(FOC2A) | _BV(FOC2B);
  TCNT2 = CARRIER_TOP - 1;
  TCCR2A = _BV(WGM21) | toggles;
  TCCR2B = _BV(CS20);
}

void end_carrier() {
  TCCR2A = _BV(WGM21);
  TCCR2B = 0;
  *carrier_port &= ~carrier_mask;
}

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

void AvrSender::begin(uint8_t pin, uint16_t unit_us) {
  pinMode(pin, OUTPUT);
  carrier_port = portOutputRegister(digitalPinToPort(pin));
  carrier_mask = digitalPinToBitMask(pin);
  toggles = pin == OTHER_OUTPUT ? _BV(COM2B0) : _BV(COM2A0);
  unit_ticks = unit_us * TICKS_PER_US;
  end_carrier();
  OCR2A = CARRIER_TOP;
  // Its output toggles once a round, too.
  OCR2B = CARRIER_TOP;
  TCCR1A = 0;
  TCCR1B = _BV(CS11);
}

bool AvrSender::is_sending() { return frame_part != PARTS; }

void AvrSender::send(uint32_t frame) {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    frame_bits = frame;
    frame_part = 0;
    begin_carrier();
    OCR1A = TCNT1 + HEADER_MARK_UNITS * unit_ticks;
    TIFR1 = _BV(OCF1A);
    TIMSK1 |= _BV(OCIE1A);
  }
}

namespace {

// Green, red and blue of LEDs 0 to 3, yellow, blue, green and pink; and of none.
const uint8_t COLOURS[5][3] PROGMEM = {{24, 32, 0}, {0, 0, 40}, {32, 0, 0}, {0, 32, 12}, {0, 0, 0}};
// In steps of timer 0, 4 µs: after a longer pause the pixels may have taken what came for all there is.
const uint8_t LONGEST_PAUSE = 2;

// Send a byte to WS2812 at 16 MHz, the highest bit first: a 0 is high for 5 cycles, a 1 for 11.
inline void send_byte(volatile uint8_t *port, uint8_t high, uint8_t low, uint8_t byte) {
  uint8_t bits = 8;
  asm volatile(
      "1: st %a[port], %[high]\n"
      "   nop\n"
      "   nop\n"
      "   sbrs %[byte], 7\n"
      "   st %a[port], %[low]\n"
      "   lsl %[byte]\n"
      "   nop\n"
      "   nop\n"
      "   nop\n"
      "   nop\n"
      "   st %a[port], %[low]\n"
      "   nop\n"
      "   dec %[bits]\n"
      "   brne 1b\n"
      : [byte] "+r"(byte), [bits] "+r"(bits)
      : [port] "e"(port), [high] "r"(high), [low] "r"(low));
}

}  // namespace

void show_pixels(uint8_t pin, uint8_t count, uint8_t which) {
  volatile uint8_t *port = portOutputRegister(digitalPinToPort(pin));
  const uint8_t mask = digitalPinToBitMask(pin);
  const uint8_t green = pgm_read_byte(&COLOURS[which][0]);
  const uint8_t red = pgm_read_byte(&COLOURS[which][1]);
  const uint8_t blue = pgm_read_byte(&COLOURS[which][2]);
  pinMode(pin, OUTPUT);
  uint8_t ended = TCNT0;
  for (uint8_t left = count; left > 0; left--) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
      // Interrupts have their turn between two pixels. Where they took long, all pixels are sent again: those that have
      // the colour pass on what is too much.
      if (static_cast<uint8_t>(TCNT0 - ended) > LONGEST_PAUSE) left = count;
      const uint8_t low = *port & ~mask;
      const uint8_t high = low | mask;
      send_byte(port, high, low, green);
      send_byte(port, high, low, red);
      send_byte(port, high, low, blue);
      ended = TCNT0;
    }
  }
}

namespace {

// What a leader writes into RAM, which keeps it over a reset, and loses some of it when the power is off for a while.
const uint8_t LEADER_MARKS = 8;
uint8_t leader_marks[LEADER_MARKS] __attribute__((section(".noinit")));

}  // namespace

bool stays_leader(bool is_held) {
  bool was_leader = true;
  for (uint8_t i = 0; i < LEADER_MARKS; i++) {
    const uint8_t mark = 0x5A ^ i * 11;
    if (leader_marks[i] != mark) was_leader = false;
    if (is_held) leader_marks[i] = mark;
  }
  return is_held || was_leader;
}

void start_watchdog() { wdt_enable(WDTO_500MS); }

void sleep_for_a_tick() {
  wdt_reset();
  set_sleep_mode(SLEEP_MODE_IDLE);
  // Edges and bytes wake the chip, too; the brain needs no more than one tick a millisecond.
  const uint8_t now_ms = millis();
  do {
    sleep_mode();
  } while (static_cast<uint8_t>(millis()) == now_ms);
}

#ifndef UBRR1H
int16_t next_byte(EdgeSerial &line) {
  int16_t byte = -1;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { byte = line.read(micros()); }
  return byte;
}
#endif

}  // namespace motorcade

// After a reset by the watchdog it goes on counting, 16 ms at a time, until a program stops it.
extern "C" void motorcade_stop_watchdog(void) __attribute__((naked, used, section(".init3")));
void motorcade_stop_watchdog(void) {
  MCUSR = 0;
  wdt_disable();
}

#endif
