/* Run random steps of cars with the translated brain and receiver, and print a running sum of all results.
 *
 * tests/support/brain_steps.py does the same with the Python of the brain; both must print the same lines. On a computer the arguments
 * are the seed and the number of steps; on an AVR they are the macros SEED and STEPS, and UART 0 prints.
 */
#include "motorcade_brain.h"

#include <stdio.h>

#define STEPS_OF_A_CAR 512
#define STEPS_OF_A_LINE 1024
#define MOST_IMAGE_WORDS 24
#define LINE_BYTES 160

struct motorcade_image {
    uint32_t words[MOST_IMAGE_WORDS];
};

/* The built-in profile, one whose times are no round numbers, and one with the largest numbers that a profile may have. */
static const uint32_t LEVELS[3][25] = {
    {0, 1000, 2000, 3000, 1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000, 100, 200, 300, 400, 100,
     560, 5, 250, 6, 150, 2400, 2, 10000},
    {0, 130, 999, 1501, 90, 170, 333, 500, 701, 1200, 1999, 4001, 1, 150, 151, 499, 37, 500, 0, 40, 2, 31, 333, 1, 4100},
    {0, 70001, 300000, 1048575, 70000, 90001, 131072, 262144, 300000, 500000, 1000000, 1048575, 65536, 70000, 300000, 1048575,
     66000, 1048575, 1048575, 1048575, 70000, 66000, 1048575, 1048575, 1048575},
};
static const uint16_t ADVANCES_MS[16] = {0, 1, 3, 4, 4, 7, 12, 20, 20, 20, 20, 50, 100, 300, 700, 5000};
static const uint8_t FROM_OWN_TAG[4] = {30, 30, 0, 29};
static const uint32_t OBSTACLES_MM[4] = {50, 150, 350, 1048576};

static uint32_t state, sum, now;
static uint32_t memory[MOTORCADE_BRAIN_SIZE], receiver[MOTORCADE_RECEIVER_SIZE];
static uint8_t decisions[MOTORCADE_DECISIONS_SIZE];
static struct motorcade_senses senses;
static uint8_t buffer[MOST_IMAGE_WORDS * 4], line[LINE_BYTES], line_at, line_end;
static struct motorcade_image image;
static struct motorcade_car car;
/* The random bits of a step. */
static uint32_t bits;

static uint32_t draw(void)
{
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return state;
}

static void add(uint32_t value)
{
    sum = ((sum << 8) | (sum >> 24)) + value;
}

uint32_t motorcade_image_word(const struct motorcade_image *of, uint32_t index)
{
    return of->words[index];
}

void motorcade_car_note(struct motorcade_car *of, uint8_t kind, uint32_t at_ms, uint32_t word, uint32_t detail)
{
    (void)of;
    add(kind);
    add(at_ms);
    add(word);
    add(detail);
}

void motorcade_car_note_end(struct motorcade_car *of)
{
    (void)of;
    add(memory[MOTORCADE_BRAIN_STATE]);
}

void motorcade_car_note_flow(struct motorcade_car *of, uint8_t index)
{
    (void)of;
    add(index);
}

/* A frame of the held word or another; some have one or two bits flipped, half of them a tag near the car's own. */
static uint32_t draw_frame(void)
{
    const uint32_t word = draw() & 0xFFFFF800U;
    const uint8_t kind = draw() >> 24;
    uint32_t frame = motorcade_infrared_to_frame(kind & 1 ? word | 0x80000000U : memory[MOTORCADE_BRAIN_WORD]);
    if (kind & 2) {
        const uint8_t own = memory[MOTORCADE_BRAIN_TAG] & MOTORCADE_BRAIN_TAG_MASK;
        frame = motorcade_infrared_tagged_frame(frame, (uint8_t)((own + FROM_OWN_TAG[kind >> 6]) % 31 + 1));
    }
    if ((kind & 12) == 0) frame ^= (kind & 16 ? 3UL : 1UL) << (draw() >> 27);
    return frame;
}

uint32_t motorcade_car_received_frames(struct motorcade_car *of, uint32_t *next)
{
    (void)of;
    if ((bits & 7) != 0) return 0;
    bits >>= 3;
    *next = draw_frame();
    return 1;
}

void motorcade_car_note_frame(struct motorcade_car *of, uint32_t frame, uint8_t result)
{
    (void)of;
    add(frame + result);
}

uint8_t motorcade_car_heard_voice(struct motorcade_car *of)
{
    (void)of;
    return (bits >> 8 & 15) < 3 ? bits >> 8 & 15 : 0;
}

