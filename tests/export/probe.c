/* Feeds words to the exported headers and gives back all that they answer, byte by byte.
 *
 * FORMATS(F) in probe_formats.h calls F for each format. On a computer, words come from standard
 * input, and a record for each goes to standard output:
 *   probe NUMBER decode: a word -> fault, fault where strict, the fields (4 bytes each), fault and word of encoding them
 *   probe NUMBER encode: the fields (4 bytes each) -> fault of check, fault and word of encode
 * On an AVR, the words of probe_words.h are decoded, and a CRC-32 of the records is printed for each format.
 */
#include <stdio.h>
#include <string.h>

#include "probe_formats.h"

static uint8_t record[512];
static size_t length;

static void add_byte(unsigned int value)
{
    record[length++] = (uint8_t)value;
}

static void add_word(uint32_t word)
{
    motorcade_word_to_bytes(word, record + length);
    length += MOTORCADE_WORD_BYTES;
}

#define ADD_FIELD(name) add_word(values.name);
#define TAKE_FIELD(name, bits) values.name = (uint##bits##_t)motorcade_word_from_bytes(input); input += 4;

#define DEFINE(name) \
    static void name##_decode_probe(uint32_t word) \
    { \
        struct motorcade_##name values; \
        uint32_t again = 0; \
        length = 0; \
        memset(&values, 0xFF, sizeof values); \
        add_byte((unsigned int)motorcade_##name##_decode(word, 1, &values)); \
        add_byte((unsigned int)motorcade_##name##_decode(word, 0, &values)); \
        name##_FIELDS(ADD_FIELD) \
        add_byte((unsigned int)motorcade_##name##_encode(&values, &again)); \
        add_word(again); \
        add_word(name##_COMPLETE(word)); \
        add_byte((unsigned int)(name##_GOOD(word))); \
    }
FORMATS(DEFINE)

#ifdef __AVR__

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>

#include "probe_words.h"

static void print(char sign)
{
    while (!(UCSR0A & _BV(UDRE0))) { }
    UDR0 = (uint8_t)sign;
}

static uint32_t crc32(uint32_t crc)
{
    size_t index;
    for (index = 0; index < length; index++) {
        uint8_t bit;
        crc ^= record[index];
        for (bit = 0; bit < 8; bit++) crc = crc & 1UL ? crc >> 1 ^ 0xEDB88320UL : crc >> 1;
    }
    return crc;
}

#define RUN(name) \
    { \
        uint32_t crc = 0xFFFFFFFFUL; \
        uint16_t index; \
        int8_t shift; \
        for (index = 0; index < sizeof WORDS / sizeof WORDS[0]; index++) { \
            name##_decode_probe(pgm_read_dword(&WORDS[index])); \
            crc = crc32(crc); \
        } \
        crc = ~crc; \
        for (shift = 28; shift >= 0; shift = (int8_t)(shift - 4)) print("0123456789abcdef"[crc >> shift & 15]); \
        print('\n'); \
    }

int main(void)
{
    UCSR0B = _BV(TXEN0);
    FORMATS(RUN)
    /* A sleep that nothing can end is how the simulated chip is told to stop. */
    cli();
    sleep_mode();
    return 0;
}

#else

#include <stdlib.h>

#define DEFINE_ENCODE(name) \
    static void name##_encode_probe(const uint8_t *input) \
    { \
        struct motorcade_##name values = name##_DEFAULTS; \
        uint32_t word = 0; \
        length = 0; \
        name##_TYPES(TAKE_FIELD) \
        add_byte((unsigned int)motorcade_##name##_check(&values)); \
        add_byte((unsigned int)motorcade_##name##_encode(&values, &word)); \
        add_word(word); \
    }
FORMATS(DEFINE_ENCODE)

#define CHOOSE(name) \
    if (number-- == 0) { \
        decode = name##_decode_probe; \
        encode = name##_encode_probe; \
        input_bytes = name##_COUNT * MOTORCADE_WORD_BYTES; \
    }

int main(int count, char **arguments)
{
    static uint8_t input[32 * MOTORCADE_WORD_BYTES];
    void (*decode)(uint32_t) = NULL;
    void (*encode)(const uint8_t *) = NULL;
    size_t input_bytes = 0;
    int number = count > 2 ? atoi(arguments[1]) : -1;
    int decodes = count > 2 && strcmp(arguments[2], "decode") == 0;
    FORMATS(CHOOSE)
    if (decode == NULL) return 2;
    if (decodes) input_bytes = MOTORCADE_WORD_BYTES;
    while (fread(input, 1, input_bytes, stdin) == input_bytes) {
        if (decodes) decode(motorcade_word_from_bytes(input));
        else encode(input);
        fwrite(record, 1, length, stdout);
    }
    return 0;
}

#endif
