// The contract of a board: all that a car needs from its hardware, as motorcade/car/board.py describes it.
//
// A board for new hardware derives from Board and overrides what the hardware has. A method that isn't overridden is a
// sensor that finds nothing, or an actuator that isn't there.
#ifndef MOTORCADE_BOARD_H
#define MOTORCADE_BOARD_H

#include <stdint.h>

#include "MotorcadeStore.h"

namespace motorcade {

const uint32_t NOTHING_IN_SIGHT_MM = 1UL << 20;
const uint32_t TICKS_MASK = (1UL << 30) - 1;

// What a microphone heard.
enum Voice : uint8_t { NO_VOICE = 0, VOICE_STOP = 1, VOICE_GO = 2 };

// What a board is told about: a state or a word begins, a word is over, a frame was heard or is sent, an image was stored.
enum NoteKind : uint8_t { NOTE_STATE = 0, NOTE_START = 1, NOTE_OVER = 2, NOTE_HEARD = 3, NOTE_FRAME = 4, NOTE_IMAGE = 5 };

class Board {
 public:
  // The car's own number; it seeds the car's random draws.
  virtual uint32_t number() { return 0; }
  // Whether the car leads or follows.
  virtual bool is_leader() { return false; }
  // The profile's integers, in the order of motorcade/car/brain.py.
  virtual const uint32_t *levels() = 0;
  // The clock's reading: milliseconds that wrap at 2^30.
  virtual uint32_t now_ms() = 0;
  // The memory that keeps the image while the car is off.
  virtual ImageStore &store() = 0;

  // Read at most `most` bytes that came over the serial line; return how many there were. Never wait.
  virtual uint16_t read_serial(uint8_t *data, uint16_t most) {
    (void)data;
    (void)most;
    return 0;
  }
  // How many bytes `write_serial` takes now without waiting; MotorcadeSerial.h asks any core.
  virtual uint16_t serial_room() { return 0; }
  // Send bytes over the serial line; at most `serial_room()` of them.
  virtual void write_serial(const uint8_t *data, uint16_t count) {
    (void)data;
    (void)count;
  }

  // Fetch the next 32-bit infrared frame that ended since the last call, parity unchecked; return whether there was one.
  virtual bool next_frame(uint32_t &frame) {
    (void)frame;
    return false;
  }
  // Whether other cars send infrared here now.
  virtual bool senses_carrier() { return false; }
  // Whether this car sends a frame now.
  virtual bool is_sending() { return false; }
  // Begin to send 32 bits by infrared; called only while nothing is being sent.
  virtual void send_frame(uint32_t frame) { (void)frame; }

  // Written by scripts/generate.py from motorcade.devices; don't edit.
  // Return the distance to the nearest obstacle ahead; NOTHING_IN_SIGHT_MM for none.
  virtual uint32_t obstacle_mm() { return NOTHING_IN_SIGHT_MM; }
  // Return whether the PIR sensor detects somebody.
  virtual bool sees_person() { return false; }
  // Return which floor sensors are over dark floor: 1 for the left one plus 2 for the right one.
  virtual uint8_t dark_floor() { return 0; }
  // End of the section.

  // The voice command since the last call.
  virtual uint8_t heard_voice() { return NO_VOICE; }

  // Drive forward (0) or turn on the spot, left (1) or right (2), at level 0 (stop) to 3.
  virtual void set_wheels(uint8_t direction, uint8_t speed_level) {
    (void)direction;
    (void)speed_level;
  }
  // Light LED 0 to 3 and no other; 4 for none.
  virtual void set_led(uint8_t which) { (void)which; }

  // Report an event to observers: `kind` is a NoteKind, `detail` a state's index, the tag of a word that starts (0: bare)
  // or the brain's result for a frame that was heard.
  virtual void note(uint8_t kind, uint32_t at_ms, uint32_t word, uint32_t detail) {
    (void)kind;
    (void)at_ms;
    (void)word;
    (void)detail;
  }
};

}  // namespace motorcade

#endif
