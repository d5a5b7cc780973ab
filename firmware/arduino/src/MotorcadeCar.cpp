#include "MotorcadeCar.h"

#include <Arduino.h>

namespace motorcade {

namespace {

// How many words of an image are checked at a time, so that no tick takes long.
const uint8_t WORK_WORDS = 8;
// A car that blinks lights one LED after the other, so it needs only one of them: so long each, and none after the last.
const uint16_t BLINK_MS = 5000;
const uint8_t LED_MS = 100;
const uint8_t NO_LED = 4;
// How many bytes of the stored image are sent at a time.
const uint8_t READBACK_BYTES = 16;

Car *car_of(motorcade_car *brain) { return reinterpret_cast<Car *>(brain); }

}  // namespace

void Car::begin() {
  image_.store = &board_.store();
  brain_.leads = board_.is_leader();
  brain_.memory = memory_;
  brain_.decisions = decisions_;
  brain_.image = &image_;
  brain_.levels = board_.levels();
  brain_.notes_flow = 0;
  now_ms_ = board_.now_ms();
  motorcade_receiver_switch_on(receiver_, image_.store->capacity_words());
  motorcade_brain_switch_on(memory_, board_.number(), now_ms_);
  begin_program();
}

void Car::tick() {
  now_ms_ = board_.now_ms();
  if (blinks_) blink();
  // To begin a long program takes a while, so the step that follows is left to the next tick.
  if (!serve_serial() && !is_stopped_) motorcade_step_step(&brain_, now_ms_);
}

void Car::begin_program() {
  if (!brain_.leads || is_stopped_) return;
  // No leader has more words; the survey ends with the last one.
  motorcade_decisions_survey(decisions_, &image_, 0, 256, brain_.levels);
  motorcade_step_begin_program(&brain_, now_ms_);
}

bool Car::serve_serial() {
  if (is_saving_ && go_on_saving()) return true;
  if (is_saving_ || !send_pending()) return false;
  bool has_copied = false;
  for (;;) {
    const uint8_t event = motorcade_receiver_next_event(receiver_, buffer_, WORK_WORDS, now_ms_);
    if (event == MOTORCADE_RECEIVER_NOTHING || event == MOTORCADE_RECEIVER_WORKING) {
      if (has_copied || !copy_bytes()) return false;
      has_copied = true;
      continue;
    }
    take_event(event);
    if (is_saving_ || !send_pending()) return false;
  }
}

// Send what is left of the last answer; return whether all of it is sent.
bool Car::send_pending() {
  uint16_t room = board_.serial_room();
  uint8_t count = line_count_ - line_sent_;
  if (count > room) count = room;
  if (count > 0) {
    board_.write_serial(line_ + line_sent_, count);
    line_sent_ += count;
    room -= count;
  }
  if (line_sent_ < line_count_) return false;
  line_count_ = line_sent_ = 0;
  if (readback_left_ == 0) return true;
  uint8_t data[READBACK_BYTES];
  count = 0;
  while (count < READBACK_BYTES && count < room && readback_left_ > 0) {
    data[count++] = image_.store->byte_at(4 * image_.store->words() - readback_left_--);
  }
  board_.write_serial(data, count);
  return readback_left_ == 0;
}

// Copy what came over the serial line into the receiver's buffer; return whether anything came.
bool Car::copy_bytes() {
  const uint16_t room = motorcade_receiver_room(receiver_, buffer_, now_ms_);
  if (room == 0) return false;
  const uint16_t count = board_.read_serial(buffer_ + receiver_[MOTORCADE_RECEIVER_END], room);
  if (count > 0) motorcade_receiver_add(receiver_, count, now_ms_);
  return count > 0;
}

void Car::take_event(uint8_t event) {
  ImageStore &store = *image_.store;
  if (event == MOTORCADE_RECEIVER_IMAGE) {
    const uint8_t *data = buffer_ + receiver_[MOTORCADE_RECEIVER_START];
    store.begin_saving(data, receiver_[MOTORCADE_RECEIVER_LENGTH] / 4, receiver_[MOTORCADE_RECEIVER_CRC]);
    is_saving_ = true;
  } else if (event == MOTORCADE_RECEIVER_READBACK) {
    readback_left_ = 4 * store.words();
  } else if (event == MOTORCADE_RECEIVER_CHECK) {
    put_text(PSTR("OK check="));
    put_hex(receiver_[MOTORCADE_RECEIVER_ANNOUNCED]);
    put_hex(receiver_[MOTORCADE_RECEIVER_NUMBER], 2);
    put_text(PSTR(" holds="));
    put_hex(store.crc());
    const uint32_t sum = motorcade_blocks_crc32_of(line_, 0, line_count_, 0);
    put_text(PSTR(" sum="));
    put_hex(sum);
    end_line();
  } else if (event == MOTORCADE_RECEIVER_REQUEST) {
    take_request(buffer_ + receiver_[MOTORCADE_RECEIVER_START]);
  } else {
    put_refusal(event);
  }
}

// Do what a request asks for, and answer it, as motorcade/words/request.py describes; this car keeps no name.
void Car::take_request(const uint8_t *request) {
  const char kind = request[4];
  if (kind == 'n') {
    put_text(PSTR("ERR name-not-kept"));
    end_line();
    return;
  }
  if (kind == 'b') {
    blinks_ = true;
    blinks_since_ms_ = now_ms_;
  } else if (kind == 's' && !is_stopped_) {
    is_stopped_ = true;
    wheels_ = 0;
    led_ = NO_LED;
    board_.set_wheels(0, 0);
    board_.set_led(NO_LED);
  } else if (kind == 'g' && is_stopped_) {
    is_stopped_ = false;
    begin_program();
  } else if (kind != 'a' && kind != 's' && kind != 'g') {
    put_text(PSTR("ERR request-unknown kind="));
    put(kind);
    end_line();
    return;
  }
  put_text(PSTR("OK car="));
  for (uint8_t i = 4; i < 7; i++) put(request[i]);
  put_text(PSTR(" holds="));
  put_hex(image_.store->crc());
  put_text(PSTR(" words="));
  put_number(image_.store->words());
  put_text(PSTR(" number="));
  put_hex(board_.number());
  put_text(brain_.leads ? PSTR(" role=leader") : PSTR(" role=follower"));
  put_text(is_stopped_ ? PSTR(" state=stopped") : PSTR(" state=runs"));
  put_text(PSTR(" board=arduino"));
  const uint32_t sum = motorcade_blocks_crc32_of(line_, 0, line_count_, 0);
  put_text(PSTR(" sum="));
  put_hex(sum);
  end_line();
}

// Light one LED after the other; at the end the one that the program lights.
void Car::blink() {
  const uint32_t blinked_ms = (now_ms_ - blinks_since_ms_) & TICKS_MASK;
  blinks_ = blinked_ms < BLINK_MS;
  const uint8_t led = blinks_ ? blinked_ms / LED_MS % (NO_LED + 1) : led_;
  if (led != blinking_led_ || !blinks_) board_.set_led(led);
  blinking_led_ = led;
}

// Go on writing the image, and answer once it is stored whole; return whether it is. Until then the car goes on with the
// old one.
bool Car::go_on_saving() {
  const ImageStore::Progress progress = image_.store->save();
  if (progress == ImageStore::SAVING) return false;
  is_saving_ = false;
  if (progress == ImageStore::FAILED) {
    put_text(PSTR("ERR the image could not be stored"));
    end_line();
    return false;
  }
  put_text(PSTR("OK words="));
  put_number(image_.store->words());
  put_text(PSTR(" crc32="));
  put_hex(image_.store->crc());
  end_line();
  board_.note(NOTE_IMAGE, now_ms_, 4UL * image_.store->words(), 0);
  begin_program();
  return true;
}

void Car::put_refusal(uint8_t event) {
  const uint32_t count = receiver_[MOTORCADE_RECEIVER_COUNT];
  put_text(PSTR("ERR "));
  if (event == MOTORCADE_RECEIVER_CUT_OFF) {
    put_text(PSTR("cut off after "));
    put_number(count);
    put_text(PSTR(" bytes"));
  } else if (event == MOTORCADE_RECEIVER_NOT_EMPTY) {
    put_text(PSTR("the empty image has 4 bytes, "));
    put_number(count);
    put_text(PSTR(" are here"));
  } else if (event == MOTORCADE_RECEIVER_CHANGED_REQUEST) {
    put_text(PSTR("the check request was changed on the way"));
  } else if (event == MOTORCADE_RECEIVER_OTHER_CHECKSUM) {
    put_text(PSTR("the checksum is "));
    put_hex(receiver_[MOTORCADE_RECEIVER_CRC]);
    put_text(PSTR(", "));
    put_hex(receiver_[MOTORCADE_RECEIVER_ANNOUNCED]);
    put_text(PSTR(" was announced"));
  } else if (event == MOTORCADE_RECEIVER_TOO_LARGE) {
    put_text(PSTR("image-too-large most="));
    put_number(image_.store->capacity_words());
    put_text(PSTR(" words="));
    put_number(count);
  } else {
    if (event == MOTORCADE_RECEIVER_BAD_WORD) {
      put_text(PSTR("image-word"));
      // Its lowest byte says that the leader decides.
      if (static_cast<uint8_t>(receiver_[MOTORCADE_RECEIVER_HEADER])) {
        put_text(PSTR(" header=0x"));
        put_hex(receiver_[MOTORCADE_RECEIVER_HEADER], 8, 'A');
      }
      put_text(PSTR(" position="));
      put_number(count);
    } else {
      put_text(PSTR("image-header"));
    }
    put_text(PSTR(" word=0x"));
    put_hex(receiver_[MOTORCADE_RECEIVER_WORD], 8, 'A');
  }
  end_line();
}

void Car::put(char character) {
  if (line_count_ < sizeof(line_)) line_[line_count_++] = character;
}

void Car::put_text(const char *flash_text) {
  for (char character = pgm_read_byte(flash_text); character; character = pgm_read_byte(++flash_text)) put(character);
}

void Car::put_number(uint32_t number) {
  uint16_t unit = 1000;
  while (unit > 1 && number < unit) unit /= 10;
  for (; unit > 0; unit /= 10) put('0' + number / unit % 10);
}

void Car::put_hex(uint32_t number, uint8_t digits, char ten) {
  while (digits-- > 0) {
    const uint8_t digit = number >> (4 * digits) & 15;
    put(digit < 10 ? '0' + digit : ten + digit - 10);
  }
}

void Car::end_line() { put('\n'); }

uint32_t Car::received_frame(uint32_t *frame) {
  uint32_t found;
  if (!board_.next_frame(found)) return 0;
  *frame = found;
  return 1;
}

// Written by scripts/generate.py from motorcade.devices; don't edit.
const motorcade_senses *Car::sense(uint32_t looks_mm) {
  senses_.obstacle_mm = looks_mm ? board_.obstacle_mm() : NOTHING_IN_SIGHT_MM;
  senses_.person = board_.sees_person();
  senses_.dark_floor = board_.dark_floor();
  return &senses_;
}
// End of the section.

void Car::set_outputs(uint32_t wheels) {
  if (wheels != wheels_) {
    wheels_ = wheels;
    board_.set_wheels(wheels >> 2, wheels & 3);
  }
  const uint8_t led = motorcade_brain_lit_led(memory_, now_ms_, brain_.levels);
  if (led != led_) {
    led_ = led;
    if (!blinks_) board_.set_led(led);
  }
}

void Car::send_frame(uint32_t frame) {
  board_.send_frame(frame);
  board_.note(NOTE_FRAME, now_ms_, frame, 0);
}

}  // namespace motorcade

