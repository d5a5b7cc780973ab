// A car of your own: derive a class from Board and override what your hardware has.
#include <Motorcade.h>

// Some boards have no LED of their own: put one at this pin.
#ifndef LED_BUILTIN
#define LED_BUILTIN 2
#endif

namespace {

// The profile 'classroom': what a level in a word means, in the order of motorcade/car/brain.py.
const uint32_t LEVELS[25] = {0,   1000, 2000, 3000, 1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000, 100,
                             200, 300,  400,  100,  560,  5,    250,  6,    110,  3520, 2,    10000};

// Bytes that are forgotten when the power is off.
class Ram : public motorcade::ByteMemory {
 public:
  uint16_t size() override { return sizeof(bytes_); }
  uint8_t read(uint16_t at) override { return bytes_[at]; }
  void write(uint16_t at, uint8_t byte) override { bytes_[at] = byte; }

 private:
  uint8_t bytes_[128] = {};
};

// A leader without wheels: its LED is the one on the board.
class LampBoard : public motorcade::Board {
 public:
  LampBoard() : store_(ram_) {}
  void begin() {
    Serial.begin(115200);
    pinMode(LED_BUILTIN, OUTPUT);
    store_.begin(motorcade::MOST_WORDS);
  }
  bool is_leader() override { return true; }
  const uint32_t *levels() override { return LEVELS; }
  uint32_t now_ms() override { return millis() & motorcade::TICKS_MASK; }
  motorcade::ImageStore &store() override { return store_; }
  uint16_t read_serial(uint8_t *data, uint16_t most) override {
    uint16_t count = 0;
    while (count < most && Serial.available() > 0) data[count++] = Serial.read();
    return count;
  }
  uint16_t serial_room() override { return serial_room_.of(Serial); }
  void write_serial(const uint8_t *data, uint16_t count) override { Serial.write(data, count); }
  void set_led(uint8_t which) override { digitalWrite(LED_BUILTIN, which < 4 ? HIGH : LOW); }

 private:
  Ram ram_;
  motorcade::ImageStore store_;
  motorcade::SerialRoom serial_room_;
};

LampBoard board;
motorcade::Car car(board);

}  // namespace

void setup() {
  board.begin();
  car.begin();
}

void loop() { car.tick(); }
