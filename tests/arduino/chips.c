/* Several AVR chips in one process, on libsimavr, with one clock and infrared light between them.
 *
 * Chips run in slices of SLICE cycles, one after the other. What a chip sends by infrared reaches the others
 * DELAY cycles later, as a demodulating receiver reports it; DELAY is longer than a slice, so the order in which chips
 * run doesn't matter. */
#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

DEFINE_FIFO(uint16_t, uart_fifo);

#define FREQUENCY 16000000
#define SLICE 1600
#define DELAY 4800
#define GAP 640    /* no rising edge for so long: the carrier has ended */
#define PERIOD 421 /* of the carrier */
#define MOST_CHIPS 8
#define PAINT 0xC5
/* The same on both chips; EEDR and EEAR follow it. */
#define EECR_ADDRESS 0x3F
#define EEMPE_BIT 4
#define EEPE_BIT 2
#define MCUSR_ADDRESS 0x54
#define EXTERNAL_RESET_BIT 2
#define SUPPLY_MV 5000

typedef struct {
    uint64_t cycle;
    uint32_t what, value;
} record_t;

typedef struct {
    record_t *records;
    size_t count, room;
} log_t;

typedef struct world_t world_t;

typedef struct {
    world_t *world;
    avr_t *avr;
    int index;
    avr_irq_t *uart_in, *receiver;
    avr_uart_t *uart;
    uint8_t *to_send;
    size_t to_send_count, sent;
    log_t received, edges, eeprom, light, pins, outputs;
    size_t light_given, pins_given;
    int records_edges;
    uint64_t byte_cycles;
    uint32_t overruns;
    /* infrared */
    uint64_t rises[SLICE / 100 + 8];
    size_t rise_count;
    uint64_t last_rise;
    int carrier_on, lights;
    uint32_t level;
    uint32_t hears;
    uint8_t *eeprom_before;
    /* how long the chip is awake at a stretch */
    int sleeps;
    uint64_t woke, longest_awake, awake;
} chip_t;

struct world_t {
    chip_t chips[MOST_CHIPS];
    int count;
    uint64_t now;
};

static void quiet(avr_t *avr, const int level, const char *format, va_list arguments) {
    (void)avr, (void)level, (void)format, (void)arguments;
}

static void append(log_t *log, uint64_t cycle, uint32_t what, uint32_t value) {
    if (log->count == log->room) {
        log->room = log->room ? 2 * log->room : 256;
        log->records = realloc(log->records, log->room * sizeof(record_t));
    }
    log->records[log->count++] = (record_t){cycle, what, value};
}

static void slept(avr_t *avr, avr_cycle_count_t cycles) {
    chip_t *chip = avr->data ? (chip_t *)avr->custom.data : NULL;
    (void)cycles;
    if (chip && !chip->sleeps) {
        uint64_t awake = avr->cycle - chip->woke;
        if (awake > chip->longest_awake) chip->longest_awake = awake;
        chip->awake += awake;
        chip->sleeps = 1;
    }
}

static void byte_came_out(avr_irq_t *irq, uint32_t value, void *param) {
    chip_t *chip = param;
    (void)irq;
    append(&chip->received, chip->avr->cycle, 0, value & 0xFF);
}

static void carrier_pin(avr_irq_t *irq, uint32_t value, void *param) {
    chip_t *chip = param;
    (void)irq;
    /* A pin that stays as it is is reported, too. */
    if (chip->level == (value & 1)) return;
    chip->level = value & 1;
    if (chip->records_edges) append(&chip->edges, chip->avr->cycle, 0, chip->level);
    if (chip->level && chip->rise_count < sizeof(chip->rises) / sizeof(chip->rises[0]))
        chip->rises[chip->rise_count++] = chip->avr->cycle;
}

static void output_pin(avr_irq_t *irq, uint32_t value, void *param) {
    chip_t *chip = param;
    if (chip->outputs.count && chip->outputs.records[chip->outputs.count - 1].value == (value & 1)) return;
    append(&chip->outputs, chip->avr->cycle, irq->irq, value & 1);
}

static avr_cycle_count_t end_of_slice(avr_t *avr, avr_cycle_count_t when, void *param) {
    (void)avr, (void)param;
    return when + SLICE;
}