const struct motorcade_senses *motorcade_car_sense(struct motorcade_car *of, uint32_t looks_mm)
{
    (void)of;
    add(looks_mm);
    senses.obstacle_mm = OBSTACLES_MM[bits >> 12 & 3];
    senses.person = (bits >> 14 & 3) == 0;
    senses.dark_floor = bits >> 16 & 3;
    return &senses;
}

void motorcade_car_set_outputs(struct motorcade_car *of, uint8_t wheels, const struct motorcade_senses *sensed)
{
    add(wheels + (uint32_t)(sensed == &senses ? motorcade_brain_lit_led(of->memory, now, of->levels) : 99) * 16);
}

uint8_t motorcade_car_air_is_busy(struct motorcade_car *of)
{
    (void)of;
    return (bits >> 16 & 3) == 0;
}

void motorcade_car_send_frame(struct motorcade_car *of, uint32_t frame)
{
    (void)of;
    add(frame);
}

static uint32_t leader_word(uint32_t word, uint32_t header)
{
    const uint8_t leader_states = header >> 24, follower_words = header >> 16 & 255;
    uint32_t drawn = draw();
    if (word >> 31) {
        const uint32_t op = (word >> 28 & 7) % 5, condition = (word >> 16 & 15) % 7;
        const uint32_t level = (word >> 13 & 3) % (motorcade_flow_highest_level((uint8_t)condition) + 1UL);
        uint32_t value = drawn >> 24, target = drawn >> 16 & 255;
        if (op == MOTORCADE_FLOW_TELL && (drawn >> 8 & 1)) {
            target = MOTORCADE_FLOW_IN_TURN;
            value %= follower_words + 1UL;
        } else if (op == MOTORCADE_FLOW_TELL) {
            target %= follower_words ? follower_words : 1;
        } else {
            target %= leader_states;
        }
        drawn = 1UL << 31 | op << 28 | target << 20 | condition << 16 | (word & 0x9800U) | level << 13 | value << 1;
    } else {
        const uint32_t until = (drawn >> 28) % 5;
        const uint32_t level = (drawn >> 25 & 3) % (motorcade_flow_highest_level((uint8_t)until) + 1UL);
        drawn = (word & 0x7FFFF800U) | until << 7 | (drawn >> 27 & 1) << 6 | level << 4;
    }
    return motorcade_flow_word_fault(drawn >> 24, drawn >> 16 & 255, drawn >> 8 & 255, drawn & 255, leader_states,
                                     follower_words, header & MOTORCADE_FLOW_TAGGED)
        ? word & 0x7FFFF800U : drawn;
}

/* Any image; the leader of every second one decides, and the car has to understand each of its words. */
static uint8_t draw_image(uint32_t *words, uint8_t leader_states, uint8_t follower_words, uint32_t low)
{
    words[0] = (uint32_t)leader_states << 24 | (uint32_t)follower_words << 16;
    if (follower_words) words[0] |= low;
    if (leader_states && draw() >> 31) words[0] |= MOTORCADE_FLOW_DECIDES;
    for (uint8_t i = 0; i < leader_states + follower_words; i++) words[1 + i] = draw() & 0xFFFFF800U;
    if (words[0] & MOTORCADE_FLOW_DECIDES) {
        for (uint8_t i = 0; i < leader_states; i++) words[1 + i] = leader_word(words[1 + i], words[0]);
    }
    return 1 + leader_states + follower_words;
}

static void begin_program(void)
{
    if (!car.leads) return;
    motorcade_decisions_survey(decisions, &image, 0, MOST_IMAGE_WORDS, car.levels);
    motorcade_step_begin_program(&car, now);
}

static void new_car(void)
{
    const uint32_t random = draw();
    draw_image(image.words, random & 7, random >> 3 & 7, 256UL << (random >> 7 & 7) | (random >> 6 & 1));
    /* Every fourth car begins shortly before the clock wraps. */
    now = draw() & MOTORCADE_TICKS_TICKS_MASK;
    if ((random >> 10 & 3) == 0) now |= 0x3FFF0000U;
    car.leads = random >> 12 & 1;
    car.notes_flow = 1;
    car.memory = memory;
    car.decisions = decisions;
    car.image = &image;
    car.levels = LEVELS[(random >> 18 & 255) % 3];
    motorcade_brain_switch_on(memory, draw(), now);
    motorcade_receiver_switch_on(receiver, 6 + (random >> 14 & 15));
    line_at = line_end = 0;
    begin_program();
}

static void put_word(uint32_t word)
{
    for (uint8_t i = 0; i < 4; i++) line[line_end++] = (uint8_t)(word >> (24 - 8 * i));
}

