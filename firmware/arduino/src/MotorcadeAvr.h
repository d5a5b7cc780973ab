// A car on an Arduino Uno, Nano (ATmega328P) or Mega 2560: infrared out by timers 1 and 2, the EEPROM without waiting,
// the hardware watchdog.
//
// The sketch must not use these timers: no Servo, no tone(), no analogWrite at pins 3, 9, 10, 11 (Mega: 9, 10, 11, 12).
// On an Uno or Nano it must not use SoftwareSerial either, which needs the same interrupts as receiver and echo.
#ifndef MOTORCADE_AVR_H
#define MOTORCADE_AVR_H

#if defined(__AVR_ATmega328P__) || defined(__AVR_ATmega328__) || defined(__AVR_ATmega2560__) || \
    defined(__AVR_ATmega1280__)
#define MOTORCADE_HAS_AVR_BOARD 1

#include "MotorcadeArduino.h"

namespace motorcade {

// The chip's EEPROM. A byte takes 3.4 ms, or 1.8 ms where it need not be erased or not be written.
class AvrEeprom : public ByteMemory {
 public:
  uint16_t size() override;
  uint8_t read(uint16_t at) override;
  uint32_t read_u32(uint16_t at) override;
  void write(uint16_t at, uint8_t byte) override;
  bool is_ready() override;
};

// The carrier of infrared at a pin that is an output of timer 2, and the frame on the air.
class AvrSender {
 public:
  // `unit_us` is that of marks and spaces.
  static void begin(uint8_t pin, uint16_t unit_us);
  static bool is_sending();
  // Begin to send.
  static void send(uint32_t frame);
};

// Show LED `which` of 0 to 3, or none for 4, as a colour of the `count` WS2812 at `pin`.
void show_pixels(uint8_t pin, uint8_t count, uint8_t which);
#ifndef UBRR1H
// Return the next byte of a voice module, -1 for none.
int16_t next_byte(EdgeSerial &line);
#endif
// Return whether a car whose button is held or not leads: a leader stays one until the power is off, also where its port
// is opened, which resets the chip, or the watchdog does.
bool stays_leader(bool is_held);
// Start the watchdog, feed it, and sleep until the next millisecond.
void start_watchdog();
void sleep_for_a_tick();

template <const CarSettings &CAR>
class AvrBoard : public ArduinoBoard<CAR> {
 public:
  // `is_leader` counts where the car has no button, `number` where the EEPROM holds none.
#ifdef UBRR1H
  AvrBoard(bool is_leader, uint32_t number)
      : ArduinoBoard<CAR>(is_leader, number, eeprom_, CAR.voice == NO_PIN ? nullptr : &Serial1) {}
#else
  AvrBoard(bool is_leader, uint32_t number) : ArduinoBoard<CAR>(is_leader, number, eeprom_) {}
#endif

  // Set up everything and start the watchdog: from then on `rest` must be called twice a second at least.
  void begin(uint16_t most_words) override {
    ArduinoBoard<CAR>::begin(most_words);
    if (CAR.infrared_sender != NO_PIN) AvrSender::begin(CAR.infrared_sender, CAR.levels[ArduinoBoard<CAR>::UNIT_US]);
    if (CAR.voice != NO_PIN) begin_voice();
    if (CAR.button != NO_PIN) {
      this->is_leader_ = stays_leader(this->is_leader_);
      // Until its program lights one: LED 0 for a leader, 1 for a follower.
      set_led(this->is_leader() ? 0 : 1);
    }
    start_watchdog();
  }
  void rest() override { sleep_for_a_tick(); }
  bool is_sending() override { return CAR.infrared_sender != NO_PIN && AvrSender::is_sending(); }
  void send_frame(uint32_t frame) override {
    if (CAR.infrared_sender == NO_PIN) return;
    this->begin_echo(frame);
    AvrSender::send(frame);
  }
  void set_led(uint8_t which) override {
    ArduinoBoard<CAR>::set_led(which);
    if (CAR.pixels != NO_PIN) show_pixels(CAR.pixels, CAR.pixel_count, which);
  }

#ifdef UBRR1H
 private:
  void begin_voice() { Serial1.begin(CAR.voice_baud); }
#else
 protected:
  int16_t read_voice() override { return CAR.voice == NO_PIN ? -1 : next_byte(voice_line()); }

 private:
  // Made when it is first asked for, by cars that have it.
  static EdgeSerial &voice_line() {
    static EdgeSerial line(CAR.voice_baud);
    return line;
  }
  void begin_voice() {
    pinMode(CAR.voice, INPUT_PULLUP);
    watch_voice(CAR.voice, voice_line());
  }
#endif

  AvrEeprom eeprom_;
};

}  // namespace motorcade

#endif
#endif
