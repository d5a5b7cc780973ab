// The loop of a car: serve the serial line, then do one step of the brain, as motorcade/car/loop.py does.
#ifndef MOTORCADE_CAR_H
#define MOTORCADE_CAR_H

#include <stdint.h>

#ifdef __AVR__
#include <avr/io.h>
#endif

#include "MotorcadeBoard.h"
#include "motorcade_brain.h"

#if defined(RAMEND) && RAMEND < 0x1000
// What the RAM of an ATmega328P has room for.
#define MOTORCADE_MOST_WORDS 125
#else
#define MOTORCADE_MOST_WORDS 511
#endif

// The image of the car, as the brain knows it.
struct motorcade_image {
  motorcade::ImageStore *store;
};

namespace motorcade {

// The words of the largest image that a car's RAM can receive; its store may hold fewer.
const uint16_t MOST_WORDS = MOTORCADE_MOST_WORDS;

// A car on a board; call `begin` once, then `tick` often, at best every millisecond.
class Car {
 public:
  explicit Car(Board &board) : board_(board) {}
  // Begin the stored image; the board has begun already.
  void begin();
  // Do all that is due at the board's present time.
  void tick();

  // What the brain calls.
  void note(uint32_t kind, uint32_t at_ms, uint32_t word, uint32_t detail) { board_.note(kind, at_ms, word, detail); }
  uint32_t received_frame(uint32_t *frame);
  uint8_t heard_voice() { return board_.heard_voice(); }
  const motorcade_senses *sense(uint32_t looks_mm);
  void set_outputs(uint32_t wheels);
  bool air_is_busy() { return board_.is_sending() || board_.senses_carrier(); }
  void send_frame(uint32_t frame);
  uint32_t now_ms() const { return now_ms_; }

 private:
  // Return whether the program has begun anew.
  bool serve_serial();
  bool send_pending();
  bool copy_bytes();
  void take_event(uint8_t event);
  void take_request(const uint8_t *request);
  void blink();
  bool go_on_saving();
  void begin_program();

  // The answer on its way.
  void put(char character);
  void put_text(const char *flash_text);
  void put_number(uint32_t number);
  void put_hex(uint32_t number, uint8_t digits = 8, char ten = 'a');
  void end_line();
  void put_refusal(uint8_t event);

  // First, so that the brain's pointer is this car's.
  motorcade_car brain_;
  motorcade_image image_;
  uint32_t memory_[MOTORCADE_BRAIN_SIZE];
  uint8_t decisions_[MOTORCADE_DECISIONS_SIZE];
  uint32_t receiver_[MOTORCADE_RECEIVER_SIZE];
  uint8_t buffer_[4 * MOST_WORDS];
  Board &board_;
  uint32_t now_ms_ = 0;
  motorcade_senses senses_;
  uint8_t line_[108];
  uint8_t line_count_ = 0;
  uint8_t line_sent_ = 0;
  uint16_t readback_left_ = 0;
  bool is_saving_ = false;
  bool is_stopped_ = false;
  bool blinks_ = false;
  uint8_t blinking_led_ = 4;
  uint32_t blinks_since_ms_ = 0;
  uint8_t wheels_ = 0;
  uint8_t led_ = 4;
};

}  // namespace motorcade

#endif
