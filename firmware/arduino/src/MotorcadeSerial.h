// How many bytes a serial line takes without waiting, on any Arduino core.
#ifndef MOTORCADE_SERIAL_H
#define MOTORCADE_SERIAL_H

#include <stdint.h>

namespace motorcade {

// Some cores have no availableForWrite(), and in others it always returns 0, by which Arduino means 'a write may wait'.
// Such a line gets one byte at a time. Where it has returned more, 0 means that there is no room.
class SerialRoom {
 public:
  // `line` is the core's Serial, of whatever class.
  template <typename Line>
  uint16_t of(Line &line) {
    const int room = told_by(line, 0);
    if (room > 0) {
      is_told_ = true;
      return room;
    }
    return is_told_ ? 0 : 1;
  }

 private:
  template <typename Line>
  static auto told_by(Line &line, int) -> decltype(static_cast<int>(line.availableForWrite())) {
    return line.availableForWrite();
  }
  // Chosen where the line has no such method.
  template <typename Line>
  static int told_by(Line &, long) {
    return 0;
  }

  bool is_told_ = false;
};

}  // namespace motorcade

#endif