static avr_cycle_count_t next_byte(avr_t *avr, avr_cycle_count_t when, void *param) {
    chip_t *chip = param;
    (void)avr;
    if (chip->sent == chip->to_send_count) return 0;
    /* The hardware holds two bytes; simavr holds 64, and lets each wait for a byte's time, which has passed here. */
    if (uart_fifo_get_read_size(&chip->uart->input) >= 2) chip->overruns++;
    avr_cycle_count_t byte_cycles = chip->uart->cycles_per_byte;
    chip->uart->cycles_per_byte = 1;
    avr_raise_irq(chip->uart_in, chip->to_send[chip->sent++]);
    chip->uart->cycles_per_byte = byte_cycles;
    return when + chip->byte_cycles;
}

static uint8_t *eeprom_of(chip_t *chip) {
    avr_eeprom_desc_t content = {.ee = NULL, .offset = 0, .size = 0};
    avr_ioctl(chip->avr, AVR_IOCTL_EEPROM_GET, &content);
    return content.ee;
}

static avr_cycle_count_t eeprom_is_ready(avr_t *avr, avr_cycle_count_t when, void *param) {
    (void)when, (void)param;
    avr->data[EECR_ADDRESS] &= ~EEPE_BIT;
    return 0;
}

/* simavr writes a byte of EEPROM at once and knows no erasing and writing alone: do both as the data sheet has it. */
static void eeprom_write(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
    chip_t *chip = param;
    if ((value & (EEMPE_BIT | EEPE_BIT)) != (EEMPE_BIT | EEPE_BIT)) return;
    uint32_t at = (avr->data[address + 3] << 8 | avr->data[address + 2]) & avr->e2end;
    uint8_t data = avr->data[address + 1], mode = value >> 4 & 3, old = chip->eeprom_before[at];
    uint8_t new = mode == 1 ? 0xFF : mode == 2 ? old & data : data;
    eeprom_of(chip)[at] = chip->eeprom_before[at] = new;
    append(&chip->eeprom, avr->cycle, at << 8 | old, new);
    avr->data[address] |= EEPE_BIT;
    avr_cycle_timer_register_usec(avr, mode == 0 ? 3400 : 1800, eeprom_is_ready, chip);
}

static avr_cycle_count_t next_light(avr_t *avr, avr_cycle_count_t when, void *param) {
    chip_t *chip = param;
    (void)when;
    while (chip->light_given < chip->light.count && chip->light.records[chip->light_given].cycle <= avr->cycle)
        avr_raise_irq(chip->receiver, chip->light.records[chip->light_given++].value);
    return chip->light_given < chip->light.count ? chip->light.records[chip->light_given].cycle : 0;
}

static avr_cycle_count_t next_pin(avr_t *avr, avr_cycle_count_t when, void *param) {
    chip_t *chip = param;
    (void)when;
    while (chip->pins_given < chip->pins.count && chip->pins.records[chip->pins_given].cycle <= avr->cycle) {
        record_t *next = &chip->pins.records[chip->pins_given++];
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(next->what >> 8), next->what & 7), next->value);
    }
    return chip->pins_given < chip->pins.count ? chip->pins.records[chip->pins_given].cycle : 0;
}

world_t *world_new(void) {
    avr_global_logger_set(quiet);
    return calloc(1, sizeof(world_t));
}