/* Put an image, an announced one, a request or noise on the line; some have a bit flipped. */
static void new_line(void)
{
    const uint32_t random = draw();
    line_at = line_end = 0;
    if ((random & 7) == 0) put_word(random >> 3 & 1 ? 0 : MOTORCADE_RECEIVER_READBACK_HEADER);
    const uint8_t begin = (random >> 4 & 1) ? MOTORCADE_REQUEST_CHECK_BYTES : 0;
    const uint8_t at = line_end;
    line_end += begin;
    uint32_t words[MOST_IMAGE_WORDS];
    const uint8_t count = draw_image(words, random >> 5 & 7, random >> 8 & 7, 256UL << (random >> 11 & 7) | (random >> 14 & 1));
    for (uint8_t i = 0; i < count; i++) put_word(words[i]);
    if (begin) {
        const uint8_t end = line_end;
        const uint32_t crc = motorcade_blocks_crc32_of(line, at + begin, end, 0);
        line_end = at;
        put_word(MOTORCADE_REQUEST_CHECK_HEADER);
        for (uint8_t i = 0; i < 4; i++) {
            put_word(MOTORCADE_REQUEST_MARKS | (crc >> (24 - 8 * i) & 255) << MOTORCADE_REQUEST_PAYLOAD_AT);
        }
        put_word(MOTORCADE_REQUEST_MARKS | (random >> 15 & 255) << MOTORCADE_REQUEST_PAYLOAD_AT);
        line_end = end;
    }
    if ((random >> 24 & 3) == 0) line[(random >> 26) % line_end] ^= 1 << (random >> 23 & 7);
    if (random >> 30 == 0) line_end -= line_end / 4;
}

static void take_image(const uint8_t *bytes)
{
    for (uint8_t i = 0; i < receiver[MOTORCADE_RECEIVER_LENGTH] / 4; i++, bytes += 4) {
        image.words[i] = (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
    }
    begin_program();
}

static uint8_t take_events(void)
{
    uint8_t event;
    while ((event = motorcade_receiver_next_event(receiver, buffer, 3, now)) > MOTORCADE_RECEIVER_WORKING) {
        add(event);
        for (uint8_t i = 0; i < MOTORCADE_RECEIVER_SIZE; i++) add(receiver[i]);
        if (event == MOTORCADE_RECEIVER_IMAGE) take_image(buffer + receiver[MOTORCADE_RECEIVER_START]);
    }
    return event;
}

static void serve_serial(void)
{
    if (line_at == line_end && (bits >> 18 & 15) == 0) new_line();
    take_events();
    uint8_t count = bits >> 22 & 31;
    const uint16_t room = motorcade_receiver_room(receiver, buffer, now);
    if (count > line_end - line_at) count = line_end - line_at;
    if (count > room) count = (uint8_t)room;
    if (count == 0) return;
    for (uint8_t i = 0; i < count; i++) buffer[receiver[MOTORCADE_RECEIVER_END] + i] = line[line_at++];
    motorcade_receiver_add(receiver, count, now);
    add(take_events());
}

static void step(uint32_t number)
{
    if (number % STEPS_OF_A_CAR == 0) new_car();
    bits = draw();
    now = motorcade_ticks_later_ms(now, (uint32_t)ADVANCES_MS[bits >> 28] << (car.levels == LEVELS[2] ? 7 : 0));
    serve_serial();
    motorcade_step_step(&car, now);
    if (number % 8 == 0) {
        for (uint8_t i = 0; i < MOTORCADE_BRAIN_SIZE; i++) add(memory[i]);
        for (uint8_t i = 0; i < MOTORCADE_DECISIONS_SIZE && car.leads; i++) add(decisions[i]);
    }
}

#ifdef __AVR__

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

static void print_sum(void)
{
    for (uint8_t digit = 0; digit < 9; digit++) {
        const uint8_t value = sum >> (28 - 4 * digit) & 15;
        while (!(UCSR0A & _BV(UDRE0))) { }
        UDR0 = digit == 8 ? '\n' : value < 10 ? '0' + value : 'a' + value - 10;
    }
}

int main(void)
{
    UBRR0 = 0;
    UCSR0B = _BV(TXEN0);
    state = SEED;
    for (uint32_t number = 0; number < STEPS; number++) {
        step(number);
        if ((number + 1) % STEPS_OF_A_LINE == 0) print_sum();
    }
    cli();
    sleep_mode();
}

#else

#include <stdlib.h>

int main(int count, char **arguments)
{
    if (count != 3) return 2;
    state = (uint32_t)strtoul(arguments[1], NULL, 0);
    const uint32_t steps = (uint32_t)strtoul(arguments[2], NULL, 0);
    for (uint32_t number = 0; number < steps; number++) {
        step(number);
        if ((number + 1) % STEPS_OF_A_LINE == 0) printf("%08lx\n", (unsigned long)sum);
    }
    return 0;
}

#endif
