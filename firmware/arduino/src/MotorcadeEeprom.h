// The EEPROM of any Arduino core that has the library EEPROM. Include it in the sketch after <EEPROM.h>.
#ifndef MOTORCADE_EEPROM_H
#define MOTORCADE_EEPROM_H

#include <EEPROM.h>

#include "MotorcadeStore.h"

namespace motorcade {

// Cores whose EEPROM is a part of the flash keep what is written in RAM until `commit`.
class EepromMemory : public ByteMemory {
 public:
  uint16_t size() override { return EEPROM.length(); }
  uint8_t read(uint16_t at) override { return EEPROM.read(at); }
  void write(uint16_t at, uint8_t byte) override { EEPROM.write(at, byte); }
#if defined(ARDUINO_ARCH_ESP32) || defined(ARDUINO_ARCH_ESP8266) || defined(ARDUINO_ARCH_RP2040)
  void finish() override { EEPROM.commit(); }
#endif
};

}  // namespace motorcade

#endif
