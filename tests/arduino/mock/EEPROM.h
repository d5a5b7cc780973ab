// A mock of Arduino's library EEPROM, as cores have it whose EEPROM is a part of the flash.
#ifndef MOCK_EEPROM_H
#define MOCK_EEPROM_H

#include <stdint.h>

struct EEPROMClass {
  void begin(unsigned) {}
  uint16_t length() { return sizeof(bytes_); }
  uint8_t read(int at) { return bytes_[at]; }
  void write(int at, uint8_t byte) { bytes_[at] = byte; }
  bool commit() { return true; }

 private:
  uint8_t bytes_[4096];
};

extern EEPROMClass EEPROM;

#endif
