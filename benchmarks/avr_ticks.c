/* Measure the cycles of a tick of the brain on an ATmega328P: avr.py runs this program in simavr.
 *
 * It prints a line for each kind of car: mean and worst cycles. The image is in RAM, and the board's functions do next to
 * nothing, so that the figures are those of the brain alone.
 */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdio.h>

#include "motorcade_brain.h"

#define TICKS 4000
#define TICK_MS 20
/* Bytes that come in a tick at 115200 baud, and words that a tick checks. */
#define BYTES_A_TICK 230
#define WORDS_A_TICK 8
#define UPLOAD_WORDS 121

#define FLOW_WORDS 16

struct motorcade_image {
    uint32_t words[2 + FLOW_WORDS];
};

static const uint32_t LEVELS[25] = {0, 1000, 2000, 3000, 1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000, 100,
                                    200, 300, 400, 100, 560, 5, 250, 6, 110, 3520, 2, 10000};
static uint32_t memory[MOTORCADE_BRAIN_SIZE], receiver[MOTORCADE_RECEIVER_SIZE];
static uint8_t decisions[MOTORCADE_DECISIONS_SIZE];
static struct motorcade_senses senses = {.obstacle_mm = 1000};
static uint8_t buffer[UPLOAD_WORDS * 4];
static struct motorcade_image image;
static struct motorcade_car car = {0, memory, decisions, &image, LEVELS, 0};
static uint32_t now, arriving;
static volatile uint16_t overflows;

ISR(TIMER1_OVF_vect) { overflows++; }

static uint32_t cycles(void)
{
    cli();
    uint16_t low = TCNT1, high = overflows;
    if ((TIFR1 & _BV(TOV1)) && low < 0x8000) high++;
    sei();
    return (uint32_t)high << 16 | low;
}

static int print(char sign, FILE *file)
{
    (void)file;
    while (!(UCSR0A & _BV(UDRE0))) { }
    UDR0 = sign;
    return 0;
}
static FILE uart = FDEV_SETUP_STREAM(print, 0, _FDEV_SETUP_WRITE);

uint32_t motorcade_image_word(const struct motorcade_image *of, uint32_t index) { return of->words[index]; }
void motorcade_car_note(struct motorcade_car *of, uint8_t kind, uint32_t at_ms, uint32_t word, uint32_t detail)
{
    (void)of, (void)kind, (void)at_ms, (void)word, (void)detail;
}
void motorcade_car_note_end(struct motorcade_car *of) { (void)of; }
void motorcade_car_note_flow(struct motorcade_car *of, uint8_t index) { (void)of, (void)index; }
uint32_t motorcade_car_received_frames(struct motorcade_car *of, uint32_t *next)
{
    (void)of;
    *next = arriving;
    arriving = 0;
    return *next != 0;
}
void motorcade_car_note_frame(struct motorcade_car *of, uint32_t frame, uint8_t result)
{
    (void)of, (void)frame, (void)result;
}
uint8_t motorcade_car_heard_voice(struct motorcade_car *of) { return (void)of, 0; }
const struct motorcade_senses *motorcade_car_sense(struct motorcade_car *of, uint32_t looks_mm)
{
    return (void)of, (void)looks_mm, &senses;
}
void motorcade_car_set_outputs(struct motorcade_car *of, uint8_t wheels, const struct motorcade_senses *sensed)
{
    (void)wheels, (void)sensed;
    motorcade_brain_lit_led(of->memory, now, of->levels);
}
uint8_t motorcade_car_air_is_busy(struct motorcade_car *of) { return (void)of, 0; }
void motorcade_car_send_frame(struct motorcade_car *of, uint32_t frame) { (void)of, (void)frame; }

static void print_line(const char *name, uint32_t sum, uint16_t count, uint32_t worst)
{
    printf("%s %lu %lu\n", name, (unsigned long)(sum / count), (unsigned long)worst);
}

static uint32_t step(uint32_t *worst)
{
    const uint32_t begin = cycles();
    motorcade_step_step(&car, now);
    const uint32_t took = cycles() - begin;
    if (took > *worst) *worst = took;
    now = motorcade_ticks_later_ms(now, TICK_MS);
    return took;
}

