// The library's portable parts as plain C++, with functions that Python calls by ctypes.
#include <Arduino.h>
#include <Motorcade.h>
#include <string.h>

uint32_t mock_us;
uint8_t mock_pins[256];
uint8_t mock_duties[256];
void (*mock_interrupts[256])();
Stream Serial;

namespace {

uint8_t sent[1 << 16];
size_t sent_count;

class Ram : public motorcade::ByteMemory {
 public:
  Ram() { memset(bytes, 0xFF, sizeof(bytes)); }
  uint16_t size() override { return sizeof(bytes); }
  uint8_t read(uint16_t at) override { return bytes[at]; }
  void write(uint16_t at, uint8_t byte) override { bytes[at] = at == bad_at ? byte ^ 1 : byte; }
  uint8_t bytes[1024];
  uint16_t bad_at = 0xFFFF;
};

const motorcade::VoicePattern PATTERNS[] = {{"\xAA\x01", 2, 1}, {"go", 2, 2}};
const uint32_t LEVELS[] = {0,   1000, 2000, 3000, 1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000, 100,
                           200, 300,  400,  100,  560,  5,    250,  6,    110,  3520, 2,    10000};
// One car with parts of all kinds: a motor of each kind, a third one behind the right one, and an analog floor sensor.
// Its right motors get 80% of their duties.
constexpr motorcade::CarSettings CAR = {
    LEVELS, 115200, 2000, {7, 8, 5, 255, 1}, {255, 255, 6, 9, 0}, {255, 255, 255, 255, 1}, {20, 21, 255, 255, 1}, 22,
    {0, 115, 180, 255}, {0, 100, 150, 200}, 100, 80, {14, 15, 16, 17}, 255, 1, 4, 3, {12}, {18, 13}, 0, 40, 255, 0, 0, 2, 255,
    24, 255, 0, PATTERNS, 2,
};

// An ArduinoBoard whose frames need no pin.
class ProbeBoard : public motorcade::ArduinoBoard<CAR> {
 public:
  ProbeBoard(bool is_leader, uint32_t number) : ArduinoBoard<CAR>(is_leader, number, ram, nullptr) {}
  void send_frame(uint32_t frame) override {
    begin_echo(frame);
  }
  Ram ram;
};

struct Probe {
  Probe(bool is_leader, uint32_t number) : board(is_leader, number), car(board) {}
  ProbeBoard board;
  motorcade::Car car;
};

}  // namespace

size_t Stream::write(const uint8_t *data, size_t count) {
  if (sent_count + count > sizeof(sent)) return 0;
  memcpy(sent + sent_count, data, count);
  sent_count += count;
  return count;
}

void Stream::come(const uint8_t *data, size_t count) {
  if (taken_ == count_) taken_ = count_ = 0;
  if (count_ + count > sizeof(came_)) return;
  memcpy(came_ + count_, data, count);
  count_ += count;
}

extern "C" {

void set_time(uint32_t now_us) { mock_us = now_us; }

Probe *probe_new(uint8_t is_leader, uint32_t number, const uint8_t *content) {
  Probe *probe = new Probe(is_leader, number);
  if (content) memcpy(probe->board.ram.bytes, content, sizeof(probe->board.ram.bytes));
  sent_count = 0;
  probe->board.begin(motorcade::MOST_WORDS);
  probe->car.begin();
  return probe;
}

void probe_free(Probe *probe) { delete probe; }
void probe_room(int room) { Serial.set_room(room); }

// A line of a core without availableForWrite.
uint16_t room_without_method(void) {
  struct {
  } line;
  return motorcade::SerialRoom().of(line);
}

void probe_wheels(Probe *probe, uint8_t direction, uint8_t level) { probe->board.set_wheels(direction, level); }
uint8_t probe_floor(Probe *probe) { return probe->board.dark_floor(); }
void set_pin(uint8_t pin, uint8_t level) { mock_pins[pin] = level; }
uint8_t level_at(uint8_t pin) { return mock_pins[pin]; }
uint8_t duty_at(uint8_t pin) { return mock_duties[pin]; }

void probe_tick(Probe *probe) { probe->car.tick(); }
void probe_come(const uint8_t *data, uint32_t count) { Serial.come(data, count); }
void probe_memory(Probe *probe, uint8_t *content) { memcpy(content, probe->board.ram.bytes, sizeof(probe->board.ram.bytes)); }
void probe_break_cell(Probe *probe, uint16_t at) { probe->board.ram.bad_at = at; }
uint32_t probe_number(Probe *probe) { return probe->board.number(); }
void probe_set_number(Probe *probe, uint32_t number) { probe->board.store().set_number(number); }

uint32_t probe_sent(uint8_t *data) {
  const size_t count = sent_count;
  memcpy(data, sent, count);
  sent_count = 0;
  return count;
}

motorcade::InfraredReceiver *receiver_new(uint16_t unit_us) { return new motorcade::InfraredReceiver(unit_us); }
void receiver_free(motorcade::InfraredReceiver *receiver) { delete receiver; }
void receiver_edge(motorcade::InfraredReceiver *receiver, uint32_t at_us, uint8_t level) {
  receiver->take_edge(at_us, level);
}
void receiver_ignore(motorcade::InfraredReceiver *receiver, uint32_t until_us) { receiver->ignore_until(until_us); }
uint8_t receiver_next(motorcade::InfraredReceiver *receiver, uint32_t now_us, uint32_t *frame) {
  return receiver->next_frame(now_us, *frame);
}
uint8_t receiver_senses(motorcade::InfraredReceiver *receiver, uint32_t now_us) {
  return receiver->senses_carrier(now_us);
}

motorcade::EdgeSerial *line_new(uint16_t baud) { return new motorcade::EdgeSerial(baud); }
void line_free(motorcade::EdgeSerial *line) { delete line; }
void line_edge(motorcade::EdgeSerial *line, uint32_t at_us, uint8_t level) { line->take_edge(at_us, level); }
int16_t line_read(motorcade::EdgeSerial *line, uint32_t now_us) { return line->read(now_us); }

}  // extern "C"
