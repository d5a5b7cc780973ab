// A car: wire it as docs/build-a-car.md shows, choose your board in the menu Tools, and upload this sketch once.
// After that it takes programs from Motorcade's studio, or from `motorcade upload`.
#include <Motorcade.h>

#include "car.h"

// false: the car follows, unless somebody holds its button while it is switched on; then it leads. true: it always leads.
const bool LEADS = false;
// Another number for each car, unless its EEPROM holds one (see the example SetNumber).
const uint32_t NUMBER = 1;

motorcade::AvrBoard board(CAR, LEADS, NUMBER);
motorcade::Car car(board);

void setup() {
  board.begin(motorcade::MOST_WORDS);
  car.begin();
}

void loop() {
  car.tick();
  board.rest();
}
