// A car: wire it as docs/build-a-car.md shows, choose your board in the menu Tools, and upload this sketch once.
// After that it takes programs from Motorcade's studio, or from `motorcade upload`.
#include <Motorcade.h>

#include "car.h"

// true: this car leads. false: it follows.
const bool LEADS = true;
// Another number for each car, unless its EEPROM holds one (see the example SetNumber).
const uint32_t NUMBER = 1;

motorcade::AvrBoard<CAR> board(LEADS, NUMBER);
motorcade::Car car(board);

void setup() {
  board.begin(motorcade::MOST_WORDS);
  car.begin();
}

void loop() {
  car.tick();
  board.rest();
}