extern "C" {

uint32_t motorcade_image_word(const struct motorcade_image *image, uint32_t index) { return image->store->word_at(index); }

void motorcade_car_note(struct motorcade_car *car, uint8_t kind, uint32_t at_ms, uint32_t word, uint32_t detail) {
  motorcade::car_of(car)->note(kind, at_ms, word, detail);
}

// Whoever observes a car sees the states that begin.
void motorcade_car_note_end(struct motorcade_car *) {}

void motorcade_car_note_flow(struct motorcade_car *, uint8_t) {}

uint32_t motorcade_car_received_frames(struct motorcade_car *car, uint32_t *frame) {
  return motorcade::car_of(car)->received_frame(frame);
}

void motorcade_car_note_frame(struct motorcade_car *car, uint32_t frame, uint8_t result) {
  motorcade::Car *self = motorcade::car_of(car);
  self->note(motorcade::NOTE_HEARD, self->now_ms(), frame, result);
}

uint8_t motorcade_car_heard_voice(struct motorcade_car *car) { return motorcade::car_of(car)->heard_voice(); }

const struct motorcade_senses *motorcade_car_sense(struct motorcade_car *car, uint32_t looks_mm) {
  return motorcade::car_of(car)->sense(looks_mm);
}

void motorcade_car_set_outputs(struct motorcade_car *car, uint8_t wheels, const struct motorcade_senses *senses) {
  (void)senses;
  motorcade::car_of(car)->set_outputs(wheels);
}

uint8_t motorcade_car_air_is_busy(struct motorcade_car *car) { return motorcade::car_of(car)->air_is_busy() ? 1 : 0; }

void motorcade_car_send_frame(struct motorcade_car *car, uint32_t frame) { motorcade::car_of(car)->send_frame(frame); }

}  // extern "C"
