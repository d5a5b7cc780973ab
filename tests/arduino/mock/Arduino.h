// A mock of the parts of Arduino's core that the library uses on any board. Time and pins are plain variables.
#ifndef MOCK_ARDUINO_H
#define MOCK_ARDUINO_H

#include <stddef.h>
#include <stdint.h>

#define HIGH 1
#define LOW 0
#define INPUT 0
#define OUTPUT 1
#define INPUT_PULLUP 2
#define CHANGE 1
#define PROGMEM
#define PSTR(text) (text)
#define pgm_read_byte(address) (*(const uint8_t *)(address))
#define digitalPinToInterrupt(pin) (pin)
// As Arduino's core has it: a name that the library must not use.
#define word(...) makeWord(__VA_ARGS__)

extern uint32_t mock_us;
extern uint8_t mock_pins[256];
extern uint8_t mock_duties[256];
extern void (*mock_interrupts[256])();

inline uint32_t millis() { return mock_us / 1000; }
inline uint32_t micros() { return mock_us; }
inline void pinMode(uint8_t, uint8_t) {}
inline void digitalWrite(uint8_t pin, uint8_t level) { mock_pins[pin] = level, mock_duties[pin] = level ? 255 : 0; }
inline int analogRead(uint8_t pin) { return 4 * mock_pins[pin]; }
inline int digitalRead(uint8_t pin) { return mock_pins[pin]; }
inline void analogWrite(uint8_t pin, int duty) { mock_duties[pin] = duty; }
inline void attachInterrupt(uint8_t pin, void (*handler)(), int) { mock_interrupts[pin] = handler; }
inline void noInterrupts() {}
inline void interrupts() {}
inline void delayMicroseconds(unsigned) {}

class Stream {
 public:
  virtual int available() { return count_ - taken_; }
  virtual int read() { return taken_ < count_ ? came_[taken_++] : -1; }
  virtual int availableForWrite() { return room_; }
  void set_room(int room) { room_ = room; }
  virtual size_t write(const uint8_t *data, size_t count);
  void begin(uint32_t) { count_ = taken_ = 0; }
  void come(const uint8_t *data, size_t count);

 private:
  uint8_t came_[1 << 16];
  size_t count_ = 0, taken_ = 0;
  int room_ = 63;
};

extern Stream Serial;

#endif
