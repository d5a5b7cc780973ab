// Made from the pin file of 'Classroom car with an Arduino Mega' by motorcade arduino-library: don't edit.
#ifndef MOTORCADE_CAR_SETTINGS
#define MOTORCADE_CAR_SETTINGS

#if !defined(__AVR_ATmega2560__) && !defined(__AVR_ATmega1280__)
#error "This sketch is for the pins of this board: Arduino Mega 2560. Choose it in the menu Tools. For another board begin with the example AnyBoard."
#endif

#include <MotorcadeSettings.h>

using motorcade::NO_PIN;

static const motorcade::CarSettings CAR = {
    {0, 1000, 2000, 3000, 1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000, 100, 200, 300, 400, 100, 560, 5, 250, 6, 110, 3520, 2, 10000},  // levels
    115200,  // baud
    2000,  // range_mm
    {7, 8, 5},  // left_motor
    {9, 12, 6},  // right_motor
    {0, 115, 180, 255},  // drive_duties
    {0, 115, 180, 255},  // turn_duties
    {22, 23, 24, 25},  // leds
    4,  // trigger
    3,  // echo
    {11},  // pir
    {26, 27},  // floor
    2,  // infrared_receiver
    10,  // infrared_sender
    NO_PIN,  // voice
    0,  // voice_baud
    nullptr,  // voice_patterns
    0,  // voice_pattern_count
};

#endif