/* A leader that executes FLOW_WORDS flow words in each tick: all draw a number, and none is a state. It sends frames. */
static void run_flow(void)
{
    uint32_t sum = 0, worst = 0;
    image.words[0] = (uint32_t)FLOW_WORDS << 24 | 0x010100UL | MOTORCADE_FLOW_TAGGED | MOTORCADE_FLOW_DECIDES;
    image.words[1 + FLOW_WORDS] = 0xE5A80000;
    for (uint8_t i = 0; i < FLOW_WORDS; i++) image.words[1 + i] = 0x80060100UL | (uint32_t)((i + 1) % FLOW_WORDS) << 20;
    car.leads = 1;
    motorcade_brain_switch_on(memory, 7, now);
    motorcade_decisions_survey(decisions, &image, 0, 1 + FLOW_WORDS, LEVELS);
    motorcade_step_begin_program(&car, now);
    for (uint16_t i = 0; i < TICKS; i++) sum += step(&worst);
    print_line("leader-decides", sum, TICKS, worst);
}

static void run(const char *name, uint8_t leads, uint8_t is_tagged)
{
    /* A leader with 3 states, and 3 follower words that are passed on; one drives at random and avoids obstacles. */
    static const uint32_t WORDS[6] = {0x65880000, 0x7B9CC000, 0x6B000000, 0xE5A80000, 0xFB9CC000, 0xEB500000};
    uint32_t sum = 0, worst = 0;
    uint8_t tag = 0;
    image.words[0] = 0x03030100UL | is_tagged;
    for (uint8_t i = 0; i < 6; i++) image.words[1 + i] = WORDS[i];
    car.leads = leads;
    now = 0x3FFFFF00;
    motorcade_brain_switch_on(memory, 7, now);
    if (leads) motorcade_step_begin_program(&car, now);
    for (uint16_t i = 0; i < TICKS; i++) {
        if (!leads && i % 25 == 0) {
            arriving = WORDS[3 + i / 50 % 3];
            if (i % 50 == 0) tag = motorcade_infrared_next_tag(tag, arriving);
            arriving = is_tagged ? motorcade_infrared_tagged_frame(arriving, tag) : motorcade_infrared_to_frame(arriving);
        }
        sum += step(&worst);
    }
    print_line(name, sum, TICKS, worst);
}

/* An image of UPLOAD_WORDS words at 115200 baud. */
static void run_upload(void)
{
    uint32_t sum = 0, worst = 0;
    uint16_t sent = 0, count = 0;
    motorcade_receiver_switch_on(receiver, UPLOAD_WORDS);
    for (uint8_t event = 0; event != MOTORCADE_RECEIVER_IMAGE; count++) {
        const uint16_t room = motorcade_receiver_room(receiver, buffer, now);
        uint16_t comes = UPLOAD_WORDS * 4 - sent < BYTES_A_TICK ? UPLOAD_WORDS * 4 - sent : BYTES_A_TICK;
        if (comes > room) comes = room;
        for (uint16_t i = 0; i < comes; i++, sent++) {
            buffer[receiver[MOTORCADE_RECEIVER_END] + i] = sent == 0 ? UPLOAD_WORDS - 1 : sent < 4 ? 0 : (sent % 4 < 2 ? 0x65 : 0);
        }
        const uint32_t begin = cycles();
        if (comes) motorcade_receiver_add(receiver, comes, now);
        event = motorcade_receiver_next_event(receiver, buffer, WORDS_A_TICK, now);
        const uint32_t took = cycles() - begin;
        sum += took;
        if (took > worst) worst = took;
        now = motorcade_ticks_later_ms(now, TICK_MS);
    }
    print_line("receiver", sum, count, worst);
}

int main(void)
{
    UCSR0B = _BV(TXEN0);
    stdout = &uart;
    TCCR1B = _BV(CS10);
    TIMSK1 = _BV(TOIE1);
    sei();
    run("follower-bare", 0, 0);
    run("follower-tagged", 0, 1);
    run("leader-bare", 1, 0);
    run("leader-tagged", 1, 1);
    run_flow();
    run_upload();
    cli();
    sleep_mode();
}
