// A car on an Arduino Uno, Nano (ATmega328P) or Mega 2560: infrared out by timers 1 and 2, the EEPROM without waiting,
// the hardware watchdog.
//
// The sketch must not use these timers: no Servo, no tone(), no analogWrite at pins 3, 9, 10, 11 (Mega: 9, 10, 11, 12).
// On an Uno or Nano it must not use SoftwareSerial either, which needs the interrupt of the voice module's pin.
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

class AvrBoard : public ArduinoBoard {
 public:
  // `number` counts where the EEPROM holds none.
  AvrBoard(const CarSettings &settings, bool is_leader, uint32_t number);
  // Set up everything and start the watchdog: from then on `rest` must be called twice a second at least.
  void begin(uint16_t most_words) override;
  // Feed the watchdog, and sleep until the next millisecond.
  void rest() override;
  bool is_sending() override;
  void send_frame(uint32_t frame) override;

 protected:
  int16_t read_voice() override;

 private:
  AvrEeprom eeprom_;
};

}  // namespace motorcade

#endif
#endif
