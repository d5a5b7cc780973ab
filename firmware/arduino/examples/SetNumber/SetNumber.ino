// Write a car's number into its EEPROM, once. Then upload the car's own sketch: the number stays.
#include <Motorcade.h>

#ifndef MOTORCADE_HAS_AVR_BOARD
#error "this example is for an Uno, a Nano or a Mega"
#endif

const uint32_t NUMBER = 1;

void setup() {
  motorcade::AvrEeprom eeprom;
  motorcade::ImageStore store(eeprom);
  store.set_number(NUMBER);
  pinMode(LED_BUILTIN, OUTPUT);
}

void loop() {
  // Slowly: the number is written.
  digitalWrite(LED_BUILTIN, millis() / 1000 % 2 ? HIGH : LOW);
}
