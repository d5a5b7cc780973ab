// Made from the pin file of 'Makeblock mBot' by motorcade arduino-library: don't edit.
#ifndef MOTORCADE_CAR_SETTINGS
#define MOTORCADE_CAR_SETTINGS

#if !defined(__AVR_ATmega328P__) && !defined(__AVR_ATmega328__)
#error "This sketch is for the pins of this board: Arduino Uno or Nano. Choose it in the menu Tools. For another board begin with the example AnyBoard."
#endif

#include <MotorcadeSettings.h>

using motorcade::NO_PIN;

static const uint32_t LEVELS[] = {0, 1000, 2000, 3000, 1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000, 100, 200, 300, 400, 100, 560, 5, 250, 6, 110, 3520, 2, 10000};

extern const motorcade::CarSettings CAR;
constexpr motorcade::CarSettings CAR = {
    LEVELS,  // levels
    115200,  // baud
    2000,  // range_mm
    {NO_PIN, NO_PIN, 6, 7, 0},  // left_motor
    {NO_PIN, NO_PIN, 5, 4, 1},  // right_motor
    {NO_PIN, NO_PIN, NO_PIN, NO_PIN, 1},  // left_rear_motor
    {NO_PIN, NO_PIN, NO_PIN, NO_PIN, 1},  // right_rear_motor
    NO_PIN,  // standby
    {0, 85, 170, 255},  // drive_duties
    {0, 85, 170, 255},  // turn_duties
    100,  // left_duty_percent
    100,  // right_duty_percent
    {NO_PIN, NO_PIN, NO_PIN, NO_PIN},  // leds
    13,  // pixels
    2,  // pixel_count
    17,  // trigger
    17,  // echo
    {NO_PIN},  // pir
    {9, 10},  // floor
    0,  // floor_dark
    0,  // floor_threshold
    21,  // button
    0,  // button_pressed
    5,  // button_threshold
    2,  // infrared_receiver
    3,  // infrared_sender
    8,  // horn
    NO_PIN,  // voice
    0,  // voice_baud
    nullptr,  // voice_patterns
    0,  // voice_pattern_count
};

#endif
