// The pins of your car: write your board's numbers instead of NO_PIN, for the parts that it has. A motor has
// forward, backward, enable; floor has left, right. Leave alone the pins that the board itself needs, for
// its flash memory or its USB line: its manual names them.
#ifndef MOTORCADE_CAR_SETTINGS
#define MOTORCADE_CAR_SETTINGS

#include <MotorcadeSettings.h>

using motorcade::NO_PIN;

static const motorcade::CarSettings CAR = {
    {0, 1000, 2000, 3000, 1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000, 100, 200, 300, 400, 100, 560, 5, 250, 6, 110, 3520, 2, 10000},  // levels
    115200,  // baud
    2000,  // range_mm
    {NO_PIN, NO_PIN, NO_PIN},  // left_motor
    {NO_PIN, NO_PIN, NO_PIN},  // right_motor
    {0, 85, 170, 255},  // drive_duties
    {0, 85, 170, 255},  // turn_duties
    {NO_PIN, NO_PIN, NO_PIN, NO_PIN},  // leds
    NO_PIN,  // trigger
    NO_PIN,  // echo
    {NO_PIN},  // pir
    {NO_PIN, NO_PIN},  // floor
    NO_PIN,  // infrared_receiver
    NO_PIN,  // infrared_sender
    NO_PIN,  // voice
    0,  // voice_baud
    nullptr,  // voice_patterns
    0,  // voice_pattern_count
};

#endif