/* Add a chip with a program; returns its index, -1 for a program or a chip that can't be had. */
int world_add(world_t *world, const char *mmcu, const char *elf, const uint8_t *eeprom, uint32_t eeprom_bytes,
              uint32_t paint_from) {
    chip_t *chip = &world->chips[world->count];
    elf_firmware_t firmware;
    memset(&firmware, 0, sizeof(firmware));
    if (world->count == MOST_CHIPS || elf_read_firmware(elf, &firmware) != 0) return -1;
    chip->world = world;
    chip->index = world->count;
    chip->hears = ~0u;
    chip->avr = avr_make_mcu_by_name(mmcu);
    if (!chip->avr) return -1;
    avr_init(chip->avr);
    avr_load_firmware(chip->avr, &firmware);
    chip->avr->frequency = FREQUENCY;
    chip->avr->vcc = chip->avr->avcc = chip->avr->aref = SUPPLY_MV;
    chip->avr->log = LOG_NONE;
    chip->avr->custom.data = (void *)chip;
    chip->avr->sleep = slept;
    chip->avr->cycle = chip->woke = world->now;
    memset(chip->avr->data + paint_from, PAINT, chip->avr->ramend + 1 - paint_from);
    if (eeprom) {
        avr_eeprom_desc_t content = {.ee = (uint8_t *)eeprom, .offset = 0, .size = eeprom_bytes};
        avr_ioctl(chip->avr, AVR_IOCTL_EEPROM_SET, &content);
    }
    chip->eeprom_before = malloc(chip->avr->e2end + 1);
    memcpy(chip->eeprom_before, eeprom_of(chip), chip->avr->e2end + 1);
    avr_register_io_write(chip->avr, EECR_ADDRESS, eeprom_write, chip);
    uint32_t flags = 0;
    avr_ioctl(chip->avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    chip->uart_in = avr_io_getirq(chip->avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(chip->avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), byte_came_out, chip);
    for (avr_io_t *io = chip->avr->io_port; io; io = io->next)
        if (!strcmp(io->kind, "uart") && ((avr_uart_t *)io)->name == '0') chip->uart = (avr_uart_t *)io;
    chip->byte_cycles = FREQUENCY * 10 / 115200;
    avr_cycle_timer_register(chip->avr, SLICE, end_of_slice, chip);
    return world->count++;
}

void world_free(world_t *world) {
    for (int i = 0; i < world->count; i++) {
        chip_t *chip = &world->chips[i];
        log_t *logs[] = {&chip->received, &chip->edges, &chip->eeprom, &chip->light, &chip->pins, &chip->outputs};
        for (size_t j = 0; j < sizeof(logs) / sizeof(logs[0]); j++) free(logs[j]->records);
        free(chip->to_send);
        free(chip->eeprom_before);
        avr_terminate(chip->avr);
        free(chip->avr);
    }
    free(world);
}

/* Wire the pin that sends infrared and the one that a receiver's output leads to; a port of 0 is none. */
void chip_infrared(world_t *world, int index, char out_port, int out_bit, char in_port, int in_bit) {
    chip_t *chip = &world->chips[index];
    if (out_port)
        avr_irq_register_notify(avr_io_getirq(chip->avr, AVR_IOCTL_IOPORT_GETIRQ(out_port), out_bit), carrier_pin, chip);
    if (in_port) {
        chip->receiver = avr_io_getirq(chip->avr, AVR_IOCTL_IOPORT_GETIRQ(in_port), in_bit);
        avr_raise_irq(chip->receiver, 1);
    }
}

void chip_hears(world_t *world, int index, uint32_t senders) { world->chips[index].hears = senders; }

/* Set an input pin so many cycles from now; calls come in the order of time. */
void chip_set_pin(world_t *world, int index, char port, int bit, int level, uint32_t cycles) {
    chip_t *chip = &world->chips[index];
    int idle = chip->pins_given == chip->pins.count;
    append(&chip->pins, chip->avr->cycle + cycles, port << 8 | bit, level);
    if (idle) avr_cycle_timer_register(chip->avr, cycles ? cycles : 1, next_pin, chip);
}

/* Log the edges of one output. */
void chip_watch(world_t *world, int index, char port, int bit) {
    chip_t *chip = &world->chips[index];
    avr_irq_register_notify(avr_io_getirq(chip->avr, AVR_IOCTL_IOPORT_GETIRQ(port), bit), output_pin, chip);
}

/* Set the voltage at an analog input. */
void chip_set_voltage(world_t *world, int index, int channel, uint32_t millivolts) {
    avr_raise_irq(avr_io_getirq(world->chips[index].avr, AVR_IOCTL_ADC_GETIRQ, channel), millivolts);
}

void chip_record_edges(world_t *world, int index, int on) { world->chips[index].records_edges = on; }

void chip_read(world_t *world, int index, uint32_t address, uint8_t *data, uint32_t count) {
    memcpy(data, world->chips[index].avr->data + address, count);
}

void chip_eeprom(world_t *world, int index, uint8_t *data) {
    memcpy(data, eeprom_of(&world->chips[index]), world->chips[index].avr->e2end + 1);
}

/* Write a program beside the one that is there, such as a boot loader, and begin at `start` as after an external reset. */
void chip_boot(world_t *world, int index, const uint8_t *code, uint32_t count, uint32_t start) {
    avr_t *avr = world->chips[index].avr;
    if (count) memcpy(avr->flash + start, code, count);
    avr->codeend = avr->flashend;
    avr->reset_pc = start;
    avr_reset(avr);
    avr->data[MCUSR_ADDRESS] = EXTERNAL_RESET_BIT;
}

/* Send bytes to the chip's UART, one behind the other at 115200 baud. */
void chip_send(world_t *world, int index, const uint8_t *data, uint32_t count) {
    chip_t *chip = &world->chips[index];
    int idle = chip->sent == chip->to_send_count;
    chip->to_send = realloc(chip->to_send, chip->to_send_count + count + 1);
    memcpy(chip->to_send + chip->to_send_count, data, count);
    chip->to_send_count += count;
    if (idle && count) avr_cycle_timer_register(chip->avr, chip->byte_cycles, next_byte, chip);
}

uint64_t chip_number(world_t *world, int index, int what) {
    chip_t *chip = &world->chips[index];
    switch (what) {
        case 0: return chip->overruns;
        case 1: return chip->longest_awake;
        case 2: return chip->awake;
        case 3: chip->longest_awake = 0; return 0;
        default: return 0;
    }
}

/* Copy a log's records from `from` on; returns how many there are in all. */
uint64_t chip_log(world_t *world, int index, int which, uint64_t from, record_t *records, uint64_t most) {
    chip_t *chip = &world->chips[index];
    log_t *logs[] = {&chip->received, &chip->edges, &chip->eeprom, &chip->light, &chip->outputs};
    log_t *log = logs[which];
    for (uint64_t i = 0; i < most && from + i < log->count; i++) records[i] = log->records[from + i];
    return log->count;
}

static void shine(world_t *world, int sender, uint64_t cycle, int on) {
    for (int i = 0; i < world->count; i++) {
        chip_t *chip = &world->chips[i];
        if (!chip->receiver || !(chip->hears >> sender & 1)) continue;
        int before = chip->lights > 0;
        chip->lights += on ? 1 : -1;
        if (before == (chip->lights > 0)) continue;
        int idle = chip->light_given == chip->light.count;
        uint64_t when = cycle + DELAY;
        append(&chip->light, when, 0, !(chip->lights > 0));
        if (idle) avr_cycle_timer_register(chip->avr, when > chip->avr->cycle ? when - chip->avr->cycle : 1, next_light, chip);
    }
}

/* Turn the rising edges of all carriers in a slice into light and dark, in the order of time. */
static void infrared(world_t *world) {
    for (;;) {
        chip_t *first = NULL;
        uint64_t when = world->now;
        int on = 0;
        for (int i = 0; i < world->count; i++) {
            chip_t *chip = &world->chips[i];
            uint64_t next = chip->rise_count ? chip->rises[0] : world->now;
            if (chip->carrier_on && next - chip->last_rise > GAP) {
                if (chip->last_rise + PERIOD <= when) first = chip, when = chip->last_rise + PERIOD, on = 0;
            } else if (chip->rise_count && next <= when) {
                first = chip, when = next, on = 1;
            }
        }
        if (!first) return;
        if (on) {
            if (!first->carrier_on) shine(world, first->index, when, 1);
            first->last_rise = when;
            memmove(first->rises, first->rises + 1, --first->rise_count * sizeof(first->rises[0]));
        } else {
            shine(world, first->index, when, 0);
        }
        first->carrier_on = on;
    }
}

/* Run all chips up to a cycle. Returns 0, or 1 more than the index of a chip that stopped for ever. */
int world_run(world_t *world, uint64_t until) {
    while (world->now < until) {
        world->now += SLICE;
        for (int i = 0; i < world->count; i++) {
            chip_t *chip = &world->chips[i];
            while (chip->avr->cycle < world->now) {
                int state = avr_run(chip->avr);
                if (state == cpu_Done || state == cpu_Crashed) return i + 1;
                if (state == cpu_Running && chip->sleeps) chip->sleeps = 0, chip->woke = chip->avr->cycle;
            }
        }
        infrared(world);
    }
    return 0;
}
