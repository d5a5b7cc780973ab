// A car on any Arduino core that has the library EEPROM; on another keep the image as OwnBoard does.
// Write your pins into car.h first. The car receives infrared; to send it, see MotorcadeArduino.h.
#include <EEPROM.h>
#include <Motorcade.h>
#include <MotorcadeEeprom.h>

#include "car.h"

// true: this car leads. false: it follows.
const bool LEADS = false;
// Another number for each car.
const uint32_t NUMBER = 1;

motorcade::EepromMemory memory;
motorcade::ArduinoBoard<CAR> board(LEADS, NUMBER, memory);
motorcade::Car car(board);

void setup() {
#if defined(ARDUINO_ARCH_ESP32) || defined(ARDUINO_ARCH_ESP8266) || defined(ARDUINO_ARCH_RP2040)
  // Their EEPROM is a part of the flash, of any size.
  EEPROM.begin(4096);
#endif
  board.begin(motorcade::MOST_WORDS);
  car.begin();
}

void loop() {
  car.tick();
  board.rest();
}
