#include "MotorcadeStore.h"

#include "motorcade_brain.h"

namespace motorcade {

namespace {

const uint8_t NUMBER_BYTES = 8;
const uint16_t MOST_WORDS = 511;
// So many equal bytes are skipped in one call of `save`.
const uint8_t SKIPS = 32;

uint32_t announced_words(uint32_t header) { return 1 + (header >> 24) + (header >> 16 & 255); }

// The CRC-32 of some bytes and one more.
uint32_t crc32_with(uint8_t byte, uint32_t crc) { return motorcade_blocks_crc32_of(&byte, 0, 1, crc); }

}  // namespace

void ImageStore::begin(uint16_t most_words) {
  place_bytes_ = (memory_.size() - NUMBER_BYTES) / 2;
  capacity_words_ = (place_bytes_ - HEAD_BYTES) / 4;
  if (capacity_words_ > most_words) capacity_words_ = most_words;
  if (capacity_words_ > MOST_WORDS) capacity_words_ = MOST_WORDS;
  place_ = NO_PLACE;
  for (uint8_t place = 0; place < 2; place++) {
    uint8_t generation;
    uint16_t words;
    uint32_t crc;
    if (!read_place(place, generation, words, crc)) continue;
    if (place_ != NO_PLACE && static_cast<int8_t>(generation - generation_) <= 0) continue;
    place_ = place;
    generation_ = generation;
    words_ = words;
    crc_ = crc;
  }
  if (place_ != NO_PLACE) header_ = memory_.read_u32(place_at(place_) + HEAD_BYTES);
}

uint32_t ImageStore::word_at(uint16_t index) {
  // The car reads the header in every tick, so it is kept in RAM.
  if (index == 0 || place_ == NO_PLACE) return index == 0 ? header_ : 0;
  return memory_.read_u32(place_at(place_) + HEAD_BYTES + 4 * index);
}

uint8_t ImageStore::byte_at(uint16_t at) {
  if (place_ == NO_PLACE) return 0;
  return memory_.read(place_at(place_) + HEAD_BYTES + at);
}

void ImageStore::begin_saving(const uint8_t *data, uint16_t words, uint32_t crc) {
  data_ = data;
  data_words_ = words;
  data_crc_ = crc;
  saved_ = 0;
  passes_ = 0;
  record_crc_ = crc32_with(generation_ + 1, crc);
  // The same image again wears nothing out.
  if (place_ != NO_PLACE && words == words_ && crc == crc_) passes_ = 2;
}

ImageStore::Progress ImageStore::save() {
  if (passes_ == 2) return SAVED;
  const uint16_t count = HEAD_BYTES + 4 * data_words_;
  const uint16_t start = place_at(place_ == 0 ? 1 : 0);
  for (uint8_t skip = 0; skip < SKIPS && saved_ < count; skip++) {
    if (!memory_.is_ready()) return SAVING;
    // The CRC, at the beginning of the place, is written last.
    const uint16_t at = (saved_ + 4) % count;
    const uint8_t byte = record_byte(at);
    if (memory_.read(start + at) != byte) {
      if (passes_ == 1) return FAILED;
      memory_.write(start + at, byte);
    }
    saved_++;
  }
  if (saved_ < count || !memory_.is_ready()) return SAVING;
  if (passes_ == 0) {
    memory_.finish();
    // Once more, to compare.
    saved_ = 0;
    passes_ = 1;
    return SAVING;
  }
  passes_ = 2;
  place_ = place_ == 0 ? 1 : 0;
  generation_++;
  words_ = data_words_;
  crc_ = data_crc_;
  header_ = memory_.read_u32(start + HEAD_BYTES);
  return SAVED;
}

uint32_t ImageStore::number(uint32_t otherwise) {
  const uint16_t at = memory_.size() - NUMBER_BYTES;
  const uint32_t number = memory_.read_u32(at);
  return memory_.read_u32(at + 4) == (number ^ 0xFFFFFFFFUL) ? number : otherwise;
}

void ImageStore::set_number(uint32_t number) {
  const uint16_t at = memory_.size() - NUMBER_BYTES;
  for (uint8_t i = 0; i < NUMBER_BYTES; i++) {
    const uint32_t half = i < 4 ? number : number ^ 0xFFFFFFFFUL;
    const uint8_t byte = half >> (8 * (3 - i % 4)) & 255;
    while (!memory_.is_ready()) {
    }
    if (memory_.read(at + i) != byte) memory_.write(at + i, byte);
  }
  memory_.finish();
}

uint16_t ImageStore::place_at(uint8_t place) const { return place == 0 ? 0 : place_bytes_; }

// A byte of the record that is being saved.
uint8_t ImageStore::record_byte(uint16_t at) const {
  if (at < 4) return record_crc_ >> (8 * (3 - at)) & 255;
  if (at == 4) return generation_ + 1;
  return data_[at - HEAD_BYTES];
}

bool ImageStore::read_place(uint8_t place, uint8_t &generation, uint16_t &words, uint32_t &crc) {
  const uint16_t start = place_at(place);
  const uint32_t announced = announced_words(memory_.read_u32(start + HEAD_BYTES));
  if (announced > capacity_words_) return false;
  words = announced;
  generation = memory_.read(start + 4);
  crc = 0;
  for (uint16_t at = 0; at < 4 * words; at++) crc = crc32_with(memory_.read(start + HEAD_BYTES + at), crc);
  return crc32_with(generation, crc) == memory_.read_u32(start);
}

}  // namespace motorcade
