// Made from the pin file of 'Classroom car with an Arduino Mega' by motorcade arduino-library: don't edit.
#ifndef MOTORCADE_CAR_SETTINGS
#define MOTORCADE_CAR_SETTINGS

#if !defined(__AVR_ATmega2560__) && !defined(__AVR_ATmega1280__)
#error "This sketch is for the pins of this board: Arduino Mega 2560. Choose it in the menu Tools. For another board begin with the example AnyBoard."
#endif

#include <MotorcadeSettings.h>

using motorcade::NO_PIN;

static const uint32_t LEVELS[] = {0, 1000, 2000, 3000, 1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000, 100, 200, 300, 400, 100, 560, 5, 250, 6, 110, 3520, 2, 10000};

extern const motorcade::CarSettings CAR;
constexpr motorcade::CarSettings CAR = {
    LEVELS,  // levels
    115200,  // baud
    2000,  // range_mm
    {7, 8, 5, NO_PIN, 1},  // left_motor
    {9, 12, 6, NO_PIN, 1},  // right_motor
    {NO_PIN, NO_PIN, NO_PIN, NO_PIN, 1},  // left_rear_motor
    {NO_PIN, NO_PIN, NO_PIN, NO_PIN, 1},  // right_rear_motor
    NO_PIN,  // standby
    {0, 115, 180, 255},  // drive_duties
    {0, 115, 180, 255},  // turn_duties
    100,  // left_duty_percent
    100,  // right_duty_percent
    {22, 23, 24, 25},  // leds
    NO_PIN,  // pixels
    1,  // pixel_count
    4,  // trigger
    3,  // echo
    {11},  // pir
    {26, 27},  // floor
    1,  // floor_dark
    0,  // floor_threshold
    NO_PIN,  // button
    0,  // button_pressed
    0,  // button_threshold
    2,  // infrared_receiver
    10,  // infrared_sender
    NO_PIN,  // horn
    NO_PIN,  // voice
    0,  // voice_baud
    nullptr,  // voice_patterns
    0,  // voice_pattern_count
};

#endif
