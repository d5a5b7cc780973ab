// The image in a memory of bytes such as an EEPROM. A cut of power at any byte leaves the old image or the new one, whole.
#ifndef MOTORCADE_STORE_H
#define MOTORCADE_STORE_H

#include <stdint.h>

namespace motorcade {

// A memory that keeps its bytes while the power is off.
class ByteMemory {
 public:
  // How many bytes it has.
  virtual uint16_t size() = 0;
  // Return the byte at `at`. Waits while a byte is being written, on an AVR for at most 3.4 ms.
  virtual uint8_t read(uint16_t at) = 0;
  // Return the four bytes from `at` on, the first one the most significant.
  virtual uint32_t read_u32(uint16_t at) {
    uint32_t value = 0;
    for (uint8_t i = 0; i < 4; i++) value = value << 8 | read(at + i);
    return value;
  }
  // Begin to write a byte; called only while the memory is ready.
  virtual void write(uint16_t at, uint8_t byte) = 0;
  // Whether the memory takes a byte now.
  virtual bool is_ready() { return true; }
  // Called after the last byte of an image, for memories that collect what is written.
  virtual void finish() {}
};

// Two places for an image in one memory. The newer whole image counts; the next one is written over the other.
//
// A place is: the CRC-32 of all that follows (4 bytes), a generation (1 byte) that counts on with every image, and the
// image's bytes. The CRC is written last. The memory's last 8 bytes hold the car's number and its complement.
class ImageStore {
 public:
  explicit ImageStore(ByteMemory &memory) : memory_(memory) {}

  // Find the newest whole image. `capacity_words` limits what the car's other memory can hold.
  void begin(uint16_t most_words);
  // How many words an image may have here.
  uint16_t capacity_words() const { return capacity_words_; }
  // Whether an image was ever stored.
  bool holds_image() const { return place_ != NO_PLACE; }
  // How many words the image has; 1, the empty image, where none was stored.
  uint16_t words() const { return words_; }
  // The word at `index`, the header at 0.
  uint32_t word_at(uint16_t index);
  // The byte at `at` of the image's `words() * 4`.
  uint8_t byte_at(uint16_t at);
  // The CRC-32 of the image's bytes.
  uint32_t crc() const { return crc_; }

  // Begin to replace the image. `data` and its `words` * 4 bytes must stay as they are until the end.
  void begin_saving(const uint8_t *data, uint16_t words, uint32_t crc);
  // Go on; call it until it returns something else than SAVING. It never waits for the memory.
  enum Progress : uint8_t { SAVING, SAVED, FAILED };
  Progress save();

  // The car's number in the memory's last bytes; `otherwise` where there is none.
  uint32_t number(uint32_t otherwise);
  // Write the car's number. Waits for the memory.
  void set_number(uint32_t number);

 private:
  static const uint8_t NO_PLACE = 255;
  static const uint8_t HEAD_BYTES = 5;

  uint16_t place_at(uint8_t place) const;
  uint8_t record_byte(uint16_t at) const;
  bool read_place(uint8_t place, uint8_t &generation, uint16_t &words, uint32_t &crc);

  ByteMemory &memory_;
  uint16_t capacity_words_ = 0;
  uint16_t place_bytes_ = 0;
  uint8_t place_ = NO_PLACE;
  uint8_t generation_ = 0;
  uint16_t words_ = 1;
  uint32_t header_ = 0;
  uint32_t crc_ = 0x2144DF1CUL;  // of four zero bytes

  // The image that is being saved.
  const uint8_t *data_ = nullptr;
  uint16_t data_words_ = 0;
  uint32_t data_crc_ = 0;
  uint32_t record_crc_ = 0;
  uint16_t saved_ = 0;
  uint8_t passes_ = 0;
};

}  // namespace motorcade

#endif
