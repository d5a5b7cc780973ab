// An mBot from Makeblock, as it comes out of its box: choose the board Uno in the menu Tools, and upload this sketch once.
// Hold the button while you switch the car on, and it leads (its lamps are yellow) until it has been off for some seconds;
// else it follows (blue).
// After that it takes programs from Motorcade's studio, or from `motorcade upload`.
#include <Motorcade.h>

#include "car.h"

// Another number for each car, unless its EEPROM holds one (see the example SetNumber).
const uint32_t NUMBER = 1;

motorcade::AvrBoard<CAR> board(false, NUMBER);
motorcade::Car car(board);

void setup() {
  board.begin(motorcade::MOST_WORDS);
  car.begin();
}

void loop() {
  car.tick();
  board.rest();
}
